/* Disk: a round Lambertian panel that emits from the side that its axis leaves.
 *
 *   L = Phi / (pi A),   A = pi radius^2;   on the axis E = pi L radius^2 / (radius^2 + height^2)
 * A receiver a radius or more away from all of it samples uniform points: M = L cos(theta_light) A / r^2 <= pi L.
 * Nearer, uniform directions of the square around the disk, of which those beside the disk bring nothing: M <= 2 pi L,
 * where points would give any value. With uniform_area always points.
 *
 * source  chapter 14.11.4. A map of the disk itself (Guillen and others. Area-Preserving Parameterizations for
 * Spherical Ellipses. 2017) needs an elliptic integral inverted for each sample. */
#ifndef LOAM_DISK_SHARED_H
#define LOAM_DISK_SHARED_H
#include "world/luminaires/rectangle.shared.h"

SHARED_NAMESPACE(world)

SHARED uint disk_keys() { return kKeyPlace | kKeyAxis | kKeyPower | kKeyRadiance | kKeyRadius | kKeySampling; }
SHARED real disk_area(SHARED_IN(Emitter) e) { return kEmitterPi * e.radius * e.radius; }
SHARED real disk_power(SHARED_IN(Emitter)) { return 1.0; }

/* Of the square around the disk where its directions are sampled; 0 where points are. */
SHARED SphericalRectangle disk_square(SHARED_IN(Emitter) e, real3 receiver) {
  SphericalRectangle q = rectangle_seen_from(e, real2(2.0 * e.radius), receiver);
  real height = q.height;
  real beside = max(length(receiver - height * e.axis) - e.radius, 0.0);
  bool near = e.uniform_area == 0u && height * height + beside * beside < e.radius * e.radius;
  if (!near || !(q.solid_angle > kSmallestSolidAngle)) q.solid_angle = 0.0;
  return q;
}

SHARED EmitterSample disk_sample(SHARED_IN(Emitter) e, real3 receiver, real2 u) {
  real height = dot(receiver, e.axis), area = disk_area(e);
  if (!(height > kSmallestHeight)) return dark_sample(e, receiver);
  SphericalRectangle q = disk_square(e, receiver);
  if (q.solid_angle > 0.0) {
    real2 p = spherical_rectangle_point(q, u);
    real3 to_point = p.x * e.right + p.y * e.up - height * e.axis;
    real3 point = receiver + to_point;
    real in_plane = length(point - dot(point, e.axis) * e.axis);
    real inside = in_plane <= e.radius ? 1.0 : 0.0;
    return emitter_sample(direction_or(to_point, -e.axis), length(to_point),
                          inside * q.solid_angle / (kEmitterPi * area), 1.0 / q.solid_angle);
  }
  real2 p = e.radius * disk_point(u);
  return sample_of_area(p.x * e.right + p.y * e.up - receiver, e.axis, area);
}

SHARED EmitterHit disk_meet(SHARED_IN(Emitter) e, real3 origin, real3 direction) {
  real height = dot(origin, e.axis), cosine = -dot(direction, e.axis), area = disk_area(e);
  if (!(height > kSmallestHeight && cosine > 0.0)) return no_emitter_hit();
  real t = height / cosine;
  if (!(length(origin + t * direction) <= e.radius)) return no_emitter_hit();
  real solid_angle = disk_square(e, origin).solid_angle;
  return emitter_hit(t, 1.0 / (kEmitterPi * area), solid_angle > 0.0 ? 1.0 / solid_angle : t * t / (cosine * area));
}

SHARED EmitterPhoton disk_emit(SHARED_IN(Emitter) e, real2 u, real2 v, real3, real) {
  real2 p = e.radius * disk_point(u);
  return emitter_photon(p.x * e.right + p.y * e.up, cosine_direction(e.axis, v), 1.0);
}

SHARED_NAMESPACE_END
#endif
