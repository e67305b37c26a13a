/// What every integrator is made of: a scene with its lights, a thread's tracer and scratch, and the light that arrives
/// at a point from a light that was picked.
///
/// An integrator is a function of a camera ray and a Sampler, so of (seed, pixel, sample) alone:
///   direct             render/trace/direct.cpp    the sky unhidden, or the light kept with the world; sun, luminaires
///   ambient_occlusion  render/trace/direct.cpp    the same, the sky as far as rays up to a distance find it open
///   whitted            render/trace/whitted.cpp   and what mirrors and glass show, down to max_depth
///   path               render/trace/path.cpp      all light, unbiased
///   photons            render/trace/photons.cpp   light that arrives over several surfaces by density estimation
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "render/inhabitants.shared.h"
#include "render/knobs.h"
#include "render/trace/lights.h"
#include "render/trace/volumes.h"
#include "world/space/box_tree.h"

namespace render {

/// Where each use of the sampler begins.
constexpr uint32_t kPixelDimension = 0, kLensDimension = 2, kHeroDimension = 4, kVertexDimension = 8,
                   kDimensionsPerVertex = 16;
/// Of one vertex, from kVertexDimension + vertex * kDimensionsPerVertex on.
constexpr uint32_t kPickLight = 0, kOnLight = 1, kScatter = 3, kRoulette = 6, kFreePath = 7, kOcclusion = 9,
                   kShadowPath = 10, kBeforeClouds = 11;

/// Bodies as rays meet them.
class TracedBodies {
 public:
  TracedBodies() = default;
  /// Boxes relative to the eye, which outlive this.
  TracedBodies(std::span<const shared::DrawnBox> boxes, const world::WorldPoint& eye);
  /// What a body shows, which is the same from everywhere, where a ray meets one before `t`, which is then where.
  const glm::vec4* first(const world::GridRay& ray, double& t) const;

 private:
  std::span<const shared::DrawnBox> boxes_;
  world::WorldPoint eye_;
  world::BoxTree tree_;
};

class LightCells;
class PhotonMap;
class SeeThroughKinds;
class TextureSet;
class WorldLit;

/// What all threads read.
struct TransportScene {
  const TraceScene* scene = nullptr;
  const LightSet* lights = nullptr;
  RenderKnobs knobs;
  const TextureSet* textures = nullptr;          // null: all blocks are even
  const PhotonMap* photons = nullptr;            // of the sample at hand, where light_transport asks for them
  const SeeThroughKinds* see_through = nullptr;  // blocks that direct and ambient_occlusion look straight through
  TracedBodies bodies{};                         // that rays of direct, ambient_occlusion and whitted meet
  const WorldLit* lit = nullptr;                 // of direct, in place of the open sky's light
  const SeeThroughKinds* sun_through = nullptr;  // blocks that the sun's light goes straight through
  const LightCells* light_cells = nullptr;       // of luminaires asked one by one; null: all of them, everywhere
};

/// Light that goes straight from a light to a point: `value` is the share that arrives, the others as in Transmittance.
struct Arrival {
  Vec3d value{0}, made{1}, lit{1};
};

/// Who tracks density grids: a path's hero, and numbers for it.
struct ShadowTracking {
  int hero = 0;
  RandomStream random{0};
};

class Transport {
 public:
  explicit Transport(const TransportScene& t);

  const TransportScene& shared;
  Tracer tracer;

  const TraceScene& scene() const { return *shared.scene; }
  const LightSet& lights() const { return *shared.lights; }
  const RenderKnobs& knobs() const { return shared.knobs; }

  /// How much of a light's sample arrives where `from` starts towards it: through media, blocks and what passes light
  /// straight. Counts one shadow ray. Density grids are tracked where `tracking` says how, else exact.
  /// Without `shadows` nothing but media takes of it.
  Arrival arrival(TraceRay from, const LightSample& light, ShadowTracking* tracking = nullptr, bool shadows = true);
  /// Of the media along a ray up to t_end, `crossings` being what it crosses there. Counts a shadow ray for each piece
  /// of its shafts.
  FogView fog(const TraceRay& ray, double t_end);
  /// The same of a ray that is looked straight along, from surface to surface: `ray` starts `before` metres on and
  /// meets `surface` next. Pieces of its shafts are those of all of the way, `most` metres at most, which are cut where
  /// `before` is 0.
  FogView fog_straight(const TraceRay& ray, double before, const Surface& surface, double most);
  /// With the clouds up to there, of a ray that an eye or a mirror sent. `fog`: of all of the way, what one of the two
  /// gave last; `passed`: the ray's crossings.
  FogView with_clouds(const FogView& fog, const TraceRay& ray, const std::vector<Crossing>& passed, double t_end);
  /// Whether it looks straight through a surface.
  bool looks_through(const Surface& surface) const;
  /// Radiance from the sky along a ray that leaves the scene.
  Vec3d sky(const Vec3f& direction) const;
  /// The same with what only an eye sees: disks and stars.
  Vec3d seen_sky(const Vec3f& direction) const;
  /// The same with clouds alone: what interfaces that are looked straight through mirror.
  Vec3d mirrored_sky(const world::WorldPoint& from, const Vec3f& direction) const;

