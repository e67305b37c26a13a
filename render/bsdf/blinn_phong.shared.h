/* A matte surface with a glossy highlight: normalized Blinn-Phong, about the half vector h = (wi + wo) / |wi + wo|.
 *
 *   f = k_L / pi + k_g c(s) (n . h)^s                          where both directions are on the normal's side, else 0
 *   kGlossPublished   c = (8 + s) / (8 pi)
 *   kGlossExact       c = (s + 2) (s + 4) / (8 pi (s + 2^(-s/2)))
 *   kGlossFresnel     f = k_L M(wi) M(wo) 28 / (23 pi) + F(w . h) c(s) (n . h)^s / ((w . h) max(n . wi, n . wo)),
 *                     M(w) = 1 - (1 - n . w / 2)^5,  F(x) = k_g + (1 - k_g) (1 - x)^5,  c = (s + 1) / (8 pi E(s))
 *
 * The published factor scatters more than arrives at normal incidence for every s > 0: k_g is exceeded by up to 7.52 %
 * (at s = 8.76), by over 5 % for s in 2.6 .. 28. The exact factor makes the lobe's albedo at normal incidence 1, and no
 * angle exceeds that. But seen from theta, both lobes fall to cos^2 theta as s grows: a quarter of the mirror that they
 * should become, at 60 degrees. The third lobe does become the mirror, with Fresnel's rise at grazing angles, and matte
 * light gives way to it. Its E is Loam's: the lobe's albedo at normal incidence, A = (s - 1 + 2^((1-s)/2)) / (s + 3),
 * joined to the 1/2 that it has at grazing angles, E = (A^8 + 2^-8)^(1/8), which bounds the albedo of all angles:
 * without it a rough metal (s = 8) would absorb a third of the light. Where all bands of k_g are below 0.02, which no
 * medium's reflectance is, the 1s of F and of M's effect fade towards plain k_g and k_L / pi.
 *
 * The chapter maps a "shininess" sigma in [0, 1] to s = 8192^(1 - sigma). Printed so, a larger sigma gives a smaller
 * exponent: a rougher surface, against the name and against its own "high numbers make sharper reflections". Loam
 * uses s = 8192^sigma: 0 is rough (s = 1), 1 is the smoothest (s = 8192).
 *
 * The listing returns 0 only where both directions are below the surface; one alone must do (light would leak through).
 *
 * reads   lambertian, glossy, smoothness, gloss
 * error   f: sqrt(s) 2^-22 + 2^-19 of itself (the directions' own rounding; a GPU's exp). The same bits if wi and wo
 *         are swapped. probability_in and _out: 4e-3, by 240 quadrature points, some 2 us each.
 * source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, listing 14.9;
 *         Fabian Giesen. Phong Normalization Factor Derivations. 2009 (exact factor);
 *         Michael Ashikhmin, Peter Shirley. An Anisotropic Phong BRDF Model. 2000 (kGlossFresnel, E aside);
 *         Sebastien Lagarde, Charles de Rousiers. Moving Frostbite to Physically Based Rendering. 2014 (below 0.02)
 */
#ifndef LOAM_RENDER_BSDF_BLINN_PHONG_SHARED_H
#define LOAM_RENDER_BSDF_BLINN_PHONG_SHARED_H
#include "render/bsdf/directions.shared.h"
#include "render/bsdf/lambert.shared.h"
#include "world/numbers/elementary.shared.h"

SHARED_NAMESPACE(render)
#ifdef __cplusplus
using world::shared::exp_minus_one, world::shared::log_one_minus;
#endif

/* s of sigma in [0, 1]: 8192^sigma. */
SHARED float smoothness_from_shininess(float shininess) { return exp2(13.0f * shininess); }

/* c(s) of the lobe. */
SHARED float gloss_factor(uint gloss, float s) {
  const float kEighth = 0.125f * kBsdfInversePi;
  if (gloss == kGlossPublished) return kEighth * (8.0f + s);
  if (gloss == kGlossExact) return kEighth * (s + 4.0f) * ((s + 2.0f) / (s + exp2(-0.5f * s)));
  float a = (s - 1.0f + exp2(0.5f - 0.5f * s)) / (s + 3.0f), a2 = a * a, a4 = a2 * a2;
  return kEighth * (s + 1.0f) / sqrt(sqrt(sqrt(a4 * a4 + 0.00390625f)));
}

