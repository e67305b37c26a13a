/* Density 1 below a plane through the position. normal: unit, out of the medium. */
#ifndef LOAM_WORLD_MEDIA_HALFSPACE_FOG_SHARED_H
#define LOAM_WORLD_MEDIA_HALFSPACE_FOG_SHARED_H
#include "world/media/medium.shared.h"

SHARED_NAMESPACE(world)

SHARED_CONST uint halfspace_fog_keys = kMediumPosition | kMediumNormal;

SHARED Real2 halfspace_fog_span(SHARED_IN(MediumShape) m, Real3 origin, Real3 direction) {
  Real height = dot(origin, m.normal), rise = dot(direction, m.normal);
  if (rise == 0.0) return height < 0.0 ? medium_everywhere() : medium_nowhere();
  Real t = -height / rise;
  return rise > 0.0 ? Real2(-kMediumFar, t) : Real2(t, kMediumFar);
}
SHARED Real halfspace_fog_density(SHARED_IN(MediumShape) m, Real3 point) {
  return dot(point, m.normal) < 0.0 ? 1.0 : 0.0;
}
SHARED Real halfspace_fog_depth(SHARED_IN(MediumShape), Real3, Real3, Real t0, Real t1) { return t1 - t0; }
SHARED Real halfspace_fog_largest(SHARED_IN(MediumShape), Real3, Real3, Real, Real) { return 1.0; }
SHARED Real halfspace_fog_reach(SHARED_IN(MediumShape), Real3, Real3, Real t0, Real depth) { return t0 + depth; }

SHARED_NAMESPACE_END

#endif
