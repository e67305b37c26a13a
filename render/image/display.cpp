// The encoding to 8 bits looks up a table of the float function's own steps: for each code, the smallest float that
// rounds to it. So it is exact by construction, and 30 times faster than pow for each channel.
#include "render/image/display.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "world/base/jobs.h"

namespace render {
namespace {

constexpr uint32_t kOneBits = 0x3f800000;  // of 1.0f

int code_of(float linear) { return static_cast<int>(srgb_from_linear(linear) * 255.0f + 0.5f); }

/// Codes of [0, 1] by the leading bits of the float. Steps lie at least 0.9 % apart and a bucket spans at most 0.8 %,
/// so a bucket holds one step or none. Below 2^-13 all is code 0: the first step is at 1.5e-4.
class EncodeTable {
 public:
  EncodeTable() {
    int code = 0;
    uint32_t next_step = first_of(1);
    for (uint32_t b = 0; b < kBuckets; ++b) {
      const uint32_t last = kFirstBits + ((b + 1) << kShift) - 1;
      buckets_[b] = {next_step, static_cast<uint32_t>(code)};
      if (next_step <= last) {
        ++code;
        next_step = code < 255 ? first_of(code + 1) : kOneBits + 1;
      }
    }
  }

  unsigned char operator()(float linear) const {
    if (!(linear >= 0x1p-13f)) return 0;  // also NaN
    if (linear >= 1.0f) return 255;
    const uint32_t bits = std::bit_cast<uint32_t>(linear);
    const Bucket& bucket = buckets_[(bits - kFirstBits) >> kShift];
    return static_cast<unsigned char>(bucket.code + (bits >= bucket.step ? 1 : 0));
  }

 private:
  static constexpr int kShift = 23 - 7;
  static constexpr uint32_t kFirstBits = 0x39000000;  // of 2^-13
  static constexpr uint32_t kBuckets = (kOneBits - kFirstBits) >> kShift;
  struct Bucket {
    uint32_t step, code;  // bits of the first float that gets code + 1
  };

  /// Bits of the smallest float in [0, 1] that encodes to `code` or more; positive floats sort like their bits.
  static uint32_t first_of(int code) {
    uint32_t low = 0, high = kOneBits;
    while (low < high) {
      const uint32_t middle = low + (high - low) / 2;
      if (code_of(std::bit_cast<float>(middle)) >= code) {
        high = middle;
      } else {
        low = middle + 1;
      }
    }
    return low;
  }

  std::array<Bucket, kBuckets> buckets_;
};

}  // namespace

float srgb_from_linear(float linear) {
  if (!(linear > 0.0f)) return 0.0f;  // also NaN and -0
  if (linear >= 1.0f) return 1.0f;
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

float linear_from_srgb(float srgb) {
  if (!(srgb > 0.0f)) return 0.0f;
  if (srgb >= 1.0f) return 1.0f;
  return srgb <= 0.04045f ? srgb / 12.92f : std::pow((srgb + 0.055f) / 1.055f, 2.4f);
}

Image8 display_image(const Image& image, float exposure_ev) {
  static const EncodeTable encode;
  const float scale = std::exp2(exposure_ev) / kWhiteRadiance;
  Image8 shown{image.width, image.height, std::vector<unsigned char>(image.pixels.size() * 3)};
  world::parallel_ranges(image.pixels.size(), 16384, [&](size_t begin, size_t end) {
    unsigned char* out = shown.pixels.data() + begin * 3;
    for (size_t i = begin; i < end; ++i, out += 3) {
      const Rgb& p = image.pixels[i];
      out[0] = encode(p.r * scale), out[1] = encode(p.g * scale), out[2] = encode(p.b * scale);
    }
  });
  return shown;
}

}  // namespace render