SHARED float fifth_power(float x) { return x * x * (x * x) * x; }

/* How far Fresnel's rise at grazing angles counts, as F's 1 and in M. */
SHARED float gloss_rise(SHARED_IN(BsdfParameters) p) { return min(50.0f * largest_band(p.glossy), 1.0f); }

/* F(w . h) */
SHARED vec3 gloss_reflectance(SHARED_IN(BsdfParameters) p, float w_h) {
  return p.glossy + (vec3(gloss_rise(p)) - p.glossy) * fifth_power(1.0f - min(w_h, 1.0f));
}

/* The matte part of f, times pi; cosines in (0, 1]. */
SHARED vec3 matte_part(SHARED_IN(BsdfParameters) p, float n_i, float n_o) {
  if (p.gloss != kGlossFresnel) return p.lambertian;
  float rise = gloss_rise(p);
  float gives_way = (1.0f - fifth_power(1.0f - 0.5f * n_i)) * (1.0f - fifth_power(1.0f - 0.5f * n_o));
  return p.lambertian * (1.0f - rise + rise * (28.0f / 23.0f) * gives_way);
}

/* (n . h)^s and w . h, by the sine of the angle between n and h where that is small: the cosine would round the lobe's
 * slope away. Both directions on the normal's side. */
SHARED vec2 gloss_power_and_w_h(float s, vec3 wi, vec3 wo, vec3 n) {
  vec3 h = wi + wo, across = cross(n, h);
  float squared = dot(h, h), sine2 = dot(across, across) / squared, cosine = dot(n, h);
  float logarithm = sine2 <= 0.5f ? log_one_minus(sine2) : log(max(cosine * cosine / squared, 1e-30f));
  return vec2(exp(0.5f * s * logarithm), min(0.5f * sqrt(squared), 1.0f));
}

SHARED vec3 blinn_phong_finite_density(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 wo, vec3 n) {
  if (!reflects(wi, wo, n)) return vec3(0.0f);
  float n_i = dot(n, wi), n_o = dot(n, wo);
  vec2 lobe = gloss_power_and_w_h(p.smoothness, wi, wo, n);
  vec3 glossy = p.glossy;
  if (p.gloss == kGlossFresnel) glossy = gloss_reflectance(p, lobe.y) / (max(lobe.y, 1e-6f) * max(n_i, n_o));
  return matte_part(p, n_i, n_o) * kBsdfInversePi + glossy * (gloss_factor(p.gloss, p.smoothness) * lobe.x);
}

SHARED Impulses blinn_phong_incoming_impulses(SHARED_IN(BsdfParameters), vec3, vec3) { return no_impulses(); }
SHARED Impulses blinn_phong_outgoing_impulses(SHARED_IN(BsdfParameters), vec3, vec3) { return no_impulses(); }

/* The share of samples drawn by the cosine: of the matte part, and of lobes so wide that they are nearly matte. */
SHARED float cosine_share(SHARED_IN(BsdfParameters) p, float n_o) {
  float matte = mean_band(matte_part(p, 1.0f, n_o));
  float glossy = mean_band(p.gloss == kGlossFresnel ? gloss_reflectance(p, n_o) : p.glossy);
  float all = matte + glossy;
  return all > 0.0f ? (matte + glossy * (2.0f / (2.0f + p.smoothness))) / all : 1.0f;
}

SHARED float blinn_phong_pdf(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 wo, vec3 n) {
  if (!reflects(wi, wo, n)) return 0.0f;
  float share = cosine_share(p, min(dot(n, wo), 1.0f));
  vec2 lobe = gloss_power_and_w_h(p.smoothness, wi, wo, n);
  /* h has density (s + 1) / (2 pi) (n . h)^s; mirroring about it spreads the solid angle by 4 (w . h). */
  float glossy = (p.smoothness + 1.0f) * (0.125f * kBsdfInversePi) * lobe.x / max(lobe.y, 1e-6f);
  return share * kBsdfInversePi * dot(n, wi) + (1.0f - share) * glossy;
}

