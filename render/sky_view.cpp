#include "render/sky_view.h"

#include "render/knob_ranges.h"

namespace render {

void SkyView::set_clouds(const RenderKnobs& knobs, world::VoxelPos from) {
  clouds = {};
  if (!(environment.clouds.cover > 0)) return;
  clouds.steps = knobs.cloud_steps, clouds.light_steps = knobs.cloud_light_steps;
  clouds.shadows = knobs.cloud_shadows && environment.sun_irradiance.max() > 0 && environment.sun_direction.y > 0;
  clouds.from = from;
  clouds.layer = world::cloud_layer(environment, from);
}

glm::vec3 SkyView::in_layer(const world::WorldPoint& place) const {
  return glm::vec3(place - world::WorldPoint{clouds.from, world::Vec3d(0)});
}

Rgb SkyView::clouded(const Rgb& seen, const world::WorldPoint& from, const world::Vec3d& direction) const {
  const glm::vec4 layer = clouds_along(clouds.layer, in_layer(from), glm::vec3(direction),
                                       world::vec3_of(radiance(direction)), clouds.steps, clouds.light_steps);
  return seen * layer.w + Rgb{layer.x, layer.y, layer.z};
}

world::Result<SkyView> sky_view(const world::Environment& environment, const RenderKnobs& knobs,
                                std::shared_ptr<const world::SkyLight>& kept, world::VoxelPos eye) {
  TRY_STATUS(check_ranges(knobs));
  SkyView view(environment);
  if (knobs.time_of_day < 0) {
    view.set_clouds(knobs, eye);
    return view;
  }
  const world::SkySetting setting{knobs.time_of_day, knobs.latitude, knobs.day_of_year, knobs.turbidity, knobs.moon};
  if (!kept || !(kept->setting() == setting)) kept = std::make_shared<const world::SkyLight>(setting);
  view.light = kept;
  world::set_sky(view.environment, *kept);
  view.set_clouds(knobs, eye);
  return view;
}

}  // namespace render
