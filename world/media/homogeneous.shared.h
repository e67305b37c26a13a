/* The same everywhere: density 1. A mesh that names it as its interior bounds it. */
#ifndef LOAM_WORLD_MEDIA_HOMOGENEOUS_SHARED_H
#define LOAM_WORLD_MEDIA_HOMOGENEOUS_SHARED_H
#include "world/media/medium.shared.h"

SHARED_NAMESPACE(world)

SHARED_CONST uint homogeneous_keys = 0u;

SHARED real2 homogeneous_span(SHARED_IN(MediumShape), real3, real3) { return medium_everywhere(); }
SHARED real homogeneous_density(SHARED_IN(MediumShape), real3) { return 1.0; }
SHARED real homogeneous_depth(SHARED_IN(MediumShape), real3, real3, real t0, real t1) { return t1 - t0; }
SHARED real homogeneous_largest(SHARED_IN(MediumShape), real3, real3, real, real) { return 1.0; }
SHARED real homogeneous_reach(SHARED_IN(MediumShape), real3, real3, real t0, real depth) { return t0 + depth; }

SHARED_NAMESPACE_END

#endif
