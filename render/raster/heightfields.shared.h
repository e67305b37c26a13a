// What the processor and the shaders of grids of heights both need.
#ifndef LOAM_RENDER_RASTER_HEIGHTFIELDS_SHARED_H
#define LOAM_RENDER_RASTER_HEIGHTFIELDS_SHARED_H

#include "world/base/shared.h"

#ifdef __cplusplus
namespace render::raster {
using glsl::ivec2, glsl::ivec4, glsl::uint, glsl::uvec4;
#endif

/// Columns of a surface along x and z; see HeightSurface for the words.
SHARED_CONST int kHeightColumns = 64;
/// Parts of a cell that heights are told in.
SHARED_CONST float kHeightParts = 16.0f;

/// A grid that a picture shows.
struct HeightDraw {
  ivec4 corner;  // of the surface, at its base, relative to the camera's voxel; see kChunkLevel
  uvec4 words;   // the surface's first, the first of the grid's vertices; the grid's step, its squares a side
};

/// Vertices are those of the grid, row by row, then 4 * squares of its skirt's lower end, all around: which vertex of
/// the grid the k-th lies below.
SHARED ivec2 above_skirt(int k, int squares) {
  int side = k / squares, along = k % squares;
  if (side == 0) return ivec2(0, along);
  if (side == 1) return ivec2(along, squares);
  if (side == 2) return ivec2(squares, squares - along);
  return ivec2(squares - along, 0);
}

#ifdef __cplusplus
static_assert(sizeof(HeightDraw) == 2 * 16);
}  // namespace render::raster
#endif
#endif
