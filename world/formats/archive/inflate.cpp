#include "world/formats/archive/inflate.h"

#include <libdeflate.h>
#include <zlib.h>

#include <algorithm>
#include <cstdlib>

#include <fmt/format.h>

namespace world {
namespace {

constexpr size_t kFirstCapacity = 256 << 10;
constexpr size_t kMostPiece = size_t{1} << 30;  // zlib counts in 32 bits
constexpr int kZlibOrGzip = MAX_WBITS + 32;
constexpr const char* kTooMuchInAll =
    "is part of a file that inflates to more than one of its size ever does; it is damaged or made to harm";

}  // namespace

struct Inflater::Stream {
  z_stream z{};
  bool ready = false;
  std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> whole{
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor};
};

Inflater::Inflater(MemoryBudget& budget) : budget_(budget), stream_(std::make_unique<Stream>()) {
  stream_->ready = inflateInit2(&stream_->z, kZlibOrGzip) == Z_OK;
}

Inflater::~Inflater() {
  if (stream_->ready) inflateEnd(&stream_->z);
  std::free(bytes_);
  budget_.give_back(capacity_);
}

bool Inflater::grow(size_t wanted) {
  if (wanted <= capacity_) return true;
  const size_t more = wanted - capacity_;
  if (!budget_.take(more)) return false;
  void* const grown = std::realloc(bytes_, wanted);
  if (!grown) {
    budget_.give_back(more);
    return false;
  }
  bytes_ = static_cast<uint8_t*>(grown);
  capacity_ = wanted;
  return true;
}

bool Inflater::grow_for(size_t packed, uint64_t limit) {
  // Twice as much each time, but never beyond what is allowed.
  const uint64_t wanted = std::max<uint64_t>({kFirstCapacity, packed * uint64_t{2}, capacity_ * uint64_t{2}});
  const uint64_t allowed = std::min(limit, capacity_ + budget_.left());
  return allowed > capacity_ && grow(static_cast<size_t>(std::min(wanted, allowed)));
}

std::optional<size_t> Inflater::inflate_whole(std::span<const uint8_t> packed, uint64_t limit, size_t* used) {
  const bool gzip = looks_like_gzip(packed);
  if (!stream_->whole || (!gzip && !looks_like_zlib(packed))) return {};
  const auto decompress = gzip ? libdeflate_gzip_decompress_ex : libdeflate_zlib_decompress_ex;
  if (capacity_ == 0 && !grow_for(packed.size(), limit)) return {};
  for (;;) {
    const size_t room = static_cast<size_t>(std::min<uint64_t>(capacity_, limit));
    size_t taken = 0, made = 0;
    const libdeflate_result code =
        decompress(stream_->whole.get(), packed.data(), packed.size(), bytes_, room, &taken, &made);
    if (code == LIBDEFLATE_SUCCESS) {
      if (used) *used = taken;
      return made;
    }
    // Beginning again with twice the room makes at most twice the bytes in all, still in half of zlib's time.
    if (code != LIBDEFLATE_INSUFFICIENT_SPACE || !grow_for(packed.size(), limit)) return {};
  }
}

Result<std::span<const uint8_t>> Inflater::inflate(std::span<const uint8_t> packed, uint64_t limit, size_t* used) {
  if (const auto made = inflate_whole(packed, limit, used)) {
    if (budget_.inflated(*made)) return std::span<const uint8_t>(bytes_, *made);
    return input_error(kTooMuchInAll);
  }
  return inflate_by_pieces(packed, limit, used);
}

Result<std::span<const uint8_t>> Inflater::inflate_by_pieces(std::span<const uint8_t> packed, uint64_t limit,
                                                             size_t* used) {
  z_stream& z = stream_->z;
  if (!stream_->ready || inflateReset2(&z, kZlibOrGzip) != Z_OK) return input_error("no memory is left to inflate");
  size_t done = 0, taken = 0;
  for (;;) {
    if (done == capacity_ && !grow_for(packed.size(), limit)) {
      return input_error(fmt::format(
          "inflates to more than {} bytes, which a file of this size never needs; it is damaged or made to harm",
          done));
    }
    const size_t in = std::min(packed.size() - taken, kMostPiece);
    const size_t out = std::min<size_t>(std::min<uint64_t>(capacity_, limit) - done, kMostPiece);
    z.next_in = const_cast<Bytef*>(packed.data() + taken);
    z.avail_in = static_cast<uInt>(in);
    z.next_out = bytes_ + done;
    z.avail_out = static_cast<uInt>(out);
    const int code = ::inflate(&z, taken + in == packed.size() ? Z_FINISH : Z_NO_FLUSH);
    const size_t ate = in - z.avail_in, made = out - z.avail_out;
    taken += ate;
    done += made;
    if (!budget_.inflated(made)) return input_error(kTooMuchInAll);
    if (code == Z_STREAM_END) break;
    if (code != Z_OK && code != Z_BUF_ERROR) {
      return input_error(fmt::format("its compressed data is damaged after {} of {} bytes ({})", taken, packed.size(),
                                     z.msg ? z.msg : "no reason given"));
    }
    if (out > 0 && z.avail_out > 0 && taken == packed.size())
      return input_error(fmt::format("its compressed data ends after {} bytes; it is cut off", packed.size()));
    if (done == limit) {
      return input_error(fmt::format("inflates to more than {} bytes, the most that is read here", limit));
    }
  }
  if (used) *used = taken;
  return std::span<const uint8_t>(bytes_, done);
}

bool looks_like_gzip(std::span<const uint8_t> bytes) {
  return bytes.size() >= 3 && bytes[0] == 0x1f && bytes[1] == 0x8b && bytes[2] == 8;
}

bool looks_like_zlib(std::span<const uint8_t> bytes) {
  return bytes.size() >= 2 && (bytes[0] & 0x0f) == 8 && (bytes[0] * 256 + bytes[1]) % 31 == 0;
}

}  // namespace world
