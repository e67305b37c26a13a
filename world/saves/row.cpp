#include "world/saves/row.h"

#include <charconv>
#include <memory>

#include <fmt/format.h>
#include <xxhash.h>
#include <zstd.h>

#include "world/saves/database.h"
#include "world/store/region_stream.h"

namespace world {

std::string_view codec_name(Codec codec) { return codec == Codec::zstd ? "zstd" : "stream"; }

std::optional<Codec> codec_from_name(std::string_view name) {
  for (const Codec codec : {Codec::stream, Codec::zstd})
    if (codec_name(codec) == name) return codec;
  return std::nullopt;
}

int64_t hash_of_bytes(std::span<const char> bytes) {
  return static_cast<int64_t>(XXH3_64bits(bytes.data(), bytes.size()));
}

int64_t hash_of(const RegionRow& row) {
  // The key is hashed too: a flipped coordinate must not move a region silently.
  const std::string key =
      fmt::format("{} {} {} {} {} {} {}\n{}", layer_rows()[static_cast<size_t>(row.layer)].name, row.pos.x, row.pos.y,
                  row.pos.z, row.save, row.voxels, codec_name(row.codec), row.census);
  return static_cast<int64_t>(
      XXH3_64bits_withSeed(row.bytes.data(), row.bytes.size(), XXH3_64bits(key.data(), key.size())));
}

std::string census_text(const Census& census, std::span<const std::string> names) {
  std::string text;
  for (const auto& [block, n] : census) text += fmt::format("{} {} {}\n", block, n, names[block]);
  return text;
}

Result<Census> parse_census(std::string_view text) {
  Census census;
  while (!text.empty()) {
    const size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    unsigned id = 0;
    uint64_t count = 0;
    const char* const last = line.data() + line.size();
    const auto first = std::from_chars(line.data(), last, id);
    if (first.ec != std::errc() || first.ptr == last || *first.ptr != ' ' || id >= kMaxBlocks)
      return input_error("its census is not lines of \"id count name\"");
    const auto second = std::from_chars(first.ptr + 1, last, count);
    if (second.ec != std::errc() || second.ptr == last || *second.ptr != ' ' || count == 0)
      return input_error("its census is not lines of \"id count name\"");
    census[static_cast<BlockId>(id)] = count;
  }
  return census;
}

namespace {

struct FreeContext {
  void operator()(ZSTD_CCtx* c) const { ZSTD_freeCCtx(c); }
  void operator()(ZSTD_DCtx* c) const { ZSTD_freeDCtx(c); }
};

Result<std::string> compress(const std::string& stream, int level) {
  thread_local const std::unique_ptr<ZSTD_CCtx, FreeContext> context(ZSTD_createCCtx());
  if (!context) return input_error("memory ran out while a region was compressed");
  ZSTD_CCtx_reset(context.get(), ZSTD_reset_session_and_parameters);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, level);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  std::string frame(ZSTD_compressBound(stream.size()), '\0');
  const size_t size = ZSTD_compress2(context.get(), frame.data(), frame.size(), stream.data(), stream.size());
  if (ZSTD_isError(size))
    return input_error(std::string("Zstandard could not compress a region: ") + ZSTD_getErrorName(size));
  frame.resize(size);
  frame.shrink_to_fit();
  return frame;
}

}  // namespace

Result<std::string> encode_payload(const PackedRegion& region, RegionPos pos, const PayloadOptions& options) {
  if (options.codec == Codec::stream) return encode_region(region, pos, StreamCompression::blosc);
  TRY(const std::string stream, encode_region(region, pos, StreamCompression::none));
  return compress(stream, options.level);
}

Result<std::string> encode_payload(const FloatLayer& layer, RegionPos pos, const PayloadOptions& options) {
  if (options.codec == Codec::stream) return layer.encode_region(pos, StreamCompression::blosc);
  TRY(const std::string stream, layer.encode_region(pos, StreamCompression::none));
  return compress(stream, options.level);
}

Result<std::string> stream_of(const RegionRow& row) {
  if (row.codec == Codec::stream) return row.bytes;
  const unsigned long long size = ZSTD_getFrameContentSize(row.bytes.data(), row.bytes.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR)
    return input_error("its bytes are no Zstandard frame that states its size");
  if (size > kMostPayloadBytes)
    return input_error(
        fmt::format("its frame claims {} bytes, and no region has more than {}", size, kMostPayloadBytes));
  thread_local const std::unique_ptr<ZSTD_DCtx, FreeContext> context(ZSTD_createDCtx());
  if (!context) return input_error("memory ran out while a region was read");
  std::string stream(size, '\0');
  const size_t got =
      ZSTD_decompressDCtx(context.get(), stream.data(), stream.size(), row.bytes.data(), row.bytes.size());
  if (ZSTD_isError(got)) return input_error(std::string("its Zstandard frame is damaged: ") + ZSTD_getErrorName(got));
  if (got != size) return input_error("its Zstandard frame is shorter than it states");
  return stream;
}

Result<RegionBuilder> decode_blocks(const RegionRow& row, size_t palette_size) {
  TRY(const std::string stream, stream_of(row));
  return decode_region(stream, row.pos, palette_size);
}

}  // namespace world
