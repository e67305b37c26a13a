/* What every kind of luminaire answers, and the geometry that several of them need. Not a kind itself.
 *
 * An Emitter is a luminaire without its colour: shape, frame and directional profile. Positions are relative to the
 * luminaire's own. <kind>.shared.h defines five functions and its keys, which sampler.cpp and a shader list by name:
 *
 *   uint            <kind>_keys()                          what a scene may say of it, and which colour scales it
 *   real            <kind>_area(e)                         m^2; 0: a point, kAtInfinity: at no place
 *   real            <kind>_power(e)                        W of its colour's unit; kAtInfinity at no place
 *   EmitterSample   <kind>_sample(e, receiver, u)          a point of it, seen from the receiver
 *   EmitterHit      <kind>_meet(e, origin, direction)      distance < 0: the ray does not meet its emitting side
 *   EmitterPhoton   <kind>_emit(e, u, v, centre, radius)   one photon; the sphere (centre, radius) is the scene
 *
 * Answers are for a colour of 1: 1 W where its keys have kKeyPower, 1 W/m^2 for kKeyIrradiance, else 1 W/(m^2 sr).
 * Random numbers u and v are in [0, 1); receivers and origins are finite; directions have length 1.
 * error   real is double in C++, float in GLSL. Bounds are stated by kind, for double.
 * fails   never: no answer is NaN or negative; where nothing arrives, biradiance is 0.
 * source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.11 */
#ifndef LOAM_EMITTER_SHARED_H
#define LOAM_EMITTER_SHARED_H
#include "world/base/shared.h"

#ifdef __cplusplus
#include <limits>

#include <glm/trigonometric.hpp>
SHARED_NAMESPACE(world)
using real = double;
using real2 = glm::dvec2;
using real3 = glm::dvec3;
SHARED_CONST real kAtInfinity = std::numeric_limits<double>::infinity();
SHARED_CONST real kSmallestSquare = 1e-300, kLargestSquare = 1e300; /* of a length that can be normalized */
SHARED_CONST real kSmallestHeight = 1e-140;                         /* m over a panel; below, its square is lost */
SHARED_CONST real kSmallestSolidAngle = 1e-8; /* below, a sum of four angles less 2 pi has lost 4e-7 of itself */
SHARED_CONST real kEmitterPi = 3.14159265358979323846;
#else
#define real float
#define real2 vec2
#define real3 vec3
const float kAtInfinity = 3e38;
const float kSmallestSquare = 1e-36, kLargestSquare = 1e36;
const float kSmallestHeight = 1e-17;
const float kSmallestSolidAngle = 3e-3;
const float kEmitterPi = 3.14159265;
#endif

/* Keys of a [[luminaire]]; luminaire.cpp says their units and ranges. */
SHARED_CONST uint kKeyPlace = 1u;          /* position */
SHARED_CONST uint kKeyAxis = 2u;           /* direction or look_at */
SHARED_CONST uint kKeyUp = 4u;             /* up */
SHARED_CONST uint kKeyPower = 8u;          /* power_w */
SHARED_CONST uint kKeyIrradiance = 16u;    /* irradiance */
SHARED_CONST uint kKeyRadiance = 32u;      /* radiance: instead of power_w where the kind has both */
SHARED_CONST uint kKeyExtent = 64u;        /* size */
SHARED_CONST uint kKeyRadius = 128u;       /* radius_m, of an emitter that has this size */
SHARED_CONST uint kKeyClamp = 256u;        /* radius_m, nearer than which a point's light grows no further */
SHARED_CONST uint kKeyCone = 512u;         /* half_angle_deg */
SHARED_CONST uint kKeySoftEdge = 1024u;    /* inner_half_angle_deg */
SHARED_CONST uint kKeyAttenuation = 2048u; /* attenuation, at_infinity */
SHARED_CONST uint kKeySlide = 4096u;       /* image, required: projected along the axis */
SHARED_CONST uint kKeySky = 8192u;         /* image, whole_sphere: equirectangular */
SHARED_CONST uint kKeySampling = 16384u;   /* sampling */
SHARED_CONST uint kKeyFile = 32768u;       /* file: triangles, each an Emitter of its own */

struct Emitter {
  real3 axis, up, right; /* orthonormal: where it emits to (a sky: its pole); right = cross(up, axis) */
  real2 extent;          /* m: rectangle, along right and up */
  real radius;           /* m, > 0: disk, sphere, and the clamp of points */
  real cone, inner_cone; /* sin^2(half angle / 2): solid angle over 4 pi; inner_cone <= cone */
  real tan_half_angle;   /* slide */
  real3 attenuation;
  real3 corner, edge1, edge2; /* triangle: corner, corner + edge1, corner + edge2 counter-clockwise from the front */
  uint at_infinity, whole_sphere, uniform_area; /* 0 or 1 */
};

struct EmitterSample {
  real3 direction; /* unit, from the receiver */
  real distance;   /* m; kAtInfinity: at no place */
  real biradiance; /* radiance / pdf, or of an impulse what it sends onto a plane that faces it */
  real pdf;        /* of direction, 1/sr; 0: an impulse, or biradiance is 0 */
};

struct EmitterHit {
  real distance;
  real radiance;
  real pdf;
};

struct EmitterPhoton {
  real3 origin, direction;
  real power;
};

