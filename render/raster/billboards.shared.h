// What the processor and the shaders of billboard clouds both need.
#ifndef LOAM_RENDER_RASTER_BILLBOARDS_SHARED_H
#define LOAM_RENDER_RASTER_BILLBOARDS_SHARED_H

#include "world/base/shared.h"

#ifdef __cplusplus
namespace render::raster {
using glsl::ivec4, glsl::uint, glsl::uvec4, glsl::vec4;
#endif

/// A texel's width on every plane, m.
SHARED_CONST float kBillboardTexel = 0.25f;

/// A plane of a cloud; points are relative to the tree's lowest voxel, m.
struct BillboardPlane {
  vec4 normal;   // w: of its points p . normal
  vec4 u, v;     // along its texels, unit; w: of the first texel's corner
  uvec4 texels;  // the first, width, height; bits of the error, m
};

/// A plane of a tree that a picture shows.
struct BillboardDraw {
  ivec4 tree;   // its lowest voxel, relative to the camera's; see kChunkLevel
  uvec4 plane;  // x: its number
};

#ifdef __cplusplus
static_assert(sizeof(BillboardPlane) == 4 * 16 && sizeof(BillboardDraw) == 2 * 16);
}  // namespace render::raster
#endif
#endif
