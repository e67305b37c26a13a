#include "render/trace/photons.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "world/base/jobs.h"

namespace render {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr size_t kChunk = 512;   // photons a task
constexpr int kSureBounces = 2;  // before Russian roulette
constexpr int kMostBounces = 10000;

double largest(const Vec3d& v) { return std::max({v.x, v.y, v.z}); }

/// Whether a luminaire that has an area stands in the way of light that came to the surface along `direction`.
bool hidden_by_luminaire(const TraceScene& scene, const Surface& s, const Vec3f& direction, double length,
                         const LightTarget& source) {
  const auto counts = [&](uint32_t i) { return !(source.kind == LightKind::luminaire && source.index == i); };
  world::LuminaireHit hit;
  return scene.meet_luminaires(s.position(), -Vec3d(direction), length * (1 - 2 * kLuminaireTolerance), counts, hit)
      .has_value();
}

/// Follows one photon and keeps it where it scatters.
void follow(Transport& t, const LightPhoton& sent, RandomStream& random, std::vector<Photon>& kept) {
  TraceRay ray;
  ray.ray = world::GridRay(sent.origin, Vec3d(sent.direction));
  if (!ray.ray.valid()) return;
  // A light within solid matter is dark (hard case S5); one that lies on its surface begins before it.
  if (t.tracer.in_solid(ray.ray)) {
    ray.ray = world::GridRay(sent.origin + kLuminaireTolerance * Vec3d(sent.direction), Vec3d(sent.direction));
    if (t.tracer.in_solid(ray.ray)) return;
  }
  ray.around = t.tracer.around(sent.origin);
  LightTarget source = sent.source;
  if (source.kind == LightKind::triangle) ray.from = {source.index, source.triangle};
  Vec3d power = sent.power;
  const int limit = t.knobs().max_depth > 0 ? t.knobs().max_depth : kMostBounces;
  for (int events = 0; events < limit;) {
    ++t.tracer.counts.photon_rays;
    const Vec3f absorption = t.tracer.absorption(ray);
    const Surface s = t.tracer.intersect(ray, t.crossings, false);
    if (!s.hit()) return;
    const Vec3f direction(ray.ray.direction), wi = -direction;
    if (hidden_by_luminaire(t.scene(), s, direction, s.t, source)) return;
    source = {};
    if (t.scene().has_media()) {
      media_along(t.tracer, ray, t.crossings, s.t, t.stretches);
      power *= transmittance(t.stretches, ray.ray.direction).value;
    }
    if (absorption != Vec3f(0)) power *= absorbed(absorption, s.t);
    if (!(largest(power) > 0)) return;
    if (events > 0 && t.scene().materials()[s.block].finite)
      kept.push_back({s.position() - t.lights().anchor(), wi, s.normal, Vec3f(power)});
    const Vec3f u(random.next(), random.next(), random.next());
    const BsdfSample next = s.bsdf->scatter_out(s.parameters, wi, s.shading_normal, u);
    if (next.weight == Vec3f(0) || next.direction == Vec3f(0) || !sides_agree(s, next.direction)) return;
    if (!(next.impulse && goes_straight(next.direction, wi))) ++events;
    t.tracer.counts.transmissions += dot(next.direction, s.normal) < 0;
    const Vec3d scattered = power * Vec3d(next.weight);
    const double chance = events > kSureBounces ? std::min(1.0, largest(scattered) / largest(power)) : 1;
    if (!(random.next() < chance)) return;
    power = scattered / chance;
    ray = s.spawn(next.direction);
  }
}

}  // namespace

PhotonMap PhotonMap::trace(const TransportScene& scene, uint64_t seed, uint32_t sample, TraceCounts& counts) {
  PhotonMap map;
  double squared = double{scene.knobs.photon_radius} * scene.knobs.photon_radius;
  for (uint32_t i = 1; i <= sample; ++i) squared *= (i + 2.0 / 3) / (i + 1);
  map.radius_ = std::sqrt(squared);
  const size_t count = static_cast<size_t>(scene.knobs.photons), chunks = (count + kChunk - 1) / kChunk;
  std::vector<std::vector<Photon>> kept(chunks);
  std::vector<TraceCounts> chunk_counts(chunks);
  world::parallel_for(chunks, [&](size_t c) {
    Transport t(scene);
    for (size_t i = c * kChunk; i < std::min((c + 1) * kChunk, count); ++i) {
      // The photons of one sample are one sequence.
      const Sampler numbers(scene.knobs.sample_sequence, seed ^ 0x70686f746f6e73ull, sample, 0,
                            static_cast<uint32_t>(i));
      const glm::vec2 place = numbers.two(1), way = numbers.two(3);
      LightPhoton photon;
      if (!scene.lights->emit({numbers.one(0), place.x, place.y, way.x, way.y}, photon)) continue;
      if (photon.source.kind == LightKind::luminaire &&
          !scene.scene->luminaires()[photon.source.index].luminaire->global_illumination)
        continue;
      photon.power /= static_cast<double>(count);
      RandomStream random = numbers.stream(kFreePath);
      follow(t, photon, random, kept[c]);
    }
    chunk_counts[c] = t.tracer.counts;
  });
  for (size_t c = 0; c < chunks; ++c) {
    map.photons_.insert(map.photons_.end(), kept[c].begin(), kept[c].end());
    counts.add(chunk_counts[c]);
  }
  map.sort();
  return map;
}