SHARED EmitterSample emitter_sample(real3 direction, real distance, real biradiance, real pdf) {
  EmitterSample s;
  s.direction = direction;
  s.distance = distance;
  s.biradiance = biradiance;
  s.pdf = pdf;
  return s;
}
SHARED EmitterHit emitter_hit(real distance, real radiance, real pdf) {
  EmitterHit h;
  h.distance = distance;
  h.radiance = radiance;
  h.pdf = pdf;
  return h;
}
SHARED EmitterHit no_emitter_hit() { return emitter_hit(-1.0, 0.0, 0.0); }
SHARED EmitterPhoton emitter_photon(real3 origin, real3 direction, real power) {
  EmitterPhoton p;
  p.origin = origin;
  p.direction = direction;
  p.power = power;
  return p;
}

/* v over its length; `otherwise` where that is 0 or not a number. */
SHARED real3 direction_or(real3 v, real3 otherwise) {
  real square = dot(v, v);
  if (!(square > kSmallestSquare && square < kLargestSquare)) return otherwise;
  return v / sqrt(square);
}
SHARED real root_or_zero(real square) { return square > 0.0 ? sqrt(square) : real(0.0); }

/* Nothing arrives from the luminaire's own place. */
SHARED EmitterSample dark_sample(SHARED_IN(Emitter) e, real3 receiver) {
  return emitter_sample(direction_or(-receiver, -e.axis), length(receiver), 0.0, 0.0);
}

/* Uniform on the disk of radius 1; neighbours stay neighbours. source: Shirley, Chiu. A Low Distortion Map Between Disk
 * and Square. 1997 */
SHARED real2 disk_point(real2 u) {
  real2 s = 2.0 * u - 1.0;
  if (s.x == 0.0 && s.y == 0.0) return s;
  real quarter = 0.25 * kEmitterPi;
  bool wide = abs(s.x) > abs(s.y);
  real r = wide ? s.x : s.y;
  real phi = wide ? quarter * (s.y / s.x) : quarter * (2.0 - s.x / s.y);
  return r * real2(cos(phi), sin(phi));
}

/* A unit vector across the unit vector n, without a jump but where n.z changes its sign. source: Duff and others.
 * Building an Orthonormal Basis, Revisited. 2017 */
SHARED real3 across(real3 n) {
  real s = n.z >= 0.0 ? 1.0 : -1.0;
  real a = -1.0 / (s + n.z);
  return real3(1.0 + s * n.x * n.x * a, s * n.x * n.y * a, -s * n.x);
}

/* Uniform in the cone around n that fills k = sin^2(half angle / 2) of the sphere: cosine = 1 - 2 s for s uniform in
 * [0, k], without the cancellation of 1 - cosine. */
SHARED real3 cone_direction(real3 n, real k, real2 u) {
  real s = k * u.x, phi = 2.0 * kEmitterPi * u.y;
  real sine = 2.0 * root_or_zero(s * (1.0 - s));
  real3 a = across(n);
  return normalize((1.0 - 2.0 * s) * n + sine * (cos(phi) * a + sin(phi) * cross(n, a)));
}
SHARED real3 sphere_direction(real2 u) { return cone_direction(real3(0.0, 1.0, 0.0), 1.0, u); }

/* Density cosine / pi around n: what a Lambertian emitter sends. */
SHARED real3 cosine_direction(real3 n, real2 u) {
  real2 d = disk_point(u);
  real3 a = across(n);
  return normalize(d.x * a + d.y * cross(n, a) + root_or_zero(1.0 - dot(d, d)) * n);
}

/* Where a photon that comes from infinity along `direction` enters the neighbourhood of the scene: uniform on the disk
 * that covers it. */
SHARED real3 distant_origin(real3 direction, real2 u, real3 centre, real radius) {
  real2 d = radius * disk_point(u);
  real3 a = across(direction);
  return centre - radius * direction + d.x * a + d.y * cross(direction, a);
}

/* The part of a cone's light that goes along `direction`: 1 within the inner cone, 0 beyond the cone, between them
 * 3 t^2 - 2 t^3 in the cosine, whose mean is 1/2. Equal cones give a hard edge; the full cone has no edge at all. */
SHARED real cone_profile(SHARED_IN(Emitter) e, real3 direction) {
  if (e.inner_cone >= 1.0) return 1.0;
  real3 chord = direction - e.axis;
  real s = 0.25 * dot(chord, chord); /* sin^2(angle / 2): exact where the angle is small */
  if (!(s <= e.cone) || !(e.cone > 0.0)) return 0.0;
  if (s <= e.inner_cone) return 1.0;
  real t = (e.cone - s) / (e.cone - e.inner_cone);
  return t * t * (3.0 - 2.0 * t);
}

/* Biradiance of a Lambertian emitter of 1 W and the area A at a point towards which its normal makes the cosine:
 * M = L A cosine / r^2 with L = 1 / (pi A) (14.11.4), and the density of that direction if the point was uniform. */
SHARED EmitterSample sample_of_area(real3 to_point, real3 normal, real area) {
  real square = dot(to_point, to_point), r = sqrt(square);
  real3 direction = direction_or(to_point, -normal);
  real cosine = -dot(normal, direction);
  if (!(cosine > 0.0) || !(square > kSmallestSquare)) return emitter_sample(direction, r, 0.0, 0.0);
  return emitter_sample(direction, r, cosine / (kEmitterPi * square), square / (cosine * area));
}

SHARED_NAMESPACE_END
#endif
