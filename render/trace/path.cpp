// Paths from the camera: at each surface or scattering event one light is asked (next-event estimation), one direction
// followed, and the two ways of meeting a light are weighed by the balance heuristic. So no sample of one event adds
// more than pi times the light's radiance times the albedo, however near lamp and wall are (hard case B14). What passes
// a thin or partly covering surface unbent counts as no event: the light before it sees the light behind it. Russian
// roulette begins at the fifth event. Unbiased.
#include <algorithm>
#include <cmath>

#include "render/trace/transport.h"

namespace render {

namespace {

constexpr int kSureEvents = 4;          // before Russian roulette
constexpr uint32_t kDullVertices = 64;  // after so many, paths that lose nothing end too: light trapped in glass

/// Of an emission met by a ray: 1 over the mean of all probabilities with which it might have been found.
double balance(const Bands& bands, bool impulse, double light_pdf) {
  return 1 / Bands::mean(impulse ? bands.made : bands.made + bands.lit * light_pdf);
}

class Path {
 public:
  Path(Transport& t, const TraceRay& camera_ray, const Sampler& sampler) : t_(t), sampler_(sampler), ray_(camera_ray) {
    bands_.hero = std::min(static_cast<int>(sampler.one(kHeroDimension) * 3), 2);
  }

  Vec3d radiance() {
    for (vertex_ = 0;; ++vertex_) {
      const Vec3f absorption = t_.tracer.absorption(ray_);
      Surface surface = t_.tracer.intersect(ray_, t_.crossings);
      t_.texture(surface, ray_, 0, vertex_ == 0);
      ScatterEvent event{false, surface.t, nullptr};
      const Bands at_start = bands_;
      if (t_.scene().has_media()) {
        media_along(t_.tracer, ray_, t_.crossings, surface.t, t_.stretches);
        if (!t_.stretches.empty()) {
          RandomStream random = sampler_.stream(dimension(kFreePath));
          event = follow_media(t_.stretches, ray_.ray.direction, surface.t, t_.knobs().density_tracking, random, bands_,
                               light_);
        }
      }
      // Only an eye and mirrors see clouds.
      if (impulse_) pass_clouds(at_start, surface.t, event.t);
      if (absorption != Vec3f(0)) bands_.beta *= absorbed(absorption, event.t);
      if (bands_.beta == Vec3d(0)) return light_;
      const bool goes_on = event.scatters ? scatter_in_medium(event) : surface.hit() ? scatter_at(surface) : leave();
      if (!goes_on || !survives()) return light_;
      ++t_.tracer.counts.scattered_rays;
    }
  }

 private:
  uint32_t dimension(uint32_t use) const { return kVertexDimension + vertex_ * kDimensionsPerVertex + use; }
  bool at_last_event() const { return t_.knobs().max_depth > 0 && events_ >= t_.knobs().max_depth; }
  void add(const Vec3d& emission, double light_pdf) {
    light_ += bands_.beta * emission * balance(bands_, impulse_, light_pdf);
  }
  /// Light of a luminaire that switches keep from some of physics, met by a ray: seen straight from the camera, or by
  /// impulses; what scatters otherwise is asked for by next-event estimation alone.
  bool shows(const world::Luminaire& l) const {
    return straight_ || (impulse_ && l.glossy && (l.global_illumination || events_ <= 1));
  }

  /// Clouds on the ray add their light, by a path of its own through the media before them, and take of what lies
  /// behind. `bands`: at the ray's start.
  void pass_clouds(Bands bands, double t_surface, double t_event) {
    const auto up_to = [&](double t) { return t_.scene().sky().clouds_along(ray_.start(), ray_.ray.direction, t); };
    const world::shared::CloudView clouds = up_to(t_surface);
    if (clouds.through == 1) return;
    bands_.beta *= double{t_event < t_surface ? up_to(t_event).through : clouds.through};
    if (t_.scene().has_media()) {
      media_along(t_.tracer, ray_, t_.crossings, double{clouds.distance}, t_.stretches);
      RandomStream random = sampler_.stream(dimension(kBeforeClouds));
      Vec3d of_media(0);  // is there already
      if (follow_media(t_.stretches, ray_.ray.direction, double{clouds.distance}, t_.knobs().density_tracking, random,
                       bands, of_media)
              .scatters)
        return;
    }
    light_ += bands.beta * Vec3d(clouds.added) * balance(bands, true, 0);
  }

