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

SHARED Real2 ellipsoid_fog_span(SHARED_IN(MediumShape) m, Real3 origin, Real3 direction) {
  Real3 o = origin / m.half_extent, d = direction / m.half_extent;
  Real a = dot(d, d);
  Real middle = -dot(o, d) / a;
  Real3 nearest = o + middle * d;
  /* Once more from there: takes back what rounding moved it along the line. */
  Real rest = -dot(nearest, d) / a;
  nearest += rest * d;
  middle += rest;
  Real distance = length(nearest);
  Real discriminant = (1.0 - distance) * (1.0 + distance);
  if (!(discriminant > 0.0)) return medium_nowhere();
  Real half_chord = sqrt(discriminant / a);
  return Real2(middle - half_chord, middle + half_chord);
}
SHARED Real ellipsoid_fog_density(SHARED_IN(MediumShape) m, Real3 point) {
  Real3 p = point / m.half_extent;
  return dot(p, p) <= 1.0 ? 1.0 : 0.0;
}
SHARED Real ellipsoid_fog_depth(SHARED_IN(MediumShape), Real3, Real3, Real t0, Real t1) { return t1 - t0; }
SHARED Real ellipsoid_fog_largest(SHARED_IN(MediumShape), Real3, Real3, Real, Real) { return 1.0; }
SHARED Real ellipsoid_fog_reach(SHARED_IN(MediumShape), Real3, Real3, Real t0, Real depth) { return t0 + depth; }

SHARED_NAMESPACE_END

#endif
