#include "render/sky_view.h"

#include "render/knob_ranges.h"
#include "world/world.h"

namespace render {

void SkyView::set_clouds(const RenderKnobs& knobs, world::VoxelPos from) {
  clouds = {};
  if (!(environment.clouds.cover > 0)) return;
  clouds.steps = knobs.cloud_steps, clouds.light_steps = knobs.cloud_light_steps;
  clouds.shadows = knobs.cloud_shadows && environment.sun_irradiance.max() > 0 && environment.sun_direction.y > 0;
  clouds.before = clouds.steps > 0;
  clouds.from = from;
  clouds.layer = world::cloud_layer(environment, from);
}

glm::vec3 SkyView::in_layer(const world::WorldPoint& place) const {
  return glm::vec3(place - world::WorldPoint{clouds.from, world::Vec3d(0)});
}

world::shared::CloudView SkyView::clouds_up_to(const world::WorldPoint& from, const world::Vec3d& direction,
                                               double t) const {
  return world::shared::clouds_along(clouds.layer, in_layer(from), glm::vec3(direction),
                                     world::vec3_of(radiance(direction)), clouds.steps, clouds.light_steps,
                                     static_cast<float>(t));
}

Rgb SkyView::laid_over(const world::shared::CloudView& clouds, const Rgb& seen) {
  const glm::vec3 all = clouds_laid_over(clouds, glm::vec3(1), glm::vec3(0), {seen.r, seen.g, seen.b});
  return {all.x, all.y, all.z};
}

namespace {

/// Whether clouds may lie before anything of a picture but the sky, or in fog. Of what isn't of blocks heights aren't
/// looked at.
bool clouds_lie_before(const world::World& world, const world::MaskVolume& occupied, double base, double eye) {
  if (eye >= base || !world.media.empty() || !world.meshes.empty() || !world.luminaires.empty()) return true;
  return !occupied.empty() && world::kRegionSize * (double(occupied.max_region().y) + 1) > base;
}

}  // namespace

world::Result<SkyView> sky_view(const world::Environment& environment, const RenderKnobs& knobs,
                                std::shared_ptr<const world::SkyLight>& kept) {
  TRY_STATUS(check_ranges(knobs));
  SkyView view(environment);
  if (knobs.time_of_day < 0) return view;
  const world::SkySetting setting{knobs.time_of_day, knobs.latitude, knobs.day_of_year, knobs.turbidity, knobs.moon};
  if (!kept || !(kept->setting() == setting)) kept = std::make_shared<const world::SkyLight>(setting);
  view.light = kept;
  world::set_sky(view.environment, *kept);
  return view;
}

world::Result<SkyView> sky_view(const world::WorldView& view, const RenderKnobs& knobs,
                                std::shared_ptr<const world::SkyLight>& kept, const world::WorldPoint& eye) {
  TRY(SkyView sky, sky_view(view.environment(), knobs, kept));
  sky.set_clouds(knobs, eye.voxel);
  if (sky.clouds.before)
    sky.clouds.before = clouds_lie_before(view.world(), view.masks(world::MaskKind::occupied),
                                          double{sky.environment.clouds.height}, eye.voxel.y + eye.fraction.y);
  return sky;
}

}  // namespace render
