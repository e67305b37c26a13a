/* The same everywhere: density 1. A mesh that names it as its interior bounds it. */
#ifndef LOAM_WORLD_MEDIA_HOMOGENEOUS_SHARED_H
#define LOAM_WORLD_MEDIA_HOMOGENEOUS_SHARED_H
#include "world/media/medium.shared.h"

SHARED_NAMESPACE(world)

SHARED_CONST uint homogeneous_keys = 0u;

SHARED Real2 homogeneous_span(SHARED_IN(MediumShape), Real3, Real3) { return medium_everywhere(); }
SHARED Real homogeneous_density(SHARED_IN(MediumShape), Real3) { return 1.0; }
SHARED Real homogeneous_depth(SHARED_IN(MediumShape), Real3, Real3, Real t0, Real t1) { return t1 - t0; }
SHARED Real homogeneous_largest(SHARED_IN(MediumShape), Real3, Real3, Real, Real) { return 1.0; }
SHARED Real homogeneous_reach(SHARED_IN(MediumShape), Real3, Real3, Real t0, Real depth) { return t0 + depth; }

SHARED_NAMESPACE_END

#endif
