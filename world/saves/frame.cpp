#include "world/saves/frame.h"

#include <memory>

#include <fmt/format.h>
#include <zstd.h>

namespace world {

namespace {

struct FreeContext {
  void operator()(ZSTD_CCtx* c) const { ZSTD_freeCCtx(c); }
  void operator()(ZSTD_DCtx* c) const { ZSTD_freeDCtx(c); }
};

}  // namespace

Result<std::string> to_frame(std::string_view bytes, int level) {
  thread_local const std::unique_ptr<ZSTD_CCtx, FreeContext> context(ZSTD_createCCtx());
  if (!context) return input_error("memory ran out while something was compressed");
  ZSTD_CCtx_reset(context.get(), ZSTD_reset_session_and_parameters);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, level);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  std::string frame(ZSTD_compressBound(bytes.size()), '\0');
  const size_t size = ZSTD_compress2(context.get(), frame.data(), frame.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(size)) return input_error(std::string("Zstandard could not compress: ") + ZSTD_getErrorName(size));
  frame.resize(size);
  frame.shrink_to_fit();
  return frame;
}

Result<std::string> from_frame(std::string_view frame, size_t most_bytes) {
  const unsigned long long size = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR)
    return input_error("its bytes are no Zstandard frame that states its size");
  if (size > most_bytes)
    return input_error(
        fmt::format("its frame of {} bytes claims {}, and at most {} can be", frame.size(), size, most_bytes));
  thread_local const std::unique_ptr<ZSTD_DCtx, FreeContext> context(ZSTD_createDCtx());
  if (!context) return input_error("memory ran out while something was read");
  std::string bytes(size, '\0');
  const size_t got = ZSTD_decompressDCtx(context.get(), bytes.data(), bytes.size(), frame.data(), frame.size());
  if (ZSTD_isError(got)) return input_error(std::string("its Zstandard frame is damaged: ") + ZSTD_getErrorName(got));
  if (got != size) return input_error("its Zstandard frame is shorter than it states");
  return bytes;
}

}  // namespace world
