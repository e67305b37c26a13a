/// Media along a ray: where it scatters in them, and how much light they let through.
///
/// The three bands have extinctions of their own, so one free path can't serve all. A path follows one band, its hero,
/// picked uniformly; what it finds is weighed by the mean over all bands of the probability with which they would have
/// found it (balance heuristic), so each band's estimate is unbiased whatever the others' extinctions are. See Bands.
///
/// Depths along a ray and their inverses have closed forms (world/media/medium.h): free paths solve
/// sigma_t * depth(t) = -ln(1 - u), transmittances are exact. Density grids offer the same cell by cell
/// (DensityTracking::exact), and, by default, tracking: below the largest density of each brick, the majorant,
/// tentative collisions are drawn, of which the density's share are real; transmittances are products of the other
/// shares (ratio tracking). That asks for densities alone, so its cost goes with depth, not with cells, and it is
/// noisier; grids through which it would need 10^5 collisions are left to exact depths. Where several media overlap,
/// the first to scatter wins.
///
/// A medium's emission is the radiance that its matter, extinction included, would send out if it were infinitely deep:
/// along ds a medium adds sigma_t * density * emission * ds.
/// source  Alexander Wilkie et al. Hero Wavelength Spectral Sampling. 2014; Bailey Miller, Iliyan Georgiev, Wojciech
///         Jarosz. A Null-Scattering Path Integral Formulation of Light Transport. 2019, with the bookkeeping of Pharr,
///         Jakob, Humphreys. Physically Based Rendering, 4th edition. 2023, section 14.2
#pragma once

#include <utility>
#include <vector>

#include "render/knobs.h"
#include "render/trace/geometry.h"
#include "render/trace/sampler.h"
#include "world/base/function_ref.h"

namespace render {

/// What a path carries, by band. With f_k the path's contribution in band k, p_k the probability density with which a
/// path that follows band k would have been made, and h the hero: beta = f / p_h, made = p / p_h, and lit the same as
/// `made` if the last scattering had not been sampled but joined to a light.
struct Bands {
  Vec3d beta{1}, made{1}, lit{1};
  int hero = 0;

  static double mean(const Vec3d& v) { return (v.x + v.y + v.z) / 3; }
};

/// A stretch of a ray within one medium.
struct MediumStretch {
  const SceneMedium* medium = nullptr;
  Vec3d origin{0};  // of the ray, relative to the medium's position
  double t0 = 0, t1 = 0;
};

/// What tracking one density grid by one band's extinction came to: with sigma a band's extinction and h that band, the
/// other's probability of the same, over the hero's, is exp(-(sigma - sigma_h) majorant) (sigma / sigma_h)^nulls.
struct GridTracking {
  double majorant = 0;  // its integral up to the end or the real collision, m
  int nulls = 0;        // tentative collisions that weren't real
  double missed = 1;    // product over them of 1 - density / majorant
  double collision = world::kInfinity;
};

/// The stretches of [0, t_end] within media, in order of media; replaces what was in `out`.
void media_along(Tracer& tracer, const TraceRay& ray, const std::vector<Crossing>& crossings, double t_end,
                 std::vector<MediumStretch>& out);

struct ScatterEvent {
  bool scatters = false;
  double t = 0;
  const SceneMedium* medium = nullptr;
};

/// Follows the path along the ray, to where a medium scatters it or to t_end, and brings `bands` up to date, the
/// extinction and albedo there included. `emitted` gains what the media themselves send back, weighed.
ScatterEvent follow_media(const std::vector<MediumStretch>& stretches, const Vec3d& direction, double t_end,
                          DensityTracking tracking, RandomStream& random, Bands& bands, Vec3d& emitted);

/// The share of light that passes, by band. `made`: the probability that a path would have passed so, by band; `lit`:
/// that this estimate would have been made. All over the probability with which it was: 1 where nothing is drawn.
struct Transmittance {
  Vec3d value{1}, made{1}, lit{1};
};
Transmittance transmittance(const std::vector<MediumStretch>& stretches, const Vec3d& direction);
/// An estimate of it, right in the mean over heroes: value / mean(lit). Density grids are tracked.
Transmittance tracked_transmittance(const std::vector<MediumStretch>& stretches, const Vec3d& direction, int hero,
                                    RandomStream& random);

/// What is seen through and of the media alone:
/// `value` multiplies what lies behind; `added` is the media's own light, and what they scatter in (fog_light.h).
struct FogView {
  Vec3d value{1}, added{0};
};
/// From where to where the pieces of a ray lie for which fog asks for the sun (fog_shafts.shared.h), m; first >=
/// second: it meets no medium.
std::pair<double, double> fog_shaft_span(const std::vector<MediumStretch>& stretches, const Vec3d& direction);
/// Those pieces, and what of the sun's light comes to each, by band.
struct FogShafts {
  double from, to;
  int pieces;
  world::FunctionRef<Vec3d(int piece)> sun;
};
/// Up to t_end. shafts: null where nothing hides the sun; of a ray that began `before` metres before the stretches'
/// own.
FogView fog_along(const std::vector<MediumStretch>& stretches, const Vec3d& direction, double t_end = world::kInfinity,
                  const FogShafts* shafts = nullptr, double before = 0);

/// Henyey and Greenstein's phase function, which is also the density with which sample_phase picks directions, 1/sr.
/// `cosine`: between the ways of the light before and after.
/// source  L. Henyey, J. Greenstein. Diffuse Radiation in the Galaxy. 1941
double phase_density(double anisotropy, double cosine);
/// `forward`: unit, the way of travel before.
Vec3d sample_phase(double anisotropy, const Vec3d& forward, glm::vec2 u);

/// Two unit vectors that make a right-handed basis with the unit vector n.
/// source  Duff et al. Building an Orthonormal Basis, Revisited. 2017
void basis_around(const Vec3d& n, Vec3d& a, Vec3d& b);

}  // namespace render