SHARED BsdfSample blinn_phong_scatter_in(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n, vec3 u) {
  if (!(dot(n, wo) > 0.0f)) return absorbed_sample();
  vec3 wi;
  if (u.z < cosine_share(p, min(dot(n, wo), 1.0f))) {
    wi = cosine_direction(n, vec2(u.x, u.y));
  } else {
    float logarithm = log_one_minus(u.x) / (p.smoothness + 1.0f); /* of n . h */
    float sine = sqrt(-exp_minus_one(2.0f * logarithm));
    vec3 h = about_normal(n, vec3(sine * cosine_sine_of_turn(u.y), exp(logarithm)));
    if (!(dot(h, wo) > 0.0f)) return absorbed_sample();
    wi = reflected_direction(wo, h);
  }
  float pdf = blinn_phong_pdf(p, wi, wo, n);
  if (!(pdf > 0.0f)) return absorbed_sample();
  return finite_sample(wi, blinn_phong_finite_density(p, wi, wo, n) * (dot(n, wi) / pdf), pdf);
}
SHARED BsdfSample blinn_phong_scatter_out(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n, vec3 u) {
  return blinn_phong_scatter_in(p, wi, n, u);
}

/* The lobe has no closed form away from normal incidence: a quadrature over half vectors, 24 steps of the polar angle
 * by 10 of the azimuth, up to where wi would lie below the surface, and closer together there. */
SHARED vec3 blinn_phong_probability_in(SHARED_IN(BsdfParameters) p, vec3 wo, vec3 n) {
  float n_o = min(dot(n, wo), 1.0f);
  if (!(n_o > 0.0f)) return vec3(0.0f);
  const int kPolar = 24, kAzimuths = 10;
  float s = p.smoothness, sine_o = sqrt(max(1.0f - n_o * n_o, 0.0f)), lobe = 0.0f, rise = 0.0f;
  for (int i = 0; i < kPolar; ++i) {
    float logarithm = log_one_minus((float(i) + 0.5f) / float(kPolar)) / (s + 1.0f);
    float n_h = exp(logarithm), sine_h = sqrt(-exp_minus_one(2.0f * logarithm));
    /* n . wi = 2 (w . h) (n . h) - n . wo is 0 where the cosine of the azimuth is `horizon` / `swing`. */
    float horizon = n_o * (1.0f - 2.0f * n_h * n_h), swing = 2.0f * n_h * sine_o * sine_h;
    if (horizon >= swing) continue;
    float end = horizon <= -swing ? 0.5f : acos(horizon / swing) * (0.5f * kBsdfInversePi); /* turns */
    for (int j = 0; j < kAzimuths; ++j) {
      float x = (float(j) + 0.5f) / float(kAzimuths);
      float w_h = n_o * n_h + sine_o * sine_h * cosine_sine_of_turn(end * x * (2.0f - x)).x;
      float n_i = max(2.0f * w_h * n_h - n_o, 0.0f);
      float part = 4.0f * end * (1.0f - x) * n_i * (p.gloss == kGlossFresnel ? 1.0f / max(n_i, n_o) : w_h);
      lobe += part;
      rise += part * fifth_power(1.0f - clamp(w_h, 0.0f, 1.0f));
    }
  }
  float scale = gloss_factor(p.gloss, s) * 8.0f * kBsdfPi / ((s + 1.0f) * float(kPolar * kAzimuths));
  if (p.gloss != kGlossFresnel) return p.lambertian + p.glossy * (scale * lobe);
  /* The integral of 28 / (23 pi) M(wi) cos is 1. */
  float gives_way = mix(1.0f, 1.0f - fifth_power(1.0f - 0.5f * n_o), gloss_rise(p));
  return p.lambertian * gives_way + p.glossy * (scale * lobe) + (vec3(gloss_rise(p)) - p.glossy) * (scale * rise);
}
SHARED vec3 blinn_phong_probability_out(SHARED_IN(BsdfParameters) p, vec3 wi, vec3 n) {
  return blinn_phong_probability_in(p, wi, n);
}

SHARED_NAMESPACE_END

#endif
