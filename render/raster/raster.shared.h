// What the processor and the shaders of the rasterizer both need: bindings, the constants of a picture, the face
// record.
#ifndef LOAM_RENDER_RASTER_RASTER_SHARED_H
#define LOAM_RENDER_RASTER_RASTER_SHARED_H

#ifdef __cplusplus
#include <cstdint>
#include <glm/vec4.hpp>
namespace render::raster {
using uint = uint32_t;
using vec4 = glm::vec4;
#define SHARED_CONST constexpr
#else
#define SHARED_CONST const
#endif

SHARED_CONST uint kBindPicture = 0;    // uniform PictureConstants
SHARED_CONST uint kBindFaces = 1;      // uvec2[]  face records
SHARED_CONST uint kBindChunks = 2;     // ivec4[]  corner of each chunk, relative to the camera's voxel
SHARED_CONST uint kBindMaterials = 3;  // vec4[2n] albedo, emitted radiance
SHARED_CONST uint kBindSeen = 4;       // rg32ui   what each pixel sees
SHARED_CONST uint kBindRadiance = 5;   // float[3 * pixels]
SHARED_CONST uint kBindRegions = 6;    // uint[]   shadow grid: hash table of regions
SHARED_CONST uint kBindLeaves = 7;     // uint[]   shadow grid: summary bits and mask places of each region
SHARED_CONST uint kBindMasks = 8;      // uint[]   shadow grid: 16 words a mixed leaf
SHARED_CONST uint kBindings = 9;

SHARED_CONST uint kShadeGroup = 8;  // the shading pass works on squares of 8 x 8 pixels

/// Specialisation constants.
SHARED_CONST uint kSpecExactEdges = 0;
SHARED_CONST uint kSpecSunShadow = 1;

/// One picture. Only vec4, so that every layout rule places the members alike.
struct PictureConstants {
  vec4 corner, step_x, step_y;               // PixelRays: direction = corner + px * step_x + py * step_y
  vec4 clip_x, clip_y, clip_w;               // rows of the projection of a point relative to the camera
  vec4 fraction;                             // of the camera's voxel; w: near plane, m
  vec4 sun;                                  // towards the sun; w: view distance, m
  vec4 sky_zenith, sky_horizon, sky_ground;  // radiance
  vec4 sky_lit[6];                           // radiance of albedo 1 under the sky, by face
  vec4 sun_lit[6];                           // added where the sun is visible; w: 1 where the face looks towards it
  vec4 screen;                               // x: width, y: height, z: metres at view depth 1 that are 1.25/256 pixel
};

/// A pixel of the target of the first pass: x = block | face << 16 (0: sky), y = plane of the face relative to the
/// camera's voxel, as an int.
SHARED_CONST uint kSeenFaceShift = 16u;

#ifdef __cplusplus
static_assert(sizeof(PictureConstants) == (12 + 12) * 16);
#undef SHARED_CONST
}  // namespace render::raster
#endif
#endif
