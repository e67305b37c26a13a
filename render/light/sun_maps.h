/// What sun_shadow=map reads: one map of the whole world, or cascades around the eye, as the knob sun_map_cascades
/// says.
#pragma once

#include "render/light/shadow_voxels.h"
#include "render/light/sun_cascades.h"
#include "render/light/sun_map.h"

namespace render {

class SunMaps {
 public:
  /// Forgets what the knobs don't ask for. `change`: of the voxels, since the last call.
  world::Status follow(const world::WorldView& view, const ShadowVoxels& voxels, const ShadowVoxels::Change& change,
                       const world::WorldPoint& eye, const RenderKnobs& knobs, const world::Vec3d& sun);
  float lit(const world::WorldPoint& point, float cosine, int filter) const {
    return cascades_.count() ? cascades_.lit(point, cosine, filter) : whole_.lit(point, cosine, filter);
  }

  const shared::SunMapFrame& frame() const { return cascades_.count() ? cascades_.frame() : whole_.frame(); }
  std::span<const float> words() const { return cascades_.count() ? cascades_.words() : std::span(whole_.depths()); }
  /// What of the words this version changed of the one before; empty: all.
  std::span<const SunCascades::Run> changed() const {
    return cascades_.count() ? cascades_.changed() : std::span<const SunCascades::Run>();
  }
  /// Rays that the last follow() cast.
  uint64_t cast() const { return cast_; }
  uint64_t version() const { return whole_.version() + cascades_.version(); }
  size_t bytes() const { return whole_.bytes() + cascades_.bytes(); }

 private:
  SunMap whole_;
  SunCascades cascades_;
  uint64_t cast_ = 0;
};

}  // namespace render
