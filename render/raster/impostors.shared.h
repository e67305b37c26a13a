// What the processor and the shaders of impostors both need.
#ifndef LOAM_RENDER_RASTER_IMPOSTORS_SHARED_H
#define LOAM_RENDER_RASTER_IMPOSTORS_SHARED_H

#include "world/base/shared.h"

#ifdef __cplusplus
namespace render::raster {
using glsl::ivec2, glsl::ivec4, glsl::uint, glsl::uvec2, glsl::uvec4, glsl::vec4;
#endif

// A texel of an impostor, in two words: what its ray sees of the chunk, and at which depth.
//   word 0  bits 0..15 block   16..18 face   19..25 plane of the face in the chunk, cells   (0: nothing)
//   word 1  bits of near / view depth, of the picture that the impostor is
SHARED_CONST uint kTexelFaceShift = 16u, kTexelPlaneShift = 19u;

/// What a texel shows lies within rows that are known for each so many columns.
SHARED_CONST uint kStripTexels = 16u;

/// A strip of an impostor on a picture. Members of 16 bytes alone, as in PictureConstants.
struct ImpostorDraw {
  vec4 corners[4];           // in clip space, of its part of the window
  vec4 row_x, row_y, row_w;  // texel of a pixel (px, py, 1): (row_x . pixel, row_y . pixel) / row_w . pixel
  vec4 depth;    // x + texel.x y + texel.y z, times the texel's own view depth, - w: view depth; near in row_x.w
  ivec4 chunk;   // its corner relative to the camera's voxel; see kChunkLevel
  uvec4 texels;  // the first, width, height
};

/// Chunks beside each other, of which each is displaced otherwise, must leave no gap: what an impostor shows at the
/// sides of its chunk spreads so far over what it leaves empty. As the knob's error in texels of a quarter of it.
SHARED_CONST int kSpreadTexels = 3;

/// Of what is seen of a chunk, its texels are made.
struct ImpostorPack {
  ivec4 from;                   // x, y in the image of what is seen; width, height
  ivec4 chunk;                  // as in ImpostorDraw
  uvec4 first;                  // texel, place of its strips in what is told of rows
  vec4 corner, step_x, step_y;  // of its rays, as in PictureConstants; w of corner: near
  vec4 low;                     // of the chunk relative to the camera; w: its edge, m
};

#ifdef __cplusplus
static_assert(sizeof(ImpostorDraw) == 10 * 16);
}  // namespace render::raster
#endif
#endif
