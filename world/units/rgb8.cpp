#include "world/units/rgb8.h"

#include <algorithm>
#include <cmath>

namespace world {

Ratio3 linear_from_rgb8(uint32_t rgb) {
  const auto band = [&](int shift) {
    const double s = (rgb >> shift & 255) / 255.0;
    return static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
  };
  return {band(16), band(8), band(0)};
}

uint32_t rgb8_from_linear(const Ratio3& linear) {
  const auto band = [](float value) {
    const double l = std::clamp(static_cast<double>(value), 0.0, 1.0);
    const double s = l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055;
    return static_cast<uint32_t>(std::lround(255 * s));
  };
  return band(linear.r) << 16 | band(linear.g) << 8 | band(linear.b);
}

}  // namespace world
