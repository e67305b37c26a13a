#include "render/light/sun_maps.h"

namespace render {

world::Status SunMaps::follow(const world::WorldView& view, const ShadowVoxels& voxels,
                              const ShadowVoxels::Change& change, const world::WorldPoint& eye,
                              const RenderKnobs& knobs, const world::Vec3d& sun) {
  const bool maps = knobs.sun_shadow == SunShadow::map, cascades = maps && knobs.sun_map_cascades != 0;
  cast_ = 0;
  if (!cascades || change.all) cascades_.clear();
  if (!maps || cascades || change.all) whole_.clear();
  if (!maps) return {};
  const world::RayStream& opaque = voxels.stream();
  if (cascades) {
    TRY_STATUS(cascades_.follow(view, opaque, eye, knobs, sun, change.leaves));
    cast_ = cascades_.cast();
    return {};
  }
  const uint64_t before = whole_.version();
  TRY_STATUS(whole_.follow(view, opaque, knobs.sun_map_texel, sun));
  if (whole_.version() != before) cast_ = whole_.depths().size();
  return {};
}

}  // namespace render
