/// The shadow map of the sun, made by rays through the grid: what sun_shadow=map reads in place of a ray a pixel.
///
/// cost    4 bytes and a coherent ray a texel, once for each place of the sun and each edit
/// error   shadows' edges are right to a texel; light leaks below what is thinner than the bias (sun_map.shared.h)
#pragma once

#include <vector>

#include "render/light/sun_map.shared.h"
#include "world/store/ray_stream.h"
#include "world/world.h"

namespace render {

class SunMap {
 public:
  /// `sun`: unit, towards it. `opaque`: of what throws shadows. Makes the map anew where that, the sun or the texel (m)
  /// has changed. Fails where it would have too many texels.
  world::Status follow(const world::WorldView& view, const world::RayStream& opaque, float texel,
                       const world::Vec3d& sun);
  /// Forgets it.
  void clear();

  /// The part of the sun's light, 0 to 1, at a point of a surface; `cosine` as above. All light where there is no map.
  /// `filter`: the mean of so many places a side, a texel apart.
  float lit(const world::WorldPoint& point, float cosine, int filter = 1) const;

  const shared::SunMapFrame& frame() const { return frame_; }
  const std::vector<float>& depths() const { return depths_; }  // [size.y][size.x], m along w from the corner
  uint64_t version() const { return version_; }
  size_t bytes() const { return depths_.capacity() * sizeof(float); }

 private:
  float lit_at(float x, float y, float reach) const;

  shared::SunMapFrame frame_{};
  std::vector<float> depths_;
  uint64_t version_ = 0, store_ = 0, blocks_ = 0;
  world::Vec3d sun_{0.0};
};

}  // namespace render