  /// Gives a surface of the grid its block's texture. `seen`: by the camera's ray, over the pixel's footprint; else at
  /// the point itself. `before`: m from the camera to the ray's start.
  void texture(Surface& surface, const TraceRay& ray, double before, bool seen) const;

  uint32_t column = 0, row = 0;  // of the pixel at hand
  Vec3f pixel_x{0}, pixel_y{0};  // from the camera's ray at hand, of length 1, to those of the next pixels
  std::vector<Crossing> crossings, shadow_crossings;
  std::vector<MediumStretch> stretches, shadow_stretches;

 private:
  /// The pieces of a ray that crosses `shaft_crossings_` on its way to t_end.
  void cut_shafts(const TraceRay& ray, double t_end);
  FogView fog_before(const TraceRay& ray, const std::vector<Crossing>& passed, double before, double t_end);
  Vec3d sun_at_piece(int piece);

  const bool shafts_;
  TraceRay shaft_ray_;
  std::vector<Crossing> shaft_crossings_;
  std::pair<double, double> shaft_span_{0, 0};
  std::vector<std::optional<Vec3d>> shaft_suns_;  // of the pieces that were asked for
};

/// From a place that a ray passes, t metres on, into another direction.
TraceRay from_air(const TraceRay& ray, const std::vector<Crossing>& crossings, double t, const Vec3f& direction);

// --- surfaces -----------------------------------------------------------------------------------------------------

/// The surface's parameters, without what the light does not take part in.
BsdfParameters parameters_for(const Surface& surface, const world::Luminaire* luminaire);
/// f |n . wi|, 0 where the two directions lie on one side of the face but on two of the shading normal.
Vec3d finite_scattering(const Surface& surface, const BsdfParameters& parameters, const Vec3f& wi, const Vec3f& wo);
/// Whether scattering into wi, sampled with the shading normal, is one with the face too.
bool sides_agree(const Surface& surface, const Vec3f& wi);
/// Of light from straight behind the surface, what goes on unbent.
Vec3d straight_share(const Surface& surface, const Vec3f& wo);
/// Whether this direction goes on as wo came.
bool goes_straight(const Vec3f& direction, const Vec3f& wo);

/// The receiver that a surface is to lights.
Receiver receiver_of(const Surface& surface);

/// exp(-absorption * distance) by band.
Vec3d absorbed(const Vec3f& absorption, double distance);

// --- integrators --------------------------------------------------------------------------------------------------

using Integrator = Vec3d (*)(Transport&, const TraceRay&, const Sampler&);
/// What a transport whose knobs ask for this calls: what arrives at a surface, and what is in its way, goes by them
/// too.
Integrator integrator_of(LightTransport transport);
Vec3d direct_radiance(Transport& t, const TraceRay& camera_ray, const Sampler& sampler);
Vec3d ambient_occlusion_radiance(Transport& t, const TraceRay& camera_ray, const Sampler& sampler);
Vec3d whitted_radiance(Transport& t, const TraceRay& camera_ray, const Sampler& sampler);
Vec3d path_radiance(Transport& t, const TraceRay& camera_ray, const Sampler& sampler);

/// What a ray that meets nothing shows behind clouds: the sky, and luminaires at no place.
Vec3d seen_far(const Transport& t, const TraceRay& ray);
/// Sun and luminaires (light_samples of each that has an area), scattered by the surface towards wo, with shadows.
/// `first`: the surface is the first that light meets on its way from the eye back, for luminaires that only light
/// that. `sunlit`: the world's light leaves the sun where it is.
Vec3d light_by_light(Transport& t, const Surface& surface, const Vec3f& wo, const Sampler& sampler, uint32_t dimension,
                     bool first, bool sunlit = true);

}  // namespace render
