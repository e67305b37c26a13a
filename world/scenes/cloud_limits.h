/// What Clouds may be, in scenes and in saved worlds.
#pragma once

#include <cmath>

#include "world/scenes/clouds.h"

namespace world {

constexpr double kMostCloudHeight = 1e6;  // m, either way
constexpr double kLeastCloudLength = 10,
                 kMostCloudLength = 1e5;     // m, of thickness and size: noise is asked for in floats
constexpr double kMostCloudExtinction = 10;  // 1/m
constexpr double kMostCloudDrift = 1000;     // m/s

/// False for what isn't a number too.
inline bool within_limits(const Clouds& c) {
  const auto length = [](float v) { return v >= kLeastCloudLength && v <= kMostCloudLength; };
  const auto finite = [](const Vec3d& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); };
  return c.cover >= 0 && c.cover <= 1 && std::abs(c.height) <= kMostCloudHeight && length(c.thickness) &&
         length(c.size) && c.extinction >= 0 && c.extinction <= kMostCloudExtinction &&
         std::abs(c.drift.x) <= kMostCloudDrift && std::abs(c.drift.z) <= kMostCloudDrift && finite(c.drift) &&
         finite(c.drifted);
}

}  // namespace world
