/* Density 1 below a plane through the position. normal: unit, out of the medium. */
#ifndef LOAM_WORLD_MEDIA_HALFSPACE_FOG_SHARED_H
#define LOAM_WORLD_MEDIA_HALFSPACE_FOG_SHARED_H
#include "world/media/medium.shared.h"

SHARED_NAMESPACE(world)

SHARED_CONST uint halfspace_fog_keys = kMediumPosition | kMediumNormal;

SHARED real2 halfspace_fog_span(SHARED_IN(MediumShape) m, real3 origin, real3 direction) {
  real height = dot(origin, m.normal), rise = dot(direction, m.normal);
  if (rise == 0.0) return height < 0.0 ? medium_everywhere() : medium_nowhere();
  real t = -height / rise;
  return rise > 0.0 ? real2(-kMediumFar, t) : real2(t, kMediumFar);
}
SHARED real halfspace_fog_density(SHARED_IN(MediumShape) m, real3 point) {
  return dot(point, m.normal) < 0.0 ? 1.0 : 0.0;
}
SHARED real halfspace_fog_depth(SHARED_IN(MediumShape), real3, real3, real t0, real t1) { return t1 - t0; }
SHARED real halfspace_fog_largest(SHARED_IN(MediumShape), real3, real3, real, real) { return 1.0; }
SHARED real halfspace_fog_reach(SHARED_IN(MediumShape), real3, real3, real t0, real depth) { return t0 + depth; }

SHARED_NAMESPACE_END

#endif
