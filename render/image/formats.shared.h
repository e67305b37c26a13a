/* Formats of a pixel's colour, from the picture to the display: how three numbers are packed into one or two words.
 *
 *   float32    three floats; not packed
 *   half       8 bytes  three numbers of binary16, and 16 bits left
 *   r11g11b10  4 bytes  5 bits of exponent, 6, 6 and 5 of mantissa, no sign
 *   float7e3   4 bytes  3 bits of exponent, 7 of mantissa, no sign: up to 31.875
 *   rgb9e5     4 bytes  9 bits each and one exponent for all
 *   rgba8      4 bytes  sRGB, 8 bits each, clamped to [0, 1]
 *   rgb565     2 bytes  sRGB, 5, 6 and 5 bits, clamped to [0, 1]
 *
 * error   of the value stored, rounded to nearest: half 2^-11; r11g11b10 2^-7, 2^-7 and 2^-6; float7e3 2^-8, of each in
 *         its normal range; rgb9e5 1/511 of the largest band; rgba8 1/510 and rgb565 1/62, 1/126, 1/62 of the encoded
 *         value. The codes are those of world/numbers/, whose headers say more.
 * fails   never: clamps, and NaN becomes 0
 * source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, sections 14.3, 14.4;
 *         Vulkan specification, "Unsigned 11-Bit Floating-Point Numbers" and "10-Bit" */
#ifndef LOAM_RENDER_IMAGE_FORMATS_SHARED_H
#define LOAM_RENDER_IMAGE_FORMATS_SHARED_H
#include "world/numbers/normalized.shared.h"

#ifdef __cplusplus
#include <bit>
#endif

SHARED_NAMESPACE(render)

SHARED_CONST uint kFormatFloat32 = 0u, kFormatHalf = 1u, kFormatR11g11b10 = 2u, kFormatFloat7e3 = 3u,
                  kFormatRgb9e5 = 4u, kFormatRgba8 = 5u, kFormatRgb565 = 6u;

#ifdef __cplusplus
using world::shared::float_from_unorm, world::shared::unorm_from_float;
inline uint bits_of(float x) { return std::bit_cast<uint32_t>(x); }
inline float of_bits(uint x) { return std::bit_cast<float>(x); }
#else
#define bits_of(x) floatBitsToUint(x)
#define of_bits(x) uintBitsToFloat(x)
#endif

/* The code of a float >= 0 with so many bits of exponent and mantissa, to nearest even; at most `most`. */
SHARED uint pack_small_float(float x, int exponent_bits, int mantissa_bits, float most) {
  if (!(x > 0.0f)) return 0u;
  uint bits = bits_of(min(x, most));
  int exponent = int(bits >> 23u) - 127 + (1 << (exponent_bits - 1)) - 1;
  uint mantissa = bits & 0x7fffffu;
  int drop = 23 - mantissa_bits;
  uint code = 0u;
  if (exponent >= 1) {
    code = uint(exponent) << uint(mantissa_bits);
  } else {
    /* The leading one is stored, further right for each step of the exponent. */
    drop += 1 - exponent;
    if (drop > 24) return 0u;
    mantissa |= 0x800000u;
  }
  code += mantissa >> uint(drop);
  uint rest = mantissa & ((1u << uint(drop)) - 1u), middle = 1u << uint(drop - 1);
  return rest > middle || (rest == middle && (code & 1u) != 0u) ? code + 1u : code;
}

SHARED float unpack_small_float(uint code, int exponent_bits, int mantissa_bits) {
  uint exponent = code >> uint(mantissa_bits), mantissa = code & ((1u << uint(mantissa_bits)) - 1u);
  int power = (exponent == 0u ? 1 : int(exponent)) - ((1 << (exponent_bits - 1)) - 1) - mantissa_bits;
  uint whole = exponent == 0u ? mantissa : mantissa | 1u << uint(mantissa_bits);
  return float(whole) * of_bits(uint(power + 127) << 23u);
}

SHARED_CONST float kMostHalf = 65504.0f, kMostFloat11 = 65024.0f, kMostFloat10 = 64512.0f, kMostFloat7e3 = 31.875f,
                   kMostRgb9e5 = 65408.0f;

SHARED uint pack_half(float x) {
  return pack_small_float(x < 0.0f ? -x : x, 5, 10, kMostHalf) | (x < 0.0f ? 0x8000u : 0u);
}
SHARED float unpack_half(uint code) {
  float x = unpack_small_float(code & 0x7fffu, 5, 10);
  return (code & 0x8000u) != 0u ? -x : x;
}

