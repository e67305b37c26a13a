/* Sphere: a Lambertian ball, the accurate form of an omni.
 *
 *   L = Phi / (pi A) = Phi / (4 pi^2 R^2);   wholly above the horizon E = pi L (R / d)^2 cos(theta), as of an omni
 * Directions are drawn uniformly from the cone that it covers, sin(half angle) = R / d, so M = L 4 pi sin^2(half/2) has
 * no noise of its own. Whoever is inside sees its radiance all around; Phi is what leaves it outwards.
 * error   of the cone: relative 7e-16 at any distance (1 - cos of a small angle would cancel)
 * source  chapter 14.11.6 names it; Pharr, Jakob, Humphreys. Physically Based Rendering, 4th edition. 2023, section
 *         6.2.4; hard cases L2 to L4 */
#ifndef LOAM_SPHERE_SHARED_H
#define LOAM_SPHERE_SHARED_H
#include "world/luminaires/emitter.shared.h"

SHARED_NAMESPACE(world)

SHARED uint sphere_keys() { return kKeyPlace | kKeyPower | kKeyRadiance | kKeyRadius; }
SHARED real sphere_area(SHARED_IN(Emitter) e) { return 4.0 * kEmitterPi * e.radius * e.radius; }
SHARED real sphere_power(SHARED_IN(Emitter)) { return 1.0; }

/* sin^2(half angle / 2) of the cone that it covers from the distance d: 1 inside, 1/2 on it. */
SHARED real sphere_cone(SHARED_IN(Emitter) e, real d) {
  if (d < e.radius) return 1.0;
  real sine = min(e.radius / d, 1.0), cosine = root_or_zero((d - e.radius) * (d + e.radius)) / d;
  return 0.5 * sine * sine / (1.0 + cosine);
}

/* Distance to it along a direction that makes the angle with that to its centre; the nearest point where rounding lets
 * the ray pass by. */
SHARED real sphere_distance(SHARED_IN(Emitter) e, real d, real cosine, real sine_square) {
  real root = root_or_zero(e.radius * e.radius - d * d * sine_square);
  return max(d < e.radius ? d * cosine + root : d * cosine - root, 0.0);
}

SHARED EmitterSample sphere_sample(SHARED_IN(Emitter) e, real3 receiver, real2 u) {
  real d = length(receiver), k = sphere_cone(e, d);
  real3 to_centre = direction_or(-receiver, real3(0.0, 1.0, 0.0));
  real3 direction = cone_direction(to_centre, k, u);
  real s = k * u.x;
  real distance = sphere_distance(e, d, 1.0 - 2.0 * s, 4.0 * s * (1.0 - s));
  real solid_angle = 4.0 * kEmitterPi * k;
  return emitter_sample(direction, distance, solid_angle / (kEmitterPi * sphere_area(e)), 1.0 / solid_angle);
}

SHARED EmitterHit sphere_meet(SHARED_IN(Emitter) e, real3 origin, real3 direction) {
  real d = length(origin), along = -dot(origin, direction);
  real3 offset = origin + along * direction; /* the ray's point nearest to the centre; exact where it grazes */
  real square = dot(offset, offset);
  if (!(square <= e.radius * e.radius) || (d >= e.radius && !(along > 0.0))) return no_emitter_hit();
  real root = root_or_zero(e.radius * e.radius - square);
  real t = max(d < e.radius ? along + root : along - root, 0.0);
  return emitter_hit(t, 1.0 / (kEmitterPi * sphere_area(e)), 1.0 / (4.0 * kEmitterPi * sphere_cone(e, d)));
}

SHARED EmitterPhoton sphere_emit(SHARED_IN(Emitter) e, real2 u, real2 v, real3, real) {
  real3 normal = sphere_direction(u);
  return emitter_photon(e.radius * normal, cosine_direction(normal, v), 1.0);
}

SHARED_NAMESPACE_END
#endif
