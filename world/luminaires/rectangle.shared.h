/* Rectangle: a Lambertian panel that emits from the side that its axis leaves; centred on its position.
 *
 *   L = Phi / (pi A),   M = L cos(theta_light) A / r^2 for a uniform point,   M = L Omega for a uniform direction
 * Directions are drawn uniformly from the solid angle Omega that the rectangle covers, so that M never exceeds
 * 2 pi L however near the receiver is (next to a wall that meets its edge: pi L); uniform points (uniform_area, the
 * chapter's randomPoint) are cheaper and have no such bound. Below kSmallestSolidAngle both are the same, and points
 * are drawn.
 * error   of Omega: absolute 4e-15 sr, so relative 4e-7 at worst. In the panel's own plane and behind it exactly 0.
 * source  chapter 14.11.4; Urena, Fajardo, King. An Area-Preserving Parametrization for Spherical Rectangles. 2013.
 *         Ours: corner angles by atan2 instead of acos, which loses half of the digits at grazing angles. */
#ifndef LOAM_RECTANGLE_SHARED_H
#define LOAM_RECTANGLE_SHARED_H
#include "world/luminaires/emitter.shared.h"

SHARED_NAMESPACE(world)

SHARED uint rectangle_keys() {
  return kKeyPlace | kKeyAxis | kKeyUp | kKeyPower | kKeyRadiance | kKeyExtent | kKeySampling;
}
SHARED real rectangle_area(SHARED_IN(Emitter) e) { return e.extent.x * e.extent.y; }
SHARED real rectangle_power(SHARED_IN(Emitter)) { return 1.0; }

/* A rectangle [low, high] in the plane z = -height, seen from 0; height > 0. */
struct SphericalRectangle {
  real2 low, high;
  real height;
  real solid_angle;
  real g2, g3; /* corner angles at (low.x, high.y) and (low.x, low.y) */
};

/* Angle at the corner (x, y) between the planes through 0 and its two edges, whose inward directions make the product's
 * sign. */
SHARED real corner_angle(real x, real y, real height, real product) {
  return atan(height * sqrt(x * x + y * y + height * height), product);
}

SHARED SphericalRectangle spherical_rectangle(real2 low, real2 high, real height) {
  SphericalRectangle q;
  q.low = low;
  q.high = high;
  q.height = height;
  q.g2 = corner_angle(low.x, high.y, height, low.x * high.y);
  q.g3 = corner_angle(low.x, low.y, height, -low.x * low.y);
  real g0 = corner_angle(high.x, low.y, height, high.x * low.y);
  real g1 = corner_angle(high.x, high.y, height, -high.x * high.y);
  q.solid_angle = max(g0 + g1 + q.g2 + q.g3 - 2.0 * kEmitterPi, 0.0);
  return q;
}

/* The point of the plane, in its coordinates, such that its direction is uniform in the solid angle. */
SHARED real2 spherical_rectangle_point(SphericalRectangle q, real2 u) {
  real z = -q.height, z2 = z * z;
  /* The column that splits the solid angle at u.x. */
  real b0 = -q.low.y / sqrt(z2 + q.low.y * q.low.y), b1 = q.high.y / sqrt(z2 + q.high.y * q.high.y);
  real a = u.x * q.solid_angle + 2.0 * kEmitterPi - q.g2 - q.g3;
  /* With f = across / sine: c = sign(f) / sqrt(f^2 + b0^2), where both may be 0. */
  real sine = sin(a), across_column = cos(a) * b0 - b1;
  real root = sqrt(across_column * across_column + b0 * b0 * sine * sine);
  real c = root > 0.0 ? clamp((across_column > 0.0 ? sine : -sine) / root, -1.0, 1.0) : real(0.0);
  real x = clamp(-c * z / max(root_or_zero(1.0 - c * c), 1e-30), q.low.x, q.high.x);
  /* On that column, evenly in the sine of the elevation. */
  real d2 = x * x + z2;
  real h0 = q.low.y / sqrt(d2 + q.low.y * q.low.y), h1 = q.high.y / sqrt(d2 + q.high.y * q.high.y);
  real h = h0 + u.y * (h1 - h0);
  real y = h * h < 1.0 ? h * sqrt(d2 / (1.0 - h * h)) : q.high.y;
  return real2(x, clamp(y, q.low.y, q.high.y));
}

SHARED SphericalRectangle rectangle_seen_from(SHARED_IN(Emitter) e, real2 extent, real3 receiver) {
  real2 at = real2(dot(receiver, e.right), dot(receiver, e.up));
  return spherical_rectangle(-0.5 * extent - at, 0.5 * extent - at, dot(receiver, e.axis));
}

SHARED EmitterSample rectangle_sample(SHARED_IN(Emitter) e, real3 receiver, real2 u) {
  real height = dot(receiver, e.axis), area = rectangle_area(e);
  if (!(height > kSmallestHeight)) return dark_sample(e, receiver);
  if (e.uniform_area == 0u) {
    SphericalRectangle q = rectangle_seen_from(e, e.extent, receiver);
    if (q.solid_angle > kSmallestSolidAngle) {
      real2 p = spherical_rectangle_point(q, u);
      real3 to_point = p.x * e.right + p.y * e.up - height * e.axis;
      return emitter_sample(direction_or(to_point, -e.axis), length(to_point), q.solid_angle / (kEmitterPi * area),
                            1.0 / q.solid_angle);
    }
  }
  real2 p = (u - 0.5) * e.extent;
  return sample_of_area(p.x * e.right + p.y * e.up - receiver, e.axis, area);
}

SHARED EmitterHit rectangle_meet(SHARED_IN(Emitter) e, real3 origin, real3 direction) {
  real height = dot(origin, e.axis), cosine = -dot(direction, e.axis), area = rectangle_area(e);
  if (!(height > kSmallestHeight && cosine > 0.0)) return no_emitter_hit();
  real t = height / cosine;
  real3 hit = origin + t * direction;
  if (!(2.0 * abs(dot(hit, e.right)) <= e.extent.x && 2.0 * abs(dot(hit, e.up)) <= e.extent.y)) return no_emitter_hit();
  real pdf = t * t / (cosine * area);
  if (e.uniform_area == 0u) {
    real solid_angle = rectangle_seen_from(e, e.extent, origin).solid_angle;
    if (solid_angle > kSmallestSolidAngle) pdf = 1.0 / solid_angle;
  }
  return emitter_hit(t, 1.0 / (kEmitterPi * area), pdf);
}

SHARED EmitterPhoton rectangle_emit(SHARED_IN(Emitter) e, real2 u, real2 v, real3, real) {
  real2 p = (u - 0.5) * e.extent;
  return emitter_photon(p.x * e.right + p.y * e.up, cosine_direction(e.axis, v), 1.0);
}

SHARED_NAMESPACE_END
#endif
