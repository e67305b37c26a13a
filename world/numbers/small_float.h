/// Floating point in fewer than 32 bits.
///
///   Half      1 sign, 5 exponent, 10 mantissa bits (IEEE 754 binary16), with infinities and NaN
///   Float7e3  3 exponent, 7 mantissa bits, no sign, no infinity, no NaN: [0, 31.875]; three of them fill 30 bits
///
/// error  rounding is to nearest, ties to even.
///        Half      relative 2^-11 in [2^-14, 65504], absolute 2^-25 below
///        Float7e3  relative 2^-8 in [1/4, 31.875], absolute 2^-10 below
///        Every code comes back unchanged (of Half's NaNs: as a NaN).
/// fails  never. half_from_float overflows to infinity from 65520 on, as hardware does; what is stored must be finite,
///        so half_from_float_saturated clamps to +-65504 and turns NaN to 0. Float7e3 clamps, and NaN becomes 0.
/// source IEEE 754-2019; Hughes and others. Computer Graphics: Principles and Practice, 3rd edition. 2013,
/// section 14.3.2
#pragma once

#include <bit>
#include <cstdint>

namespace world {

namespace small_float {

/// The bits of the magnitude of a finite x >= 0 in a float with `exponent_bits` and `mantissa_bits`, rounded to nearest
/// even, without regard to the largest exponent: an overflow shows as a code beyond the format's.
constexpr uint32_t encode_magnitude(float x, int exponent_bits, int mantissa_bits) {
  const uint32_t bits = std::bit_cast<uint32_t>(x);
  const int bias = (1 << (exponent_bits - 1)) - 1;
  const int exponent = static_cast<int>(bits >> 23) - 127 + bias;  // biased for the small format
  uint32_t mantissa = bits & 0x7fffffu;
  int drop = 23 - mantissa_bits;
  uint32_t code = 0;
  if (exponent >= 1) {
    code = static_cast<uint32_t>(exponent) << mantissa_bits;
  } else {
    // Below the smallest normal number the leading one is stored, further right for each step of the exponent.
    drop += 1 - exponent;
    if (drop > 24) return 0;  // less than half of the smallest step
    mantissa |= 0x800000u;
  }
  code += mantissa >> drop;
  const uint32_t rest = mantissa & ((1u << drop) - 1), half = 1u << (drop - 1);
  if (rest > half || (rest == half && (code & 1u))) ++code;  // may carry into the exponent, which is right
  return code;
}

constexpr float decode_magnitude(uint32_t code, int exponent_bits, int mantissa_bits) {
  const int bias = (1 << (exponent_bits - 1)) - 1;
  const uint32_t exponent = code >> mantissa_bits, mantissa = code & ((1u << mantissa_bits) - 1);
  // Scales a small integer by a power of two: exact.
  const int power = (exponent == 0 ? 1 : static_cast<int>(exponent)) - bias - mantissa_bits;
  const float integer = static_cast<float>(exponent == 0 ? mantissa : mantissa | 1u << mantissa_bits);
  return integer * std::bit_cast<float>(static_cast<uint32_t>(power + 127) << 23);
}

}  // namespace small_float

struct Half {
  uint16_t code = 0;
  friend constexpr bool operator==(Half, Half) = default;
};

constexpr Half half_from_float(float x) {
  const uint32_t bits = std::bit_cast<uint32_t>(x), sign = bits >> 16 & 0x8000u, magnitude = bits & 0x7fffffffu;
  uint32_t code = 0;
  if (magnitude > 0x7f800000u) {
    code = 0x7e00u | (magnitude >> 13 & 0x3ffu);  // NaN stays NaN and keeps what fits of its payload
  } else if (magnitude >= 0x47800000u) {          // 2^16
    code = 0x7c00u;
  } else {
    code = small_float::encode_magnitude(std::bit_cast<float>(magnitude), 5, 10);
  }
  return {static_cast<uint16_t>(sign | code)};
}

/// For storing: finite for any x.
constexpr Half half_from_float_saturated(float x) {
  if (!(x == x)) return {0};
  return half_from_float(x > 65504.0f ? 65504.0f : x < -65504.0f ? -65504.0f : x);
}

constexpr float float_from_half(Half h) {
  const uint32_t sign = static_cast<uint32_t>(h.code & 0x8000u) << 16, magnitude = h.code & 0x7fffu;
  if (magnitude >= 0x7c00u) return std::bit_cast<float>(sign | 0x7f800000u | (magnitude & 0x3ffu) << 13);
  return std::bit_cast<float>(sign | std::bit_cast<uint32_t>(small_float::decode_magnitude(magnitude, 5, 10)));
}

struct Float7e3 {
  static constexpr float kMax = 31.875f;
  uint16_t code = 0;  // 10 bits
  static constexpr Float7e3 from(float x) {
    if (!(x > 0)) return {0};
    return {static_cast<uint16_t>(small_float::encode_magnitude(x < kMax ? x : kMax, 3, 7))};
  }
  constexpr float value() const { return small_float::decode_magnitude(code, 3, 7); }
  friend constexpr bool operator==(Float7e3, Float7e3) = default;
};

}  // namespace world
