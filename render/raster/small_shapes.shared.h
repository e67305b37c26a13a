// Shapes of blocks that are small on the screen, drawn by dispatches: a pipeline sets even points up on one thread of a
// processor; dispatches take all.
//
//   keys     an invocation a shape: asks the rays of the pixels that its box may cover, square by square, and keeps of
//            each pixel the largest key; the blocks of 8 x 8 pixels that it touches are marked
//   blocks   an invocation a block: lists it where it is marked
//   pixels   eight invocations a listed block, each a row: what is nearer than what is drawn so far is seen
//
// A key is the depth's bits, and in the lower word the complement of the shape's place in the list and its face's in
// the shape. So of two shapes at the same depth the first of the list is seen, whatever order invocations run in.
#ifndef LOAM_RENDER_RASTER_SMALL_SHAPES_SHARED_H
#define LOAM_RENDER_RASTER_SMALL_SHAPES_SHARED_H

#include "render/raster/face_blocks.shared.h"

#ifdef __cplusplus
namespace render::raster {
#endif

SHARED_CONST uint kShapeFaceBits = 11u;  // of a key: which of the shape's faces
SHARED_CONST uint kMostShapes = 1u << (32u - kShapeFaceBits);
SHARED_CONST uint kShapesInGroup = 32u, kMarksInGroup = 64u;

/// What `keys` is told.
struct ShapeRange {
  uint first, count;  // in the list of shapes
  uint row_pixels;    // of keys
};

#ifdef __cplusplus
}  // namespace render::raster
#endif
#endif
