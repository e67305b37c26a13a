/* Density 1 in an axis-parallel box around the position. half_extent: from its centre to its faces. */
#ifndef LOAM_WORLD_MEDIA_BOX_FOG_SHARED_H
#define LOAM_WORLD_MEDIA_BOX_FOG_SHARED_H
#include "world/media/medium.shared.h"

SHARED_NAMESPACE(world)

SHARED_CONST uint box_fog_keys = kMediumPosition | kMediumHalfExtent;

/* A line in the plane of a face counts as inside that slab. */
SHARED real2 box_fog_span(SHARED_IN(MediumShape) m, real3 origin, real3 direction) {
  real2 span = medium_everywhere();
  for (int axis = 0; axis < 3; ++axis) {
    real low = -m.half_extent[axis] - origin[axis], high = m.half_extent[axis] - origin[axis];
    if (direction[axis] == 0.0) {
      if (low > 0.0 || high < 0.0) return medium_nowhere();
      continue;
    }
    real a = low / direction[axis], b = high / direction[axis];
    span = real2(max(span.x, min(a, b)), min(span.y, max(a, b)));
  }
  return span;
}
SHARED real box_fog_density(SHARED_IN(MediumShape) m, real3 point) {
  real3 p = abs(point);
  return p.x <= m.half_extent.x && p.y <= m.half_extent.y && p.z <= m.half_extent.z ? 1.0 : 0.0;
}
SHARED real box_fog_depth(SHARED_IN(MediumShape), real3, real3, real t0, real t1) { return t1 - t0; }
SHARED real box_fog_largest(SHARED_IN(MediumShape), real3, real3, real, real) { return 1.0; }
SHARED real box_fog_reach(SHARED_IN(MediumShape), real3, real3, real t0, real depth) { return t0 + depth; }

SHARED_NAMESPACE_END

#endif
