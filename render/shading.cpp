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

world::Irradiance3 sky_irradiance(const SkyView& sky, int face) {
  // With L = h + (z - h) cos over the upper hemisphere and g below, integrate L (n . w) dw:
  //   up:   pi h + 2 pi/3 (z - h);    side: pi/2 h + 2/3 (z - h) + pi/2 g;    down: pi g.
  // The side's 2/3 is the integral of sin^2 cos over polar angle (1/3) times that of cos over a half turn (2).
  const auto irradiance = [](Rgb l, float factor) {
    return world::Irradiance3{l.r * factor, l.g * factor, l.b * factor};
  };
  if (sky.light) return sky.light->irradiance(face_normal(face));
  const world::Environment& e = sky.environment;
  const Rgb slope = e.sky_zenith - e.sky_horizon;
  if (face == world::kFacePosY) return irradiance(e.sky_horizon, kPi) + irradiance(slope, 2 * kPi / 3);
  if (face == world::kFaceNegY) return irradiance(e.sky_ground, kPi);
  return irradiance(e.sky_horizon, kPi / 2) + irradiance(slope, 2.0f / 3) + irradiance(e.sky_ground, kPi / 2);
}

world::Irradiance3 sky_irradiance(const SkyView& sky, const world::Vec3d& n) {
  if (sky.light) return sky.light->irradiance(n);
  const world::Environment& e = sky.environment;
  // The sky's part above a tilted surface is a lune of angle pi - a, where a = acos(n.y). Over it, in coordinates
  // around the lune's axis, the integral of w.y (n . w) is 4/3 ((pi - a) cos a + sin a) / 2.
  const double y = std::clamp(n.y, -1.0, 1.0), a = std::acos(y), pi = 3.14159265358979323846;
  const float uniform = static_cast<float>(pi * (1 + y) / 2), ground = static_cast<float>(pi * (1 - y) / 2),
              slope = static_cast<float>(2.0 / 3 * ((pi - a) * y + std::sqrt(1 - y * y)));
  const Rgb l = e.sky_horizon * uniform + (e.sky_zenith - e.sky_horizon) * slope + e.sky_ground * ground;
  return {l.r, l.g, l.b};
}

Rgb normal_radiance(const Shading& shading, const SkyView& view, world::BlockId block, const world::Vec3d& normal,
                    bool sun_visible, const Rgb* lit) {
  const world::Environment& e = view.environment;
  const world::Irradiance3 sky =
      lit ? world::Irradiance3{lit->r * kPi, lit->g * kPi, lit->b * kPi} : sky_irradiance(view, normal);
  const float sun = sun_visible ? static_cast<float>(std::max(0.0, glm::dot(e.sun_direction, normal))) : 0.0f;
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
