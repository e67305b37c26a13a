/// A colour in 16 bits: red in the top 5, green in 6, blue in the lowest 5, each an Unorm.
///
/// error  at most 0.5/31 in red and blue, 0.5/63 in green. Every code comes back unchanged.
/// fails  never: clamps to [0, 1], NaN becomes 0.
#pragma once

#include <glm/vec3.hpp>

#include "world/numbers/normalized.shared.h"

namespace world {

struct Rgb565 {
  uint16_t code = 0;

  static Rgb565 from(const glm::vec3& rgb) {
    const uint32_t r = Unorm<5>::from(rgb.x).code, g = Unorm<6>::from(rgb.y).code, b = Unorm<5>::from(rgb.z).code;
    return {static_cast<uint16_t>(r << 11 | g << 5 | b)};
  }
  glm::vec3 value() const {
    return {shared::float_from_unorm(code >> 11, 5), shared::float_from_unorm(code >> 5 & 63u, 6),
            shared::float_from_unorm(code & 31u, 5)};
  }
  friend constexpr bool operator==(Rgb565, Rgb565) = default;
};

}  // namespace world
