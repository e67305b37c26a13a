#include "render/trace/transport.h"

#include <algorithm>
#include <cmath>

#include "render/light/fog_light.h"
#include "render/light/fog_shafts.shared.h"
#include "render/see_through.h"
#include "render/trace/photons.h"
#include "render/shading.h"
#include "render/textures/texture_set.h"

namespace render {

using world::kInfinity;

TracedBodies::TracedBodies(std::span<const shared::DrawnBox> boxes, const world::WorldPoint& eye)
    : boxes_(boxes), eye_(eye) {
  std::vector<world::Box> around;
  for (const shared::DrawnBox& b : boxes) around.push_back({Vec3d(b.low), Vec3d(b.high)});
  tree_ = world::BoxTree(around);
}

const glm::vec4* TracedBodies::first(const world::GridRay& ray, double& t) const {
  if (boxes_.empty()) return nullptr;
  const Vec3d from = world::WorldPoint{ray.voxel, ray.fraction} - eye_;
  const auto meet = [&](int i) {
    const shared::DrawnBox& box = boxes_[static_cast<size_t>(i)];
    return shared::meet_box(glm::vec3(box.low) - glm::vec3(from), glm::vec3(box.high) - glm::vec3(from),
                            glm::vec3(ray.direction));
  };
  const auto distance = [&](int i) {
    const float met = meet(i).distance;
    return met > 0 ? double{met} : -1.0;
  };
  const int nearest = tree_.nearest(from, ray.direction, distance, t);
  if (nearest < 0) return nullptr;
  const shared::BoxHit met = meet(nearest);
  t = met.distance;
  return &boxes_[static_cast<size_t>(nearest)].radiance[met.face];
}

TraceRay from_air(const TraceRay& ray, const std::vector<Crossing>& crossings, double t, const Vec3f& direction) {
  TraceRay start = ray;
  for (const Crossing& c : crossings)
    if (c.t < t) c.enters ? start.around.enter(c.instance) : start.around.leave(c.instance);
  const world::WorldPoint point = ray.start() + t * ray.ray.direction;
  start.ray.voxel = point.voxel;
  start.ray.fraction = point.fraction;
  start.ray.direction = Vec3d(direction);
  start.from = {};
  start.from_part = kNoPart;
  return start;
}

BsdfParameters parameters_for(const Surface& surface, const world::Luminaire* luminaire) {
  BsdfParameters p = surface.parameters;
  if (luminaire && !luminaire->lambertian) p.lambertian = Vec3f(0);
  if (luminaire && !luminaire->glossy) p.glossy = Vec3f(0);
  return p;
}

bool sides_agree(const Surface& s, const Vec3f& wi) {
  return (dot(wi, s.normal) > 0) == (dot(wi, s.shading_normal) > 0);
}

Vec3d finite_scattering(const Surface& s, const BsdfParameters& parameters, const Vec3f& wi, const Vec3f& wo) {
  if (!sides_agree(s, wi)) return Vec3d(0);
  return Vec3d(s.bsdf->finite_density(parameters, wi, wo, s.shading_normal)) *
         std::abs(double{dot(wi, s.shading_normal)});
}

bool goes_straight(const Vec3f& direction, const Vec3f& wo) {
  const Vec3f off = direction + wo;
  return dot(off, off) < 1e-10f;  // 1e-5 rad
}

Vec3d straight_share(const Surface& s, const Vec3f& wo) {
  const Impulses impulses = s.bsdf->incoming_impulses(s.parameters, wo, s.shading_normal);
  for (int i = 0; i < impulses.count; ++i)
    if (goes_straight(impulses.impulse[i].direction, wo)) return Vec3d(impulses.impulse[i].magnitude);
  return Vec3d(0);
}

Receiver receiver_of(const Surface& s) { return {s.position(), s.normal, true}; }

Vec3d absorbed(const Vec3f& absorption, double distance) {
  Vec3d t(1);
  for (int b = 0; b < 3; ++b)
    if (absorption[b] > 0) t[b] = std::exp(-double{absorption[b]} * distance);
  return t;
}

Transport::Transport(const TransportScene& t)
    : shared(t), tracer(*t.scene), shafts_(fog_shafts(t.scene->view().world().media, t.scene->sky(), t.knobs)) {}

bool Transport::looks_through(const Surface& s) const {
  return shared.see_through && s.kind == SurfaceKind::voxel && shared.see_through->contains(s.block);
}

Vec3d Transport::sun_at_piece(int piece) {
  std::optional<Vec3d>& sun = shaft_suns_[static_cast<size_t>(piece)];
  if (sun) return *sun;
  LightSample light;
  light.direction = Vec3f(scene().environment().sun_direction);
  light.distance = kInfinity;
  light.target.kind = LightKind::sun;
  const auto [from, to] = shaft_span_;
  const double shift = shared::fog_shaft_shift(static_cast<float>(column), static_cast<float>(row));
  const double t = from + (to - from) * (piece + shift) / knobs().fog_sun_rays;
  sun = arrival(from_air(shaft_ray_, shaft_crossings_, t, light.direction), light).value;
  return *sun;
}

void Transport::cut_shafts(const TraceRay& ray, double t_end) {
  media_along(tracer, ray, shaft_crossings_, t_end, stretches);
  shaft_ray_ = ray;
  shaft_span_ = fog_shaft_span(stretches, ray.ray.direction);
  shaft_suns_.assign(static_cast<size_t>(knobs().fog_sun_rays), std::nullopt);
}

FogView Transport::fog_before(const TraceRay& ray, const std::vector<Crossing>& passed, double before, double t_end) {
  if (!scene().has_media()) return {};
  media_along(tracer, ray, passed, t_end, stretches);
  const auto sun = [&](int piece) { return sun_at_piece(piece); };
  const FogShafts shafts{shaft_span_.first, shaft_span_.second, knobs().fog_sun_rays, sun};
  return fog_along(stretches, ray.ray.direction, t_end, shafts_ ? &shafts : nullptr, before);
}

FogView Transport::fog(const TraceRay& ray, double t_end) {
  if (shafts_) {
    shaft_crossings_ = crossings;
    cut_shafts(ray, t_end);
  }
  return fog_before(ray, crossings, 0, t_end);
}

FogView Transport::fog_straight(const TraceRay& ray, double before, const Surface& surface, double most) {
  if (shafts_ && before == 0) {
    // Look ahead to where the ray ends.
    shaft_crossings_ = crossings;
    double end = surface.t;
    for (Surface s = surface; looks_through(s); end += s.t) {
      TraceRay on = s.spawn(Vec3f(ray.ray.direction));
      on.ray.direction = ray.ray.direction;
      on.ray.t_max = ray.ray.t_max - end;
      s = tracer.intersect(on, shadow_crossings);
      for (Crossing c : shadow_crossings) {
        c.t += end;
        shaft_crossings_.push_back(c);
      }
    }
    cut_shafts(ray, std::min(end, most));
  }
  return fog_before(ray, crossings, before, surface.t);
}

FogView Transport::with_clouds(const FogView& fog, const TraceRay& ray, const std::vector<Crossing>& passed,
                               double t_end) {
  const world::shared::CloudView clouds = scene().sky().clouds_along(ray.start(), ray.ray.direction, t_end);
  if (clouds.through == 1) return fog;
  const FogView before = fog_before(ray, passed, 0, double{clouds.distance});
  return {fog.value * double{clouds.through},
          Vec3d(clouds_laid_over(clouds, glm::vec3(before.value), glm::vec3(before.added), glm::vec3(fog.added)))};
}

Vec3d Transport::sky(const Vec3f& direction) const {
  const Rgb l = scene().sky().radiance(Vec3d(direction));
  return {l.r, l.g, l.b};
}

Vec3d Transport::seen_sky(const Vec3f& direction) const {
  const Rgb l = scene().sky().seen(Vec3d(direction));
  return {l.r, l.g, l.b};
}

Vec3d Transport::mirrored_sky(const world::WorldPoint& from, const Vec3f& direction) const {
  const Rgb l = scene().sky().mirrored(from, Vec3d(direction));
  return {l.r, l.g, l.b};
}

void Transport::texture(Surface& s, const TraceRay& ray, double before, bool seen) const {
  if (!shared.textures || s.kind != SurfaceKind::voxel || s.inside) return;
  const int axis = world::face_axis(s.face);
  glm::vec3 step_x(0), step_y(0);
  if (seen) {
    const Vec3f direction(ray.ray.direction), at = direction * static_cast<float>(before + s.t);
    step_x = render::shared::texture_step(at, direction, pixel_x, axis);
    step_y = render::shared::texture_step(at, direction, pixel_y, axis);
  }
  s.texture = shared.textures->factor(knobs(), s.block, s.behind, s.face, glm::vec3(s.point), step_x, step_y);
  s.parameters.lambertian *= s.texture;
  if (knobs().normal_detail != 0)
    s.shading_normal = shared.textures->normal(knobs(), s.block, s.behind, s.face, glm::vec3(s.point), step_x, step_y);
}

namespace {

/// What an interface lets through of light that goes straight on; its direction is the one that it has in air.
glsl::vec3 straight_passed(const SeeThroughKinds& kinds, const Surface& s, uint16_t near, uint16_t far,
                           const Vec3d& direction) {
  const std::vector<shared::SeeThroughBlock>& blocks = kinds.blocks();
  return interface_shares(kinds.of(s.block), 1, blocks[near].absorption.w, blocks[far].absorption.w,
                          static_cast<float>(std::abs(direction[world::face_axis(s.face)])))
      .passed;
}

}  // namespace

Arrival Transport::arrival(TraceRay ray, const LightSample& light, ShadowTracking* tracking, bool shadows) {
  Arrival arrival;
  arrival.value = Vec3d(1);
  ++tracer.counts.shadow_rays;
  const LightTarget& target = light.target;
  if (target.kind == LightKind::sun) arrival.value *= double{scene().sky().sun_through(ray.start())};
  const auto through_media = [&](const std::vector<Crossing>& passed, double t_end) {
    if (!scene().has_media()) return;
    media_along(tracer, ray, passed, t_end, shadow_stretches);
    const Transmittance t =
        tracking ? tracked_transmittance(shadow_stretches, ray.ray.direction, tracking->hero, tracking->random)
                 : transmittance(shadow_stretches, ray.ray.direction);
    arrival.value *= t.value, arrival.made *= t.made, arrival.lit *= t.lit;
  };
  if (!shadows || (light.luminaire && !light.luminaire->shadows)) {
    through_media({}, light.distance);
    return arrival;
  }
  const bool named = target.kind == LightKind::voxel || target.kind == LightKind::triangle;
  const uint32_t not_this = target.kind == LightKind::luminaire ? target.index : UINT32_MAX;
  const bool tinted = target.kind == LightKind::sun && tints_sun(knobs());
  const SeeThroughKinds* const straight = tinted ? shared.sun_through : nullptr;
  uint16_t medium = straight ? straight->kind(tracer.block_of(ray.ray)) : 0;
  // Light that comes straight is held back by what is opaque, and by luminaires never, as for the other backends; paths
  // meet all there is.
  const bool comes_straight =
      knobs().light_transport == LightTransport::direct || knobs().light_transport == LightTransport::ambient_occlusion;
  const auto told_already = [&](const Surface& s) {
    return comes_straight && s.kind == SurfaceKind::voxel && scene().view().palette()[s.block].opaque;
  };
  double left = light.distance;
  for (;;) {
    // A face or triangle is known by its name; a point of a luminaire only by its distance.
    ray.ray.t_max = named ? left * (1 + kLuminaireTolerance) : left * (1 - kLuminaireTolerance);
    if (comes_straight && tracer.meets_opaque(ray.ray)) {
      arrival.value = Vec3d(0);
      return arrival;
    }
    const bool meshes_alone = comes_straight && !tinted;
    const Vec3f absorption = meshes_alone && ray.around.count() == 0 ? Vec3f(0) : tracer.absorption(ray);
    const Surface s = meshes_alone ? tracer.intersect_meshes(ray, shadow_crossings)
                                   : tracer.intersect(ray, shadow_crossings, !comes_straight, not_this);
    const bool reached = !s.hit() ||
                         (target.kind == LightKind::voxel && s.kind == SurfaceKind::voxel && s.behind == target.voxel &&
                          s.face == target.face) ||
                         (target.kind == LightKind::voxel && s.kind == SurfaceKind::shape && s.behind == target.voxel &&
                          s.t >= left * (1 - kLuminaireTolerance)) ||
                         (target.kind == LightKind::triangle && s.kind == SurfaceKind::mesh &&
                          s.index == target.index && s.triangle == target.triangle);
    const Vec3f wo(-ray.ray.direction);
    if (!reached) {
      const bool layer = straight && s.kind == SurfaceKind::voxel && straight->contains(s.block);
      const uint16_t near = medium;
      if (layer) medium = straight->kind(s.beyond);
      const Vec3d share = told_already(s) ? Vec3d(1)
                          : layer         ? Vec3d(straight_passed(*straight, s, near, medium, ray.ray.direction))
                          : s.kind == SurfaceKind::luminaire || !scene().materials()[s.block].transmits
                              ? Vec3d(0)
                              : straight_share(s, wo);
      arrival.value *= share;
      if (share == Vec3d(0)) return arrival;
    }
    const double t_end = reached ? left : s.t;
    if (absorption != Vec3f(0)) arrival.value *= absorbed(absorption, t_end);
    through_media(shadow_crossings, t_end);
    if (arrival.value == Vec3d(0) || reached) return arrival;
    ++tracer.counts.transmissions;
    ray = s.spawn(-wo);
    left -= s.t;
  }
}

Integrator integrator_of(LightTransport transport) {
  switch (transport) {
    case LightTransport::direct:
      return direct_radiance;
    case LightTransport::ambient_occlusion:
      return ambient_occlusion_radiance;
    case LightTransport::whitted:
      return whitted_radiance;
    case LightTransport::path:
      return path_radiance;
    case LightTransport::photons:
      return photons_radiance;
  }
  return path_radiance;
}

}  // namespace render
