#include "render/effects/flare_spots.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/effects/effect.shared.h"
#include "render/sky_view.h"
#include "world/store/mask_walk.h"

namespace render {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kSunRadius = 0.00465;  // half of the sun's angle, rad
constexpr double kLeastLamp = 0.05;     // m: of luminaires that are points
constexpr int kRays = 32;
constexpr size_t kMostLookedAt = 64;  // the strongest: of a hundred thousand lamps most are too weak to flare
constexpr double kFade = 0.2;         // of half the picture

struct Source {
  Vec3d direction;        // from the camera, unit
  double distance;        // m
  double angular_radius;  // rad
  world::Irradiance3 irradiance;
};

/// The part of the source's disk that is seen past opaque voxels and clouds: a sunflower of points on it.
double part_seen(const world::MaskWalker& opaque, const SkyView& sky, const world::WorldPoint& eye,
                 const Source& source) {
  const Vec3d side = glm::normalize(
      glm::cross(source.direction, std::abs(source.direction.y) < 0.9 ? Vec3d(0, 1, 0) : Vec3d(1, 0, 0)));
  const Vec3d other = glm::cross(source.direction, side);
  double seen = 0;
  for (int i = 0; i < kRays; ++i) {
    const double r = source.angular_radius * std::sqrt((i + 0.5) / kRays), angle = i * 2.399963229728653;
    world::GridRay ray(eye,
                       glm::normalize(source.direction + r * std::cos(angle) * side + r * std::sin(angle) * other));
    ray.t_max = source.distance;
    if (opaque.first_set(ray).hit()) continue;
    seen += double{sky.clouds_along(eye, ray.direction, ray.t_max).through};
  }
  return seen / kRays;
}

}  // namespace

std::vector<FlareSpot> flare_spots(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs,
                                   int width, int height) {
  std::vector<Source> sources;
  SkyView sky(view.environment());
  sky.set_clouds(knobs, camera.position.voxel);
  const world::Environment& environment = sky.environment;
  if (environment.sun_irradiance.max() > 0)
    sources.push_back({environment.sun_direction, 1e9, kSunRadius, environment.sun_irradiance});
  for (const world::Luminaire& l : view.world().luminaires) {
    if (!l.enabled || !(l.power.max() > 0)) continue;
    const Vec3d away = l.position - camera.position;
    const double distance = glm::length(away), radius = std::max<double>(l.radius, kLeastLamp);
    if (!(distance > radius)) continue;
    // As if it shone to all sides alike.
    const auto factor = static_cast<float>(1 / (4 * kPi * distance * distance));
    const world::Irradiance3 irradiance{l.power.r * factor, l.power.g * factor, l.power.b * factor};
    sources.push_back({away / distance, distance - radius, radius / distance, irradiance});
  }

  const PixelRays rays(camera, width, height);
  const double aspect = rays.tan_half_x / rays.tan_half_y;
  struct Candidate {
    Source source;
    FlareSpot spot;
  };
  std::vector<Candidate> candidates;
  for (const Source& source : sources) {
    const double depth = glm::dot(source.direction, rays.forward);
    if (!(depth > 1e-3)) continue;
    FlareSpot spot;
    spot.x = glm::dot(source.direction, rays.right) / (depth * rays.tan_half_y);
    spot.y = -glm::dot(source.direction, rays.up) / (depth * rays.tan_half_y);
    const double beyond = std::max(std::abs(spot.x) / aspect, std::abs(spot.y)) - 1;
    const double inside = std::clamp(1 - beyond / kFade, 0.0, 1.0);
    if (!(inside > 0)) continue;
    const auto part = static_cast<float>(inside * depth / kPi);
    spot.radiance = {source.irradiance.r * part, source.irradiance.g * part, source.irradiance.b * part};
    candidates.push_back({source, spot});
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.spot.radiance.max() > b.spot.radiance.max();
  });

  std::vector<FlareSpot> spots;
  const world::MaskWalker opaque(view.masks(world::MaskKind::opaque));
  if (candidates.size() > kMostLookedAt) candidates.resize(kMostLookedAt);
  for (Candidate& c : candidates) {
    if (spots.size() == size_t{shared::kMostFlareSpots}) break;
    const auto seen = static_cast<float>(part_seen(opaque, sky, camera.position, c.source));
    if (seen > 0) c.spot.radiance = c.spot.radiance * seen, spots.push_back(c.spot);
  }
  return spots;
}

}  // namespace render