void PhotonMap::sort() {
  begin_.assign(std::bit_ceil(std::max<size_t>(photons_.size(), 1)) + 1, 0);
  const auto bucket = [&](const Photon& p) {
    const Vec3d cell = floor(p.point / (2 * radius_));
    return bucket_of(static_cast<int64_t>(cell.x), static_cast<int64_t>(cell.y), static_cast<int64_t>(cell.z));
  };
  for (const Photon& p : photons_) ++begin_[bucket(p) + 1];
  for (size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
  std::vector<uint32_t> next(begin_.begin(), begin_.end() - 1);
  std::vector<Photon> sorted(photons_.size());
  for (const Photon& p : photons_) sorted[next[bucket(p)]++] = p;
  photons_ = std::move(sorted);
}

Vec3d photons_radiance(Transport& t, const TraceRay& camera_ray, const Sampler& sampler) {
  ++t.tracer.counts.camera_rays;
  TraceRay ray = camera_ray;
  Vec3d light(0), beta(1);
  bool straight = true;
  int events = 0;
  const PhotonMap& map = *t.shared.photons;
  for (uint32_t vertex = 0; vertex < 4096; ++vertex) {
    const uint32_t dimension = kVertexDimension + vertex * kDimensionsPerVertex;
    const Vec3f absorption = t.tracer.absorption(ray);
    Surface s = t.tracer.intersect(ray, t.crossings);
    t.texture(s, ray, 0, vertex == 0);
    const FogView fog = t.with_clouds(t.fog(ray, s.t), ray, t.crossings, s.t);
    light += beta * fog.added;
    beta *= fog.value;
    if (absorption != Vec3f(0)) beta *= absorbed(absorption, s.t);
    if (!s.hit()) return light + beta * seen_far(t, ray);
    if (s.kind == SurfaceKind::luminaire) {
      const world::Luminaire& l = *t.scene().luminaires()[s.index].luminaire;
      const bool shows = straight || (l.glossy && (l.global_illumination || events <= 1));
      return shows ? light + beta * Vec3d(s.emission) : light;
    }
    light += beta * Vec3d(s.emission);
    const Vec3f wo(-ray.ray.direction);
    const bool last = t.knobs().max_depth > 0 && events >= t.knobs().max_depth;
    if (!last && t.scene().materials()[s.block].finite) {
      // Straight from one light.
      LightSample lamp;
      if (t.lights().sample(receiver_of(s), sampler.one(dimension + kPickLight), sampler.two(dimension + kOnLight),
                            lamp)) {
        if (lamp.target.kind == LightKind::luminaire) ++t.tracer.counts.luminaire_samples;
        if (lamp.target.kind == LightKind::voxel) ++t.tracer.counts.block_light_samples;
        const bool takes_part = !lamp.luminaire || lamp.luminaire->global_illumination || events == 0;
        const Vec3d scattered = finite_scattering(s, parameters_for(s, lamp.luminaire), lamp.direction, wo);
        if (takes_part && scattered != Vec3d(0)) {
          const Arrival a = t.arrival(s.spawn(lamp.direction), lamp);
          light += beta * scattered * lamp.radiance * a.value / (lamp.pdf > 0 ? lamp.pdf : 1.0);
        }
      }
      // Over other surfaces: flux through the disk around the point.
      Vec3d gathered(0);
      map.around(s.position() - t.lights().anchor(), s.normal, [&](const Photon& p) {
        if (sides_agree(s, p.wi))
          gathered += Vec3d(s.bsdf->finite_density(s.parameters, p.wi, wo, s.shading_normal)) * Vec3d(p.power);
      });
      light += beta * gathered / (kPi * map.radius() * map.radius());
    }
    const BsdfSample next = s.bsdf->scatter_in(s.parameters, wo, s.shading_normal, sampler.three(dimension + kScatter));
    if (!next.impulse || next.weight == Vec3f(0) || next.direction == Vec3f(0)) return light;
    const bool unbent = goes_straight(next.direction, wo);
    if ((last && !unbent) || !sides_agree(s, next.direction)) return light;
    t.tracer.counts.transmissions += dot(next.direction, s.normal) < 0;
    ++t.tracer.counts.scattered_rays;
    beta *= Vec3d(next.weight);
    if (!unbent) straight = false, ++events;
    ray = s.spawn(next.direction);
    if (vertex >= 16) {
      const double chance = std::min(0.95, largest(beta));
      if (!(sampler.one(dimension + kRoulette) < chance)) return light;
      beta /= chance;
    }
  }
  return light;
}

}  // namespace render
