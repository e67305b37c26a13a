// Light that comes straight from sources, or is kept with the world (world_lit.h): what the picture of the first
// surface needs, and no more. See-through blocks are layers before it (render/see_through.shared.h), unless
// transparency=opaque. Other surfaces that scatter by impulses alone (mirrors, meshes of glass) are shaded as matte
// ones of the block's albedo, as the rasterizer shades them; media dim what lies behind and add their own emission.
// error  all other light is missing: the bias floor of the ladder of light transports
#include <algorithm>
#include <cmath>
#include <optional>

#include "render/light/light_cells.h"
#include "render/see_through.h"
#include "render/shading.h"
#include "render/trace/transport.h"
#include "render/trace/world_lit.h"

namespace render {

namespace {

constexpr double kPi = 3.14159265358979323846;

Vec3d vector_of(auto bands) { return {bands.r, bands.g, bands.b}; }

/// Of all that it scatters, as if it were matte: by impulses alone, or light of no known direction.
Vec3d albedo_of(const Transport& t, const Surface& s) {
  const world::Block& block = t.scene().view().palette()[s.block];
  return vector_of(block.albedo + block.glossy) * double{s.texture};
}

/// The sky lights a face of a voxel as its plane lies, whatever its texture does.
Vec3d sky_normal(const Surface& s) { return Vec3d(s.kind == SurfaceKind::voxel ? s.normal : s.shading_normal); }

/// One light's samples towards a surface.
Vec3d one_light(Transport& t, LightTarget target, int samples, bool shadows, const Surface& s, const Vec3f& wo,
                const Sampler& sampler, uint32_t dimension) {
  const bool finite = t.scene().materials()[s.block].finite;
  Vec3d sum(0);
  for (int i = 0; i < samples; ++i) {
    const Sampler part = sampler.part(static_cast<uint32_t>(i), static_cast<uint32_t>(samples));
    LightSample light;
    if (target.kind == LightKind::luminaire) ++t.tracer.counts.luminaire_samples;
    if (!t.lights().sample_one(target, receiver_of(s), part.two(dimension + kOnLight), light)) continue;
    const BsdfParameters p = parameters_for(s, light.luminaire);
    Vec3d scattered;
    if (finite) {
      scattered = finite_scattering(s, p, light.direction, wo);
    } else {
      const double cosine = std::max(0.0f, dot(light.direction, s.shading_normal));
      scattered = light.luminaire && !light.luminaire->lambertian ? Vec3d(0) : albedo_of(t, s) * (cosine / kPi);
    }
    if (scattered == Vec3d(0)) continue;
    const Vec3d arrives = t.arrival(s.spawn(light.direction), light, nullptr, shadows).value;
    sum += scattered * light.radiance * arrives / (light.pdf > 0 ? light.pdf : 1.0);
  }
  return sum / double(samples);
}

/// What the camera looks straight through, front to back.
struct Layers {
  shared::StraightView view = shared::start_of_view();
  uint16_t eye = 0, medium = 0;  // kinds of the block that the camera is in, and of that at hand
  double passed = 0;             // m up to the last interface
  bool any = false;
};

/// Meets the surface if it is one of a see-through block. `fog`: from the camera up to it. `shade`: what its matte part
/// shows.
template <class Shade>
bool meet_layer(Transport& t, Layers& layers, const Surface& s, const Vec3d& direction, const FogView& fog,
                Shade shade) {
  if (!t.looks_through(s)) return false;
  const SeeThroughKinds& kinds = *t.shared.see_through;
  const uint32_t pattern = static_cast<uint32_t>(t.knobs().coverage_pattern);
  const uint16_t far = kinds.kind(s.beyond);
  const shared::SeeThroughBlock &owner = kinds.of(s.block), &near_block = kinds.blocks()[layers.medium];
  const int axis = world::face_axis(s.face);
  const shared::InterfaceShares shares =
      shared::interface_shares(owner, kinds.blocks()[layers.eye].absorption.w, near_block.absorption.w,
                               kinds.blocks()[far].absorption.w, static_cast<float>(std::abs(direction[axis])));
  Vec3d mirrored(0), matte(0);
  if (shares.mirrored != glsl::vec3(0)) {
    Vec3d back = direction;
    back[axis] = -back[axis];
    mirrored = t.mirrored_sky(s.position(), Vec3f(back));
  }
  if (shares.matte > 0) {
    Surface whole = s;  // of which `shares` says how much there is
    whole.parameters.coverage = 1;
    matte = Vec3d(t.scene().materials()[s.block].emission) + shade(whole);
  }
  uint32_t mask = 0;
  if (pattern != shared::kCoverageExact && owner.matte.w == static_cast<float>(shared::kSeeThroughCoverage)) {
    const int32_t plane = s.behind[axis] + (s.face & 1);
    mask = shared::coverage_mask(pattern, owner.emitted.w, t.column, t.row, static_cast<uint32_t>(plane * 6 + s.face));
  }
  layers.view = met_media(layers.view, glsl::vec3(fog.value), glsl::vec3(fog.added));
  layers.view = met_interface(layers.view, owner, shares, glsl::vec3(near_block.absorption),
                              static_cast<float>(layers.passed + s.t), glsl::vec3(mirrored), glsl::vec3(matte),
                              !s.inside, pattern, mask);
  layers.passed += s.t;
  layers.medium = far;
  layers.any = true;
  ++t.tracer.counts.transmissions;
  return true;
}

/// The first surface from the camera that none looks straight through, or a body before it, with the layers and the fog
/// before that. Fog is that of the whole way, whose shafts are cut into the same pieces by the rasterizer.
template <class Shade>
Vec3d first_surface(Transport& t, const TraceRay& camera_ray, Shade shade) {
  ++t.tracer.counts.camera_rays;
  const double t_most = camera_ray.ray.t_max;
  const Vec3d direction = camera_ray.ray.direction;
  double t_body = t_most;
  const glm::vec4* const body = t.shared.bodies.first(camera_ray.ray, t_body);
  TraceRay ray = camera_ray;
  Layers layers;
  if (t.shared.see_through) layers.eye = layers.medium = t.shared.see_through->kind(t.tracer.block_of(ray.ray));
  FogView fog;
  std::vector<Crossing> first_crossings;  // of the camera's ray up to the first layer
  for (;;) {
    const Vec3f absorption = t.tracer.absorption(ray);
    Surface s = t.tracer.intersect(ray, t.crossings);
    const bool on_body = body && t_body < layers.passed + s.t;
    if (on_body) s = {}, s.t = t_body - layers.passed;
    t.texture(s, ray, layers.passed, true);
    const FogView here = t.fog_straight(ray, layers.passed, s, t_body);
    fog.added += fog.value * here.added;
    fog.value *= here.value;
    if (!layers.any) first_crossings = t.crossings;
    const FogView veil = t.with_clouds(fog, camera_ray, first_crossings, layers.passed + s.t);
    if (meet_layer(t, layers, s, direction, veil, shade)) {
      const glsl::vec3 left = layers.view.through;
      if (std::max({left.x, left.y, left.z}) < 1e-6f) return Vec3d(layers.view.added);
      ray = s.spawn(Vec3f(direction));
      ray.ray.direction = direction;
      ray.ray.t_max = t_most - layers.passed;
      continue;
    }
    Vec3d seen(0);
    if (on_body)
      seen = Vec3d(glm::vec3(*body));
    else if (!s.hit())
      seen = seen_far(t, ray);
    else if (s.kind == SurfaceKind::luminaire)
      seen = Vec3d(s.emission);
    else
      seen = Vec3d(s.emission) + shade(s);
    // Beside what fog and clouds add. Bodies have their clouds already.
    const Vec3d behind = on_body ? max(fog.value * seen + fog.added - veil.added, Vec3d(0)) : veil.value * seen;
    if (!layers.any) {
      const Vec3d through = absorbed(absorption, s.t);
      // What is looked through takes of fog too.
      return through * behind + (t.shared.see_through ? through * veil.added : veil.added);
    }
    const uint32_t pattern = static_cast<uint32_t>(t.knobs().coverage_pattern);
    const std::vector<shared::SeeThroughBlock>& blocks = t.shared.see_through->blocks();
    layers.view = met_media(layers.view, glsl::vec3(1), glsl::vec3(veil.added));
    return Vec3d(end_of_view(layers.view, blocks[layers.medium], blocks[layers.eye].absorption.w,
                             static_cast<float>(layers.passed + s.t), glsl::vec3(behind), pattern));
  }
}

}  // namespace

Vec3d seen_far(const Transport& t, const TraceRay& ray) {
  Vec3d l = t.seen_sky(Vec3f(ray.ray.direction));
  for (const SceneLuminaire& s : t.scene().luminaires()) {
    if (s.finite || !s.met) continue;
    const auto hit = s.sampler.meet(ray.start() - s.luminaire->position, Vec3f(ray.ray.direction));
    if (hit) l += vector_of(hit->radiance);
  }
  return l;
}

Vec3d light_by_light(Transport& t, const Surface& s, const Vec3f& wo, const Sampler& sampler, uint32_t dimension,
                     bool first, bool sunlit) {
  Vec3d sum(0);
  // A map stands for rays, which are cast here anyway.
  const bool sun_casts = t.knobs().sun_shadow == SunShadow::ray || t.knobs().sun_shadow == SunShadow::map;
  if (t.scene().environment().sun_irradiance.max() > 0 && sunlit)
    sum += one_light(t, {LightKind::sun, 0, 0, {}, world::kNoFace}, 1, sun_casts, s, wo, sampler, dimension);
  const auto& luminaires = t.scene().luminaires();
  const auto add = [&](uint32_t i) {
    if (!first && !luminaires[i].luminaire->global_illumination) return;
    sum += one_light(t, {LightKind::luminaire, i, 0, {}, world::kNoFace},
                     luminaires[i].impulse ? 1 : t.knobs().light_samples,
                     t.knobs().luminaire_shadow != LuminaireShadow::none, s, wo, sampler,
                     dimension + (i + 1) * kDimensionsPerVertex * 64);
  };
  const LightCells* const cells = t.shared.light_cells;
  if (!cells) {
    for (uint32_t i = 0; i < luminaires.size(); ++i) add(i);
    return sum;
  }
  for (const uint32_t i : cells->everywhere()) add(i);
  const world::WorldPoint place = s.position();
  for (const uint32_t i : cells->near(place.voxel)) {
    const Vec3d to = place - luminaires[i].luminaire->position;
    if (dot(to, to) <= cells->reaches()[i] * cells->reaches()[i]) add(i);
  }
  return sum;
}

Vec3d direct_radiance(Transport& t, const TraceRay& camera_ray, const Sampler& sampler) {
  return first_surface(t, camera_ray, [&](const Surface& s) {
    const Vec3d sky = vector_of(sky_irradiance(t.scene().sky(), sky_normal(s)));
    const Vec3d albedo = albedo_of(t, s);
    std::optional<WorldLit::Light> of_world;
    if (t.shared.lit) of_world = t.shared.lit->at(s, sky / kPi);
    return (of_world ? albedo * of_world->lit : albedo * sky / kPi) +
           light_by_light(t, s, Vec3f(-camera_ray.ray.direction), sampler, kVertexDimension, true,
                          !of_world || of_world->sunlit);
  });
}

Vec3d ambient_occlusion_radiance(Transport& t, const TraceRay& camera_ray, const Sampler& sampler) {
  return first_surface(t, camera_ray, [&](const Surface& s) {
    Vec3d sky = vector_of(sky_irradiance(t.scene().sky(), sky_normal(s)));
    if (sky != Vec3d(0)) {
      int open = 0;
      const int rays = t.knobs().light_samples;
      Vec3d a, b;
      basis_around(Vec3d(s.shading_normal), a, b);
      for (int i = 0; i < rays; ++i) {
        const glm::vec2 u =
            sampler.part(static_cast<uint32_t>(i), static_cast<uint32_t>(rays)).two(kVertexDimension + kOcclusion);
        const double r = std::sqrt(double{u.x}), angle = 2 * kPi * double{u.y};
        const Vec3f direction(r * std::cos(angle) * a + r * std::sin(angle) * b +
                              std::sqrt(1 - double{u.x}) * Vec3d(s.shading_normal));
        TraceRay ray = s.spawn(direction);
        ray.ray.t_max = t.knobs().occlusion_distance;
        ++t.tracer.counts.shadow_rays;
        open += !t.tracer.intersect(ray, t.shadow_crossings, false).hit();
      }
      sky *= static_cast<double>(open) / rays;
    }
    return albedo_of(t, s) * sky / kPi +
           light_by_light(t, s, Vec3f(-camera_ray.ray.direction), sampler, kVertexDimension, true);
  });
}

}  // namespace render
