/* What a shader that makes a list for a dispatch writes into the buffer of its arguments: render/gpu/time_slices.h. */
#ifndef LOAM_RENDER_GPU_TIME_SLICES_SHARED_H
#define LOAM_RENDER_GPU_TIME_SLICES_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(render)

/* Then kSliceWords for each slice: its groups along x, y and z, the last two 1. */
struct ListHead {
  uint slice_groups; /* of a slice, at most: a listed group adds 1 to the first word of the slice that it falls into */
  uint listed;       /* pixels, or what else the list holds */
  uint counted;      /* whatever else is counted on the way */
};
SHARED_CONST uint kSliceWords = 3u;

SHARED_NAMESPACE_END
#endif
