/* Density 1 in an axis-parallel ellipsoid around the position. half_extent: its three radii.
 *
 * error   the ends of a span: a few u of the distance to the middle of the chord, and near grazing sqrt(u) of a radius
 * source  Eric Haines, Johannes Guenther, Tomas Akenine-Moeller. Precision Improvements for Ray/Sphere Intersection.
 *         2019: the discriminant from the perpendicular, here in the space where the ellipsoid is the unit sphere
 */
#ifndef LOAM_WORLD_MEDIA_ELLIPSOID_FOG_SHARED_H
#define LOAM_WORLD_MEDIA_ELLIPSOID_FOG_SHARED_H
#include "world/media/medium.shared.h"

SHARED_NAMESPACE(world)

SHARED_CONST uint ellipsoid_fog_keys = kMediumPosition | kMediumHalfExtent;

SHARED real2 ellipsoid_fog_span(SHARED_IN(MediumShape) m, real3 origin, real3 direction) {
  real3 o = origin / m.half_extent, d = direction / m.half_extent;
  real a = dot(d, d);
  real middle = -dot(o, d) / a;
  real3 nearest = o + middle * d;
  /* Once more from there: takes back what rounding moved it along the line. */
  real rest = -dot(nearest, d) / a;
  nearest += rest * d;
  middle += rest;
  real distance = length(nearest);
  real discriminant = (1.0 - distance) * (1.0 + distance);
  if (!(discriminant > 0.0)) return medium_nowhere();
  real half_chord = sqrt(discriminant / a);
  return real2(middle - half_chord, middle + half_chord);
}
SHARED real ellipsoid_fog_density(SHARED_IN(MediumShape) m, real3 point) {
  real3 p = point / m.half_extent;
  return dot(p, p) <= 1.0 ? 1.0 : 0.0;
}
SHARED real ellipsoid_fog_depth(SHARED_IN(MediumShape), real3, real3, real t0, real t1) { return t1 - t0; }
SHARED real ellipsoid_fog_largest(SHARED_IN(MediumShape), real3, real3, real, real) { return 1.0; }
SHARED real ellipsoid_fog_reach(SHARED_IN(MediumShape), real3, real3, real t0, real depth) { return t0 + depth; }

SHARED_NAMESPACE_END

#endif