  bool leave() {
    const Vec3f direction(ray_.ray.direction);
    // Disks of the sun and the moon are lights of their own but where only an eye or a mirror finds them.
    const Vec3d sky = impulse_ ? t_.seen_sky(direction) : t_.sky(direction);
    if (sky != Vec3d(0)) add(sky, impulse_ ? 0 : t_.lights().pdf_sky(receiver_, direction));
    const auto& luminaires = t_.scene().luminaires();
    for (uint32_t i = 0; i < luminaires.size(); ++i) {
      if (luminaires[i].finite || !luminaires[i].met) continue;
      const auto hit = luminaires[i].sampler.meet(ray_.start() - luminaires[i].luminaire->position, direction);
      if (hit) add_luminaire(i, Vec3d(hit->radiance.r, hit->radiance.g, hit->radiance.b), hit->pdf);
    }
    return false;
  }

  void add_luminaire(uint32_t index, const Vec3d& radiance, double direction_pdf) {
    const SceneLuminaire& l = t_.scene().luminaires()[index];
    if (!l.physical) {
      if (shows(*l.luminaire)) add(radiance, 0);
    } else {
      add(radiance, impulse_ ? 0 : t_.lights().pdf_luminaire(receiver_, index, direction_pdf));
    }
  }

  bool scatter_at(const Surface& s) {
    const Vec3f direction(ray_.ray.direction), wo = -direction;
    if (s.kind == SurfaceKind::luminaire) {
      add_luminaire(s.index, Vec3d(s.emission), s.luminaire_pdf);
      return false;
    }
    if (s.emission != Vec3f(0)) {
      const double distance = glm::length(s.position() - receiver_.position);
      add(Vec3d(s.emission), impulse_ ? 0
                             : s.kind != SurfaceKind::mesh
                                 ? t_.lights().pdf_voxel(receiver_, s, direction, distance)
                                 : t_.lights().pdf_triangle(receiver_, s.index, s.triangle, direction, distance));
    }
    const bool last = at_last_event();
    if (!last && t_.scene().materials()[s.block].finite && !t_.lights().empty()) {
      ++events_;
      ask_light(
          receiver_of(s),
          [&](const Vec3f& wi, const world::Luminaire* l, double& pdf) {
            const BsdfParameters p = parameters_for(s, l);
            pdf = s.bsdf->pdf(p, wi, wo, s.shading_normal);
            return finite_scattering(s, p, wi, wo);
          },
          [&](const Vec3f& wi) { return s.spawn(wi); });
      --events_;
    }
    const BsdfSample next = s.bsdf->scatter_in(s.parameters, wo, s.shading_normal, sampler_.three(dimension(kScatter)));
    if (next.weight == Vec3f(0) || next.direction == Vec3f(0)) return false;
    const bool straight = next.impulse && goes_straight(next.direction, wo);
    if ((last && !straight) || !sides_agree(s, next.direction)) return false;
    const bool through = dot(next.direction, s.normal) < 0;
    t_.tracer.counts.transmissions += through;
    ray_ = s.spawn(next.direction);
    bands_.beta *= Vec3d(next.weight);
    if (straight) return true;
    ++events_;
    if (through) eta_scale_ *= double{s.parameters.eta} * s.parameters.eta;
    straight_ = false;
    impulse_ = next.impulse;
    if (!impulse_) {
      receiver_ = receiver_of(s);
      bands_.lit = bands_.made / double{next.pdf};
    }
    return true;
  }

