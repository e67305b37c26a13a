/// RGB9E5: three non-negative numbers in 32 bits, 9 bits of mantissa each and one exponent of 5 bits for all.
///
///   bits 31..27 exponent E   26..18 blue   17..9 green   8..0 red      value = mantissa * 2^(E - 24)
///
/// error   of each band at most largest band / 511, or 2^-25 where that is more. So a band far below the largest is
/// lost:
///         (1000, 0.9, 0.4) becomes (1000, 0, 0). Encoding what was decoded gives the same code.
/// fails   never: clamps to [0, 65408]; negative numbers and NaN become 0.
/// source  Greg Ward. Real Pixels. Graphics Gems II, 1991 (the idea); OpenGL EXT_texture_shared_exponent (the layout)
#pragma once

#include <bit>
#include <cstdint>

#include <glm/vec3.hpp>

namespace world {

struct Rgb9e5 {
  static constexpr float kMax = 65408.0f;  // 511/512 * 2^16
  uint32_t code = 0;

  static constexpr Rgb9e5 from(const glm::vec3& rgb) {
    const auto clamped = [](float x) { return x > 0 ? (x < kMax ? x : kMax) : 0.0f; };
    const float r = clamped(rgb.x), g = clamped(rgb.y), b = clamped(rgb.z);
    const float largest = r > g ? (r > b ? r : b) : (g > b ? g : b);
    // The exponent is the largest band's, after rounding to 9 bits: 511.5 steps or more need the next one. Read from
    // the bits: a logarithm is inexact next to powers of two.
    const uint32_t bits = std::bit_cast<uint32_t>(largest);
    const int power =
        static_cast<int>((bits + (1u << 14)) >> 23) - 127;  // largest, rounded, is in [2^power, 2^(power+1))
    const int exponent = power < -16 ? 0 : power + 16;
    const float steps_per_unit = std::bit_cast<float>(static_cast<uint32_t>(127 + 24 - exponent) << 23);
    // A band is below 512 steps, so that twice it, cut off, keeps the half that rounding needs.
    const auto mantissa = [&](float x) { return (static_cast<uint32_t>(x * steps_per_unit * 2) + 1) >> 1; };
    return {static_cast<uint32_t>(exponent) << 27 | mantissa(b) << 18 | mantissa(g) << 9 | mantissa(r)};
  }

  constexpr glm::vec3 value() const {
    const float step = std::bit_cast<float>((127 - 24 + (code >> 27)) << 23);
    return {static_cast<float>(code & 511u) * step, static_cast<float>(code >> 9 & 511u) * step,
            static_cast<float>(code >> 18 & 511u) * step};
  }
  friend constexpr bool operator==(Rgb9e5, Rgb9e5) = default;
};

}  // namespace world
