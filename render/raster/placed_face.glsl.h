// Where a face of cubes lies, by its record and its chunk. Needs `picture` and kExactEdges.
#ifndef LOAM_RENDER_RASTER_PLACED_FACE_GLSL_H
#define LOAM_RENDER_RASTER_PLACED_FACE_GLSL_H
#include "render/extract/face_record.shared.h"
#include "render/raster/face_vertex.glsl.h"
#include "render/raster/transparency.shared.h"

layout(constant_id = kSpecLiquidLevels) const bool kLiquidLevels = false;

/// Relative to the camera.
struct PlacedFace {
  int axis, u, v;  // its plane's, and those in it
  float offset;    // of its plane
  vec2 low, high;  // its extent along u and v
  uvec3 seen;      // as seen_image, or of a layer packed interface and plane; the chunk's detail
  bool away;       // it looks away
};

PlacedFace place_face(uvec2 record, ivec4 chunk) {
  PlacedFace placed;
  const int face = int(face_direction(record.y));
  const int axis = face >> 1, u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
  const int level = chunk.w & int(kChunkLevel);
  const ivec3 voxel = chunk.xyz + (ivec3(face_voxel(record.x)) << level);
  const int plane = voxel[axis] + ((face & 1) << level);
  const uint upper = kLiquidLevels ? opaque_part_upper(record.y) : 0u, liquid = face == 3 ? upper : 0u;
  const float drop = kLiquidLevels ? level_drop(liquid) : 0.0;
  placed.axis = axis, placed.u = u, placed.v = v;
  placed.offset = float(plane) - drop - picture.fraction[axis] - picture.fraction_rest[axis];
  placed.seen = uvec3(
      face_block(record.y) | uint(face) << kSeenFaceShift | uint(level) << kSeenLevelShift | liquid << kSeenLiquidShift,
      uint(plane), uint(chunk.w));
  placed.away = (face & 1) == 1 ? placed.offset >= 0.0 : placed.offset <= 0.0;

  // From integers, so that the common edge of two faces has the same bits in both.
  const vec2 fraction = vec2(picture.fraction[u], picture.fraction[v]);
  placed.low = vec2(voxel[u], voxel[v]) - fraction;
  placed.high =
      vec2(voxel[u] + (int(face_width(record.x)) << level), voxel[v] + (int(face_height(record.x)) << level)) -
      fraction;
  if (kLiquidLevels && face_is_part(record.x))
    face_extent(record.x, record.y, upper, voxel[u], voxel[v], fraction, placed.low, placed.high);
  const vec2 rest = vec2(picture.fraction_rest[u], picture.fraction_rest[v]);
  placed.low -= rest, placed.high -= rest;
  return placed;
}

/// Of a face between see-through blocks: both sides are seen.
PlacedFace place_layer(uvec2 record, ivec4 chunk) {
  PlacedFace placed;
  const int face = int(face_direction(record.y));
  const int axis = face >> 1, u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
  const ivec3 voxel = chunk.xyz + ivec3(face_voxel(record.x));
  const int plane = voxel[axis] + (face & 1);
  const uint upper = see_through_part_upper(record.y), level = face == 3 ? upper : 0u;
  placed.axis = axis, placed.u = u, placed.v = v;
  placed.offset = float(plane) - level_drop(level) - picture.fraction[axis] - picture.fraction_rest[axis];
  placed.seen = uvec3(packed_interface(see_through_kind(record.y), uint(face), see_through_beyond(record.y), level),
                      uint(plane), 0u);
  placed.away = false;

  const vec2 fraction = vec2(picture.fraction[u], picture.fraction[v]);
  face_extent(record.x, record.y, upper, voxel[u], voxel[v], fraction, placed.low, placed.high);
  const vec2 rest = vec2(picture.fraction_rest[u], picture.fraction_rest[v]);
  placed.low -= rest, placed.high -= rest;
  return placed;
}

#endif