  bool scatter_in_medium(const ScatterEvent& event) {
    if (at_last_event()) return false;
    ++events_;
    const Vec3d forward = ray_.ray.direction;
    const double g = event.medium->medium->anisotropy;
    const Receiver receiver{ray_.start() + event.t * forward, Vec3f(0), false};
    const auto towards = [&](const Vec3f& wi) { return from_air(ray_, t_.crossings, event.t, wi); };
    if (!t_.lights().empty())
      ask_light(
          receiver,
          [&](const Vec3f& wi, const world::Luminaire* l, double& pdf) {
            pdf = phase_density(g, dot(forward, Vec3d(wi)));
            return Vec3d(l && !l->lambertian ? 0 : pdf);
          },
          towards);
    const Vec3d next = sample_phase(g, forward, sampler_.two(dimension(kScatter)));
    bands_.lit = bands_.made / phase_density(g, dot(forward, next));
    receiver_ = receiver;
    straight_ = impulse_ = false;
    ray_ = towards(Vec3f(next));
    return true;
  }

  /// Adds the light that one picked light sends here and that `scatter` turns back along the path. `scatter` also says
  /// with which density the path itself would have gone there.
  template <class Scatter, class Spawn>
  void ask_light(const Receiver& receiver, Scatter scatter, Spawn spawn) {
    LightSample light;
    if (!t_.lights().sample(receiver, sampler_.one(dimension(kPickLight)), sampler_.two(dimension(kOnLight)), light))
      return;
    (light.target.kind == LightKind::luminaire ? t_.tracer.counts.luminaire_samples
     : light.target.kind == LightKind::voxel   ? t_.tracer.counts.block_light_samples
                                               : unnamed_samples_) += 1;
    const world::Luminaire* l = light.luminaire;
    if (l && !l->global_illumination && events_ > 1) return;
    double pdf = 0;
    const Vec3d scattered = bands_.beta * scatter(light.direction, l, pdf);
    if (scattered == Vec3d(0)) return;
    ShadowTracking tracking{bands_.hero, sampler_.stream(dimension(kShadowPath))};
    const bool tracks = t_.scene().has_media() && t_.knobs().density_tracking == DensityTracking::delta;
    const Arrival a = t_.arrival(spawn(light.direction), light, tracks ? &tracking : nullptr);
    if (a.value == Vec3d(0)) return;
    // Who is met by no ray is found in this way alone.
    const bool found_twice = light.pdf > 0 && !l && met(light.target);
    const Vec3d lit = bands_.made * a.lit * (light.pdf > 0 ? light.pdf : 1.0);
    light_ += scattered * light.radiance * a.value / Bands::mean(found_twice ? lit + bands_.made * a.made * pdf : lit);
  }

  bool met(const LightTarget& target) const {
    return target.kind != LightKind::luminaire || t_.scene().luminaires()[target.index].met;
  }

  bool survives() {
    if (events_ <= kSureEvents && vertex_ < kDullVertices) return true;
    const Vec3d worth = bands_.beta * eta_scale_ / Bands::mean(bands_.made);
    const double chance = std::min(vertex_ < kDullVertices ? 1 : 0.95, std::max({worth.x, worth.y, worth.z}));
    if (!(sampler_.one(dimension(kRoulette)) < chance)) return false;
    bands_.beta /= chance;
    return true;
  }

  Transport& t_;
  const Sampler& sampler_;
  TraceRay ray_;
  Bands bands_;
  Vec3d light_{0};
  Receiver receiver_;     // the last event that was no impulse
  bool straight_ = true;  // the ray still goes as it left the camera
  bool impulse_ = true;   // no event, or the last was an impulse: no light was asked there
  int events_ = 0;
  uint32_t vertex_ = 0;
  double eta_scale_ = 1;  // takes out of the throughput what refraction only spreads
  uint64_t unnamed_samples_ = 0;
};

}  // namespace

Vec3d path_radiance(Transport& t, const TraceRay& camera_ray, const Sampler& sampler) {
  ++t.tracer.counts.camera_rays;
  return Path(t, camera_ray, sampler).radiance();
}

}  // namespace render
