#include "render/light/fog_light.h"

#include <algorithm>
#include <cmath>

namespace render {

namespace {

/// Over all directions: by a spiral of points that share the sphere evenly.
world::Vec3d mean_radiance(const SkyView& sky) {
  constexpr int kDirections = 512;
  const double golden_angle = 3.14159265358979323846 * (3 - std::sqrt(5.0));
  world::Vec3d sum(0);
  for (int i = 0; i < kDirections; ++i) {
    const double y = 1 - (2 * i + 1.0) / kDirections, r = std::sqrt(1 - y * y), angle = golden_angle * i;
    const Rgb radiance = sky.radiance({r * std::cos(angle), y, r * std::sin(angle)});
    sum += world::Vec3d(radiance.r, radiance.g, radiance.b);
  }
  return sum / double{kDirections};
}

}  // namespace

FogSource fog_source(const SkyView& sky, FogLight kind) {
  if (kind == FogLight::none) return {};
  const world::Irradiance3& sun = sky.environment.sun_irradiance;
  return {mean_radiance(sky), world::Vec3d(sun.r, sun.g, sun.b)};
}

ScatteredIn scattered_in(const world::Medium& medium, const FogSource& source) {
  const world::Vec3d scattering(medium.scattering.r, medium.scattering.g, medium.scattering.b),
      absorption(medium.absorption.r, medium.absorption.g, medium.absorption.b);
  world::Vec3d albedo(0);
  for (int b = 0; b < 3; ++b)
    if (scattering[b] > 0) albedo[b] = scattering[b] / (scattering[b] + absorption[b]);
  return {albedo * source.sky, albedo * source.sun};
}

bool fog_shafts(std::span<const world::Medium> media, const SkyView& sky, const RenderKnobs& knobs) {
  return knobs.fog_sun_rays > 0 && knobs.fog_light != FogLight::none && sky.environment.sun_irradiance.max() > 0 &&
         std::any_of(media.begin(), media.end(), [](const world::Medium& m) { return m.scattering.max() > 0; });
}

}  // namespace render
