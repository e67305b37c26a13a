/* What the BSDFs are told, one record for all members (each reads the fields that its file names), and what they
 * answer. */
#ifndef LOAM_RENDER_BSDF_PARAMETERS_SHARED_H
#define LOAM_RENDER_BSDF_PARAMETERS_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(render)

/* The glossy lobe: one of the formulas in blinn_phong.shared.h. */
SHARED_CONST uint kGlossExact = 0u;
SHARED_CONST uint kGlossPublished = 1u;
SHARED_CONST uint kGlossFresnel = 2u;

struct BsdfParameters {
  vec3 lambertian SHARED_INIT(vec3(0));   /* k_L, (0, 1) by band: probability of matte scattering */
  float smoothness SHARED_INIT(0);        /* s, 0 .. 1e12, the exponent of a glossy lobe */
  vec3 glossy SHARED_INIT(vec3(0));       /* k_g, by band; k_L + k_g <= 1 */
  float eta SHARED_INIT(1);               /* index of refraction beyond the surface over that on this side, 0.1 .. 10 */
  vec3 transmission SHARED_INIT(vec3(0)); /* t, by band: passes straight through a thin surface; k_L + t <= 1 */
  float coverage SHARED_INIT(1);          /* alpha, [0, 1]: the part of the surface that is there */
  vec3 emission SHARED_INIT(vec3(0));     /* W/(m^2 sr) that the surface sends out */
  uint gloss SHARED_INIT(0u);             /* which glossy lobe: kGloss... */
};

struct Impulse {
  vec3 direction SHARED_INIT(vec3(0));
  vec3 magnitude SHARED_INIT(vec3(0)); /* of the radiance (incoming) or power (outgoing) that goes this way, by band */
};

struct Impulses {
  int count SHARED_INIT(0);
  Impulse impulse[2];
};

struct BsdfSample {
  vec3 direction SHARED_INIT(vec3(0));
  vec3 weight SHARED_INIT(vec3(0)); /* finite: f |cos| / pdf; impulse: magnitude / probability of this choice;
                                       0: absorbed, and the direction may be 0 too */
  float pdf SHARED_INIT(0);         /* of the finite part's direction, 1/sr; 0 for an impulse */
  bool impulse SHARED_INIT(false);
};

SHARED Impulses no_impulses() {
  Impulses none;
  none.count = 0;
  for (int i = 0; i < 2; ++i) none.impulse[i].direction = none.impulse[i].magnitude = vec3(0.0f);
  return none;
}

/* With one more; none where the magnitude is 0. At most two. */
SHARED Impulses with_impulse(Impulses impulses, vec3 direction, vec3 magnitude) {
  if (max(max(magnitude.x, magnitude.y), magnitude.z) > 0.0f) {
    impulses.impulse[impulses.count].direction = direction;
    impulses.impulse[impulses.count].magnitude = magnitude;
    ++impulses.count;
  }
  return impulses;
}

SHARED BsdfSample absorbed_sample() {
  BsdfSample none;
  none.direction = none.weight = vec3(0.0f);
  none.pdf = 0.0f;
  none.impulse = false;
  return none;
}

SHARED BsdfSample impulse_sample(vec3 direction, vec3 weight) {
  BsdfSample drawn;
  drawn.direction = direction;
  drawn.weight = weight;
  drawn.pdf = 0.0f;
  drawn.impulse = true;
  return drawn;
}

SHARED BsdfSample finite_sample(vec3 direction, vec3 weight, float pdf) {
  BsdfSample drawn;
  drawn.direction = direction;
  drawn.weight = weight;
  drawn.pdf = pdf;
  drawn.impulse = false;
  return drawn;
}

SHARED_NAMESPACE_END

#endif
