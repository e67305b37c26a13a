/// Light that arrives over several surfaces, by photons: traced from the lights, kept where a surface that isn't only a
/// mirror or glass received them, gathered by density. Light straight from its source is asked for as the other
/// integrators do, so photons keep only what has scattered once; caustics are among it.
///
/// Each sample a pixel has photons of its own and a radius that shrinks, r(i+1)^2 = r(i)^2 (i + 2/3) / (i + 1), so that
/// the mean over samples converges: its bias falls as samples^(-1/3), its standard error as samples^(-1/3).
/// knobs  photons (a sample), photon_radius (the first), max_depth
/// error  blurs what is smaller than the radius, and darkens edges of faces over that breadth. Media take from photons
///        what they absorb and scatter, and give nothing back: no light scattered by fog. Luminaires without
///        global_illumination send none.
/// memory 72 bytes a photon kept
/// source Henrik Wann Jensen. Global Illumination using Photon Maps. 1996; Claude Knaus, Matthias Zwicker. Progressive
///        Photon Mapping: A Probabilistic Approach. 2011, with alpha = 2/3
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "render/trace/transport.h"

namespace render {

struct Photon {
  Vec3d point{0};          // from LightSet::anchor()
  Vec3f wi{0}, normal{0};  // unit, towards where it came from; of the face, on that side
  Vec3f power{0};          // W
};

/// The photons of one sample of all pixels, in a grid of cells of two radii.
class PhotonMap {
 public:
  static PhotonMap trace(const TransportScene& scene, uint64_t seed, uint32_t sample, TraceCounts& counts);

  double radius() const { return radius_; }
  size_t count() const { return photons_.size(); }
  /// Sum over photons within the radius, on faces turned as `normal`, of use(photon).
  template <class Use>
  void around(const Vec3d& point, const Vec3f& normal, Use use) const {
    if (photons_.empty()) return;
    const double cell = 2 * radius_, reach = radius_ * radius_;
    int64_t low[3], high[3];
    for (int a = 0; a < 3; ++a) {
      low[a] = static_cast<int64_t>(std::floor((point[a] - radius_) / cell));
      high[a] = static_cast<int64_t>(std::floor((point[a] + radius_) / cell));
    }
    uint32_t seen[8];
    int buckets = 0;
    for (int64_t x = low[0]; x <= high[0]; ++x)
      for (int64_t y = low[1]; y <= high[1]; ++y)
        for (int64_t z = low[2]; z <= high[2]; ++z) {
          const uint32_t bucket = bucket_of(x, y, z);
          if (std::find(seen, seen + buckets, bucket) != seen + buckets) continue;  // two cells of one hash
          if (buckets < 8) seen[buckets++] = bucket;
          for (uint32_t i = begin_[bucket]; i < begin_[bucket + 1]; ++i) {
            const Photon& p = photons_[i];
            const Vec3d off = p.point - point;
            if (dot(off, off) <= reach && dot(p.normal, normal) > 0.7f) use(p);
          }
        }
  }

 private:
  uint32_t bucket_of(int64_t x, int64_t y, int64_t z) const {
    return static_cast<uint32_t>(world::random_bits(1, x, y, z)) & (static_cast<uint32_t>(begin_.size()) - 2);
  }
  void sort();

  double radius_ = 1;
  std::vector<Photon> photons_;  // by bucket, within one in the order in which they were sent
  std::vector<uint32_t> begin_;  // of each bucket; a power of two, and one more
};

Vec3d photons_radiance(Transport& t, const TraceRay& camera_ray, const Sampler& sampler);

}  // namespace render