SHARED uint pack_rgb9e5(vec3 c) {
  float r = c.x > 0.0f ? min(c.x, kMostRgb9e5) : 0.0f, g = c.y > 0.0f ? min(c.y, kMostRgb9e5) : 0.0f,
        b = c.z > 0.0f ? min(c.z, kMostRgb9e5) : 0.0f;
  int power = int((bits_of(max(r, max(g, b))) + (1u << 14u)) >> 23u) - 127;
  int exponent = power < -16 ? 0 : power + 16;
  float steps = of_bits(uint(127 + 24 - exponent) << 23u);
  uint x = (uint(r * steps * 2.0f) + 1u) >> 1u, y = (uint(g * steps * 2.0f) + 1u) >> 1u,
       z = (uint(b * steps * 2.0f) + 1u) >> 1u;
  return uint(exponent) << 27u | z << 18u | y << 9u | x;
}

/* source  IEC 61966-2-1:1999 */
SHARED float encode_srgb(float x) {
  if (!(x > 0.0f)) return 0.0f;
  if (x >= 1.0f) return 1.0f;
  return x <= 0.0031308f ? 12.92f * x : 1.055f * pow(x, 1.0f / 2.4f) - 0.055f;
}
SHARED float decode_srgb(float x) { return x <= 0.04045f ? x / 12.92f : pow((x + 0.055f) / 1.055f, 2.4f); }

/* Words that a pixel takes: half has two. */
SHARED uint format_words(uint format) { return format == kFormatHalf ? 2u : format == kFormatFloat32 ? 3u : 1u; }

SHARED uvec2 pack_colour(uint format, vec3 c) {
  if (format == kFormatHalf) return uvec2(pack_half(c.x) | pack_half(c.y) << 16u, pack_half(c.z));
  if (format == kFormatR11g11b10)
    return uvec2(pack_small_float(c.x, 5, 6, kMostFloat11) | pack_small_float(c.y, 5, 6, kMostFloat11) << 11u |
                     pack_small_float(c.z, 5, 5, kMostFloat10) << 22u,
                 0u);
  if (format == kFormatFloat7e3)
    return uvec2(pack_small_float(c.x, 3, 7, kMostFloat7e3) | pack_small_float(c.y, 3, 7, kMostFloat7e3) << 10u |
                     pack_small_float(c.z, 3, 7, kMostFloat7e3) << 20u,
                 0u);
  if (format == kFormatRgb9e5) return uvec2(pack_rgb9e5(c), 0u);
  vec3 shown = vec3(encode_srgb(c.x), encode_srgb(c.y), encode_srgb(c.z));
  if (format == kFormatRgba8)
    return uvec2(unorm_from_float(shown.x, 8u) | unorm_from_float(shown.y, 8u) << 8u |
                     unorm_from_float(shown.z, 8u) << 16u | 0xff000000u,
                 0u);
  return uvec2(
      unorm_from_float(shown.x, 5u) << 11u | unorm_from_float(shown.y, 6u) << 5u | unorm_from_float(shown.z, 5u), 0u);
}

SHARED vec3 unpack_colour(uint format, uvec2 code) {
  uint w = code.x;
  if (format == kFormatHalf) return vec3(unpack_half(w & 0xffffu), unpack_half(w >> 16u), unpack_half(code.y));
  if (format == kFormatR11g11b10)
    return vec3(unpack_small_float(w & 0x7ffu, 5, 6), unpack_small_float(w >> 11u & 0x7ffu, 5, 6),
                unpack_small_float(w >> 22u, 5, 5));
  if (format == kFormatFloat7e3)
    return vec3(unpack_small_float(w & 0x3ffu, 3, 7), unpack_small_float(w >> 10u & 0x3ffu, 3, 7),
                unpack_small_float(w >> 20u & 0x3ffu, 3, 7));
  if (format == kFormatRgb9e5) {
    float step = of_bits((127u - 24u + (w >> 27u)) << 23u);
    return vec3(float(w & 511u), float(w >> 9u & 511u), float(w >> 18u & 511u)) * step;
  }
  vec3 shown = format == kFormatRgba8 ? vec3(float_from_unorm(w & 255u, 8u), float_from_unorm(w >> 8u & 255u, 8u),
                                             float_from_unorm(w >> 16u & 255u, 8u))
                                      : vec3(float_from_unorm(w >> 11u & 31u, 5u), float_from_unorm(w >> 5u & 63u, 6u),
                                             float_from_unorm(w & 31u, 5u));
  return vec3(decode_srgb(shown.x), decode_srgb(shown.y), decode_srgb(shown.z));
}

SHARED_NAMESPACE_END
#endif
