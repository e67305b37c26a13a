#include "render/shading.h"

#include <algorithm>
#include <cmath>

namespace render {

namespace {
constexpr float kPi = 3.14159265358979f;

world::Vec3d face_normal(int face) {
  world::Vec3d n(0);
  n[world::face_axis(face)] = world::face_sign(face);
  return n;
}
}  // namespace

world::Irradiance3 sky_irradiance(const SkyView& sky, int face) { return sky_irradiance(sky, face_normal(face)); }

world::Irradiance3 sky_irradiance(const SkyView& sky, const world::Vec3d& n) {
  if (sky.light) return sky.light->irradiance(n);
  const world::Environment& e = sky.environment;
  const glm::vec3 sum =
      world::shared::linear_sky_irradiance(world::vec3_of(e.sky_zenith), world::vec3_of(e.sky_horizon),
                                           world::vec3_of(e.sky_ground), static_cast<float>(n.y));
  return {sum.r, sum.g, sum.b};
}

Rgb normal_radiance(const Shading& shading, const SkyView& view, world::BlockId block, const world::Vec3d& normal,
                    float sun_arrives, const Rgb* lit) {
  const world::Environment& e = view.environment;
  const world::Irradiance3 sky =
      lit ? world::Irradiance3{lit->r * kPi, lit->g * kPi, lit->b * kPi} : sky_irradiance(view, normal);
  const float sun = sun_arrives * static_cast<float>(std::max(0.0, glm::dot(e.sun_direction, normal)));
  const Shading::Material& m = shading.materials[block];
  const auto radiance = [&](float of_sky, float of_sun, int c) {
    return m.albedo[c] * (of_sky + sun * of_sun) / kPi + m.emitted[c];
  };
  return {radiance(sky.r, e.sun_irradiance.r, 0), radiance(sky.g, e.sun_irradiance.g, 1),
          radiance(sky.b, e.sun_irradiance.b, 2)};
}

Shading::Shading(const SkyView& view, const world::BlockPalette& palette) {
  const world::Environment& environment = view.environment;
  for (int face = 0; face < world::kFaces; ++face) {
    const world::Irradiance3 sky = sky_irradiance(view, face);
    const double cosine = std::max(0.0, environment.sun_direction[world::face_axis(face)] * world::face_sign(face));
    const float sun = static_cast<float>(cosine) / kPi;
    sky_lit[face] = {sky.r / kPi, sky.g / kPi, sky.b / kPi};
    sun_lit[face] = {environment.sun_irradiance.r * sun, environment.sun_irradiance.g * sun,
                     environment.sun_irradiance.b * sun};
    sun_faces[face] = cosine > 0;
  }
  materials.resize(palette.size());
  for (size_t id = 0; id < palette.size(); ++id) {
    const world::Block& b = palette[static_cast<world::BlockId>(id)];
    const float emit = 1.0f / (6 * kPi);
    const world::Ratio3 scattered = b.albedo + b.glossy;
    materials[id] = {{scattered.r, scattered.g, scattered.b},
                     {b.emission.r * emit, b.emission.g * emit, b.emission.b * emit}};
  }
}

}  // namespace render
