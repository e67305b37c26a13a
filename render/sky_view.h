/// The sun, the sky and the clouds of a picture: those of its surroundings, or those of the time of day that the knobs
/// name. Clouds are what an eye sees, straight or in mirrors, and what dims the sun; the light that the sky sends to
/// surfaces is that of the clear sky.
///
/// Clouds are laid over what is seen by how far it is; where all of that lies below them with the eye, and no fog is
/// around, over the sky alone (`before`).
#pragma once

#include <memory>

#include "render/image/image.h"
#include "render/knobs.h"
#include "world/scenes/cloud_layer.h"
#include "world/scenes/sky.h"
#include "world/scenes/sky_light.h"
#include "world/space/grid_walk.h"

namespace world {
class WorldView;
}

namespace render {

struct SkyView {
  world::Environment environment;                // with the sun of the time of day, where there is one
  std::shared_ptr<const world::SkyLight> light;  // none: the environment's linear sky

  /// Where the knobs ask for none, or the world has none, no steps and no shadows.
  struct {
    world::shared::CloudLayer layer{};
    world::VoxelPos from{};  // what places in it are relative to
    int steps = 0, light_steps = 0;
    bool shadows = false;
    bool before = false;  // of others than the sky
  } clouds;

  SkyView() = default;
  SkyView(const world::Environment& e) : environment(e) {}  // NOLINT: what has no time of day is its environment

  /// What lights surfaces, along a unit direction.
  Rgb radiance(const world::Vec3d& direction) const {
    return light ? light->radiance(direction) : world::sky_radiance(environment, direction.y);
  }
  /// What an eye sees: stars, the disks of the sun and the moon.
  Rgb seen(const world::Vec3d& direction) const {
    return light ? light->seen(direction) : world::sky_radiance(environment, direction.y);
  }
  /// Clouds on t metres of a ray.
  world::shared::CloudView clouds_along(const world::WorldPoint& from, const world::Vec3d& direction, double t) const {
    return clouds_at(t) ? clouds_up_to(from, direction, t) : world::shared::CloudView{};
  }
  /// Behind clouds: what they leave of it, and their own light.
  Rgb behind_clouds(const Rgb& seen, const world::WorldPoint& from, const world::Vec3d& direction, double t) const {
    return clouds_at(t) ? laid_over(clouds_up_to(from, direction, t), seen) : seen;
  }
  /// What interfaces and mirrors show of the sky there.
  Rgb mirrored(const world::WorldPoint& from, const world::Vec3d& direction) const {
    return behind_clouds(radiance(direction), from, direction, world::kInfinity);
  }
  /// Of the sun's light, what clouds let through to a place.
  float sun_through(const world::WorldPoint& place) const {
    return clouds.shadows ? cloud_sun_through(clouds.layer, in_layer(place)) : 1;
  }

  /// Sets them as the knobs ask, for places near a voxel.
  void set_clouds(const RenderKnobs& knobs, world::VoxelPos from);

 private:
  bool clouds_at(double t) const { return clouds.steps > 0 && (clouds.before || t == world::kInfinity); }
  glm::vec3 in_layer(const world::WorldPoint& place) const;
  world::shared::CloudView clouds_up_to(const world::WorldPoint& from, const world::Vec3d& direction, double t) const;
  static Rgb laid_over(const world::shared::CloudView& clouds, const Rgb& seen);
};

/// Without clouds. `kept`: the last picture's, so that the same sky isn't made again. Fails where a knob is out of its
/// range.
world::Result<SkyView> sky_view(const world::Environment& environment, const RenderKnobs& knobs,
                                std::shared_ptr<const world::SkyLight>& kept);
/// With those of a picture of a world.
world::Result<SkyView> sky_view(const world::WorldView& view, const RenderKnobs& knobs,
                                std::shared_ptr<const world::SkyLight>& kept, const world::WorldPoint& eye);

}  // namespace render
