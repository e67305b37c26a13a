/* A sheet too thin to see its inside: a clear or coloured pane, a leaf, cloth. Light that isn't scattered passes
 * straight on, or is mirrored by both faces of the sheet; how often it goes to and fro between them is summed up.
 *
 * A share k_L of the light meets pigment, which scatters it as a matte surface does, to the side it came from. The rest
 * meets a pane with Fresnel's reflectance R at each face, inside which each crossing leaves a = t / (1 - k_L) of it:
 *
 *   mirrored  (1 - k_L) (R + a^2 R (1 - R)^2 / (1 - a^2 R^2))      which is 2 R / (1 + R)       where a is 1
 *   passed    (1 - k_L) a (1 - R)^2 / (1 - a^2 R^2)                which is (1 - R) / (1 + R)   where a is 1
 *
 * So where the indices match, exactly t passes, as in 14.10.3's blending; and nothing is ever gained.
 *
 * reads   lambertian; transmission; eta: the sheet's index of refraction over that of the medium on both sides
 * error   magnitudes 5e-7. What the model leaves out: the sheet's thickness (the path is not shifted, a depends on no
 *         angle) and interference.
 * source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.10.3;
 *         George Stokes. On the Intensity of the Light Reflected from or Transmitted through a Pile of Plates. 1862
 */
#ifndef LOAM_RENDER_BSDF_THIN_SHARED_H
#define LOAM_RENDER_BSDF_THIN_SHARED_H
#include "render/bsdf/directions.shared.h"
#include "render/bsdf/fresnel.shared.h"
#include "render/bsdf/lambert.shared.h"

SHARED_NAMESPACE(render)

struct ThinShares {
  vec3 mirrored, passed;
};

/* w on n's side. */
SHARED ThinShares thin_shares(SHARED_IN(BsdfParameters) p, vec3 w, vec3 n) {
  float r = fresnel_reflectance(min(dot(n, w), 1.0f), p.eta);
  vec3 clear = vec3(1.0f) - p.lambertian;
  vec3 a = min(p.transmission / max(clear, vec3(1e-6f)), vec3(1.0f));
  ThinShares shares;
  if (!(r < 1.0f)) { /* else 0 / 0 where a is 1 */
    shares.mirrored = clear;
    shares.passed = vec3(0.0f);
    return shares;
  }
  vec3 once = a * ((1.0f - r) * (1.0f - r)) / ((vec3(1.0f) - a * r) * (vec3(1.0f) + a * r));
  shares.mirrored = clear * (vec3(r) + a * r * once);
  shares.passed = clear * once;
  return shares;
}

SHARED vec3 thin_finite_density(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 wo, vec3 n) {
  return lambert_finite_density(p, wi, wo, n);
}

SHARED Impulses thin_incoming_impulses(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n) {
  if (!(dot(n, wo) >= 0.0f)) return no_impulses();
  ThinShares shares = thin_shares(p, wo, n);
  return with_impulse(with_impulse(no_impulses(), reflected_direction(wo, n), shares.mirrored), -wo, shares.passed);
}
SHARED Impulses thin_outgoing_impulses(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) {
  return thin_incoming_impulses(p, wi, n);
}

/* Each way is chosen in proportion to the mean of its bands. */
SHARED float thin_pdf(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 wo, vec3 n) {
  if (!reflects(wi, wo, n)) return 0.0f;
  ThinShares shares = thin_shares(p, wo, n);
  float matte = mean_band(p.lambertian), all = matte + mean_band(shares.mirrored + shares.passed);
  return all > 0.0f ? matte / all * lambert_pdf(p, wi, wo, n) : 0.0f;
}

SHARED BsdfSample thin_scatter_in(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n, vec3 u) {
  if (!(dot(n, wo) >= 0.0f)) return absorbed_sample();
  ThinShares shares = thin_shares(p, wo, n);
  float matte = mean_band(p.lambertian), mirrored = mean_band(shares.mirrored), passed = mean_band(shares.passed);
  float all = matte + (mirrored + passed);
  if (!(all > 0.0f)) return absorbed_sample();
  float at = u.z * all;
  if (at < passed) return impulse_sample(-wo, shares.passed * (all / passed));
  if (at < passed + mirrored) return impulse_sample(reflected_direction(wo, n), shares.mirrored * (all / mirrored));
  BsdfSample drawn = lambert_scatter_in(p, wo, n, u);
  if (!(matte > 0.0f)) return absorbed_sample(); /* at = all, by rounding */
  drawn.weight *= all / matte;
  drawn.pdf *= matte / all;
  return drawn;
}
SHARED BsdfSample thin_scatter_out(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n, vec3 u) {
  return thin_scatter_in(p, wi, n, u);
}

SHARED vec3 thin_probability_in(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n) {
  if (!(dot(n, wo) >= 0.0f)) return vec3(0.0f);
  ThinShares shares = thin_shares(p, wo, n);
  return lambert_probability_in(p, wo, n) + shares.mirrored + shares.passed;
}
SHARED vec3 thin_probability_out(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) { return thin_probability_in(p, wi, n); }

SHARED_NAMESPACE_END

#endif
