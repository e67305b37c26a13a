/// A solid that can be sampled into voxels: what every source makes.
#pragma once

#include <cstdint>
#include <limits>

#include "world/space/world_point.h"

namespace world {

/// An axis-aligned box in a source's own space, m.
struct ShapeBox {
  Vec3d min{std::numeric_limits<double>::infinity()}, max{-std::numeric_limits<double>::infinity()};

  bool empty() const { return !(min.x <= max.x && min.y <= max.y && min.z <= max.z); }
  bool finite() const { return std::isfinite(glm::dot(min, min)) && std::isfinite(glm::dot(max, max)) && !empty(); }
  Vec3d centre() const { return 0.5 * (min + max); }
  bool contains(const Vec3d& p) const {
    return p.x >= min.x && p.x <= max.x && p.y >= min.y && p.y <= max.y && p.z >= min.z && p.z <= max.z;
  }
  void include(const Vec3d& p) { min = glm::min(min, p), max = glm::max(max, p); }
  static ShapeBox everything() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    return {Vec3d(-kInfinity), Vec3d(kInfinity)};
  }
};

/// What a box holds of a solid.
enum class Cover : uint8_t { outside, inside, mixed };

/// Calls come from many threads at once.
class Shape {
 public:
  virtual ~Shape() = default;
  /// Nothing of the solid lies outside; infinite where the solid is.
  virtual ShapeBox bounds() const = 0;
  /// Never wrong about outside and inside; `mixed` where the box meets the surface, or where that can't be told.
  /// Boxes that shrink towards a point off the surface end up outside or inside.
  virtual Cover classify(const ShapeBox& box) const = 0;
  virtual bool contains(const Vec3d& p) const = 0;
};

}  // namespace world
