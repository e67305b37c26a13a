// Recursive ray tracing: each surface is lit as direct.cpp does, and where it has impulses (mirrors, glass, thin
// sheets) all of them are followed, which needs no random choice: a picture of point lights and one sample has no
// noise. error  light that a matte surface gets from others is missing. What adds less than 1e-4 of itself is dropped.
// source Turner Whitted. An Improved Illumination Model for Shaded Display. 1980
#include <algorithm>
#include <cmath>

#include "render/shading.h"
#include "render/trace/transport.h"

namespace render {

namespace {

constexpr int kDeepest = 24;          // where max_depth is 0
constexpr double kLeastShare = 1e-4;  // of a pixel's light that is followed

struct Recursion {
  Transport& t;
  const Sampler& sampler;
  uint32_t vertex = 0;

  Vec3d seen(const TraceRay& ray, int depth, double share) {
    const Vec3f absorption = t.tracer.absorption(ray);
    Surface s = t.tracer.intersect(ray, t.crossings);
    const glm::vec4* const body = t.shared.bodies.first(ray.ray, s.t);
    t.texture(s, ray, 0, vertex == 0);
    FogView fog = t.fog(ray, s.t);
    // Bodies have their clouds already.
    if (!body) fog = t.with_clouds(fog, ray, t.crossings, s.t);
    Vec3d light = body ? Vec3d(glm::vec3(*body)) : s.hit() ? Vec3d(s.emission) : seen_far(t, ray);
    if (!body && s.hit() && s.kind != SurfaceKind::luminaire)
      light += scattered(s, Vec3f(-ray.ray.direction), depth, share);
    if (absorption != Vec3f(0)) light *= absorbed(absorption, s.t);
    return fog.value * light + fog.added;
  }

  Vec3d scattered(const Surface& s, const Vec3f& wo, int depth, double share) {
    Vec3d light(0);
    const uint32_t dimension = kVertexDimension + vertex++ * kDimensionsPerVertex;
    const int deepest = t.knobs().max_depth > 0 ? t.knobs().max_depth : kDeepest;
    if (depth < deepest && t.scene().materials()[s.block].finite) {
      const world::Irradiance3 sky = sky_irradiance(t.scene().sky(), Vec3d(s.shading_normal));
      // The share that is matte or glossy: all that is scattered, less what goes by impulses.
      Vec3d albedo(s.bsdf->probability_in(s.parameters, wo, s.shading_normal));
      const Impulses impulses = s.bsdf->incoming_impulses(s.parameters, wo, s.shading_normal);
      for (int i = 0; i < impulses.count; ++i) albedo -= Vec3d(impulses.impulse[i].magnitude);
      light += max(albedo, Vec3d(0)) * Vec3d(sky.r, sky.g, sky.b) / 3.14159265358979323846;
      light += light_by_light(t, s, wo, sampler, dimension, depth == 0);
    }
    const Impulses impulses = s.bsdf->incoming_impulses(s.parameters, wo, s.shading_normal);
    for (int i = 0; i < impulses.count; ++i) {
      const Impulse& impulse = impulses.impulse[i];
      const double part = std::max({impulse.magnitude.x, impulse.magnitude.y, impulse.magnitude.z}) * share;
      if (part < kLeastShare || impulse.direction == Vec3f(0) || !sides_agree(s, impulse.direction)) continue;
      const bool straight = goes_straight(impulse.direction, wo);
      if (depth >= deepest && !straight) continue;
      t.tracer.counts.transmissions += dot(impulse.direction, s.normal) < 0;
      ++t.tracer.counts.scattered_rays;
      light += Vec3d(impulse.magnitude) * seen(s.spawn(impulse.direction), depth + !straight, part);
    }
    return light;
  }
};

}  // namespace

Vec3d whitted_radiance(Transport& t, const TraceRay& camera_ray, const Sampler& sampler) {
  ++t.tracer.counts.camera_rays;
  return Recursion{t, sampler}.seen(camera_ray, 0, 1);
}

}  // namespace render
