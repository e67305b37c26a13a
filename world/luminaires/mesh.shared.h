/* Mesh: any number of triangles that are Lambertian emitters on the side from which their corners run
 * counter-clockwise.
 *
 *   L = Phi / (pi sum of areas): the same everywhere
 * The functions here are of one triangle with all of the power. sampler.cpp picks triangles by their area, so that
 * points are uniform on the whole. Near a triangle M has no bound: panels that touch walls are better rectangles.
 * source  chapter 14.11.4; hard cases L8, L9 */
#ifndef LOAM_MESH_SHARED_H
#define LOAM_MESH_SHARED_H
#include "world/luminaires/emitter.shared.h"

SHARED_NAMESPACE(world)

SHARED uint mesh_keys() { return kKeyPlace | kKeyPower | kKeyRadiance | kKeyFile; }
SHARED real mesh_area(SHARED_IN(Emitter) e) { return 0.5 * length(cross(e.edge1, e.edge2)); }
SHARED real mesh_power(SHARED_IN(Emitter)) { return 1.0; }

/* Uniform: a root maps the square to the triangle. */
SHARED real3 mesh_point(SHARED_IN(Emitter) e, real2 u) {
  real root = sqrt(u.x);
  return e.corner + root * (1.0 - u.y) * e.edge1 + root * u.y * e.edge2;
}

SHARED EmitterSample mesh_sample(SHARED_IN(Emitter) e, real3 receiver, real2 u) {
  return sample_of_area(mesh_point(e, u) - receiver, e.axis, mesh_area(e));
}

/* source: Moller, Trumbore. Fast, Minimum Storage Ray/Triangle Intersection. 1997 */
SHARED EmitterHit mesh_meet(SHARED_IN(Emitter) e, real3 origin, real3 direction) {
  real3 p = cross(direction, e.edge2);
  real determinant = dot(e.edge1, p); /* > 0 in front */
  if (!(determinant > 0.0)) return no_emitter_hit();
  real3 from_corner = origin - e.corner;
  real3 q = cross(from_corner, e.edge1);
  real b1 = dot(from_corner, p), b2 = dot(direction, q);
  if (!(b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= determinant)) return no_emitter_hit();
  real t = dot(e.edge2, q) / determinant;
  if (!(t > 0.0)) return no_emitter_hit();
  real area = mesh_area(e), cosine = determinant / (2.0 * area);
  return emitter_hit(t, 1.0 / (kEmitterPi * area), t * t / (cosine * area));
}

SHARED EmitterPhoton mesh_emit(SHARED_IN(Emitter) e, real2 u, real2 v, real3, real) {
  return emitter_photon(mesh_point(e, u), cosine_direction(e.axis, v), 1.0);
}

SHARED_NAMESPACE_END
#endif
