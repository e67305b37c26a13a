/// Small worlds of light for tests of pictures: a room that nothing but luminaires lights, one luminaire of each kind,
/// fog of each kind.
#pragma once

#include <memory>
#include <vector>

#include "tests/render/raster/small_worlds.h"
#include "world/luminaires/luminaire.h"
#include "world/media/medium.h"

namespace render {

/// A closed room without light of its own: nothing but luminaires lights it.
inline world::World dark_room() {
  world::World w = room();
  world::EditBatch batch;
  batch.set({8, 5, 8}, world::kAir);
  batch.fill(box_at({}, {2, 0, 8}, {2, 2, 9}), block(w, "brick_red"));
  apply(w, batch);
  w.environment.sun_irradiance = {};
  w.environment.sky_zenith = w.environment.sky_horizon = w.environment.sky_ground = {};
  return w;
}
inline Camera in_the_room() { return camera_at({}, {1.3, 3.7, 1.2}, {1, -0.35, 0.9}, 75); }

inline world::Luminaire luminaire(const char* kind) {
  world::Luminaire l;
  l.name = l.kind = kind;
  l.position = world::WorldPoint::from(6.4, 5.2, 7.3);
  l.power = {900, 700, 500};
  l.extent = {1.5f, 0.8f};
  l.radius = 0.6f;
  return l;
}

inline std::shared_ptr<world::LightImage> picture_of_light() {
  auto image = std::make_shared<world::LightImage>();
  image->width = 8, image->height = 4;
  for (int i = 0; i < 32; ++i) {
    const float v = static_cast<float>(i % 5);
    image->pixels.push_back({0.1f + v, 0.3f + 0.5f * v, i % 3 ? 1.0f : 0.2f});
  }
  return image;
}

inline std::vector<world::Luminaire> one_of_each_kind() {
  world::Luminaire spot = luminaire("spot"), gobo = luminaire("gobo"), unified = luminaire("unified_point");
  spot.half_angle = 0.9f, spot.inner_half_angle = 0.5f;
  spot.axis = glm::normalize(world::Vec3f(-0.3f, -1, -0.2f)), spot.up = world::Vec3f(0, 0.19611613f, -0.98058069f);
  spot.power = {9000, 9000, 7000};
  gobo.half_angle = 0.8f, gobo.inner_half_angle = 0.8f, gobo.power = {2500, 2500, 2500}, gobo.image = "slide";
  gobo.light_image = picture_of_light();
  unified.attenuation = {0.2f, 0.1f, 0.5f}, unified.half_angle = 2;
  world::Luminaire far_point = luminaire("unified_point");
  far_point.at_infinity = true, far_point.attenuation = {1, 0, 0}, far_point.axis = {0, -1, 0};
  world::Luminaire directional = luminaire("directional");
  directional.power = {}, directional.irradiance = {60, 50, 40};
  directional.axis = glm::normalize(world::Vec3f(0.4f, -1, 0.2f));
  world::Luminaire mesh = luminaire("mesh");
  mesh.triangles = {{-1, 0, -1}, {1, 0, -1}, {0, 0.3f, 1}, {0.5f, -0.5f, 0}, {0.7f, -0.5f, 0.4f}, {0.2f, -0.5f, 0.4f}};
  world::Luminaire panel = luminaire("rectangle"), by_area = panel;
  by_area.uniform_area = true;
  world::Luminaire switched = luminaire("sphere");
  switched.shadows = false, switched.glossy = false;
  return {luminaire("omni"),   spot,    gobo, unified, far_point, directional, mesh, panel, by_area, luminaire("disk"),
          luminaire("sphere"), switched};
}

inline world::Medium medium(const char* kind) {
  world::Medium m;
  m.name = m.kind = kind;
  m.position = world::WorldPoint::from(0, 14, 0);
  m.scattering = {0.02f, 0.025f, 0.03f}, m.absorption = {0.01f, 0.005f, 0.002f};
  m.emission = {30, 35, 45};
  m.half_extent = {22, 9, 30};
  m.normal = glm::normalize(world::Vec3f(0.2f, 1, 0.1f));
  m.scale_height = 6;
  return m;
}

}  // namespace render
