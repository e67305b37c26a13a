#include "world/formats/archive/inflate.h"

#include <zlib.h>

#include <algorithm>
#include <cstdlib>

#include <fmt/format.h>

namespace world {
namespace {

constexpr size_t kFirstCapacity = 256 << 10;
constexpr size_t kMostPiece = size_t{1} << 30;  // zlib counts in 32 bits
constexpr int kZlibOrGzip = MAX_WBITS + 32;

}  // namespace

struct Inflater::Stream {
  z_stream z{};
  bool ready = false;
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

Result<std::span<const uint8_t>> Inflater::inflate(std::span<const uint8_t> packed, uint64_t limit, size_t* used) {
  z_stream& z = stream_->z;
  if (!stream_->ready || inflateReset2(&z, kZlibOrGzip) != Z_OK) return input_error("no memory is left to inflate");
  size_t done = 0, taken = 0;
  for (;;) {
    if (done == capacity_ || capacity_ == 0) {
      // Twice as much each time, but never beyond what is allowed.
      const uint64_t wanted = std::max<uint64_t>({kFirstCapacity, packed.size() * 2, capacity_ * uint64_t{2}});
      const uint64_t allowed = std::min(limit, capacity_ + budget_.left());
      if (allowed <= done || !grow(static_cast<size_t>(std::min(wanted, allowed)))) {
        return input_error(fmt::format(
            "inflates to more than {} bytes, which a file of this size never needs; it is damaged or made to harm",
            done));
      }
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
    if (!budget_.inflated(made)) {
      return input_error(
          "is part of a file that inflates to more than one of its size ever does; it is damaged or made to harm");
    }
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
