/// The sun and the sky of a picture: those of its surroundings, or those of the time of day that the knobs name.
#pragma once

#include <memory>

#include "render/image/image.h"
#include "render/knobs.h"
#include "world/scenes/sky.h"
#include "world/scenes/sky_light.h"

namespace render {

struct SkyView {
  world::Environment environment;                // with the sun of the time of day, where there is one
  std::shared_ptr<const world::SkyLight> light;  // none: the environment's linear sky

  SkyView() = default;
  SkyView(const world::Environment& e) : environment(e) {}  // NOLINT: what has no time of day is its environment

  /// What lights surfaces, along a unit direction.
  Rgb radiance(const world::Vec3d& direction) const {
    return light ? light->radiance(direction) : world::sky_radiance(environment, direction.y);
  }
  /// What an eye sees: stars, and the disks of the sun and the moon, too.
  Rgb seen(const world::Vec3d& direction) const {
    return light ? light->seen(direction) : world::sky_radiance(environment, direction.y);
  }
};

/// `kept`: the last picture's, so that the same sky isn't made again. Fails where a knob is out of its range.
world::Result<SkyView> sky_view(const world::Environment& environment, const RenderKnobs& knobs,
                                std::shared_ptr<const world::SkyLight>& kept);

}  // namespace render
