// Where a shape that is drawn as a whole lies in the picture. Needs `picture`, `faces`, `chunks` and `quads`.
#ifndef LOAM_RENDER_RASTER_PLACED_SHAPE_GLSL_H
#define LOAM_RENDER_RASTER_PLACED_SHAPE_GLSL_H
#include "render/extract/face_record.shared.h"

struct PlacedShape {
  uint first, faces;  // of the table; faces: 0 where nothing of it is in the picture
  uint place;         // y of `seen`
  uint detail;        // of its chunk
  vec3 voxel;         // its corner, relative to the camera
  vec2 least, most;   // of its box, in clip space, within the picture
  float farthest;     // view depth
};

PlacedShape place_shape(uvec2 record, uint chunk_number) {
  PlacedShape placed;
  const int at = int(record.y * kQuadVectors);
  const vec4 low = texelFetch(quads, at + 7), high = texelFetch(quads, at + 8);
  const ivec4 chunk = texelFetch(chunks, int(chunk_number));
  placed.first = record.y, placed.faces = floatBitsToUint(low.w);
  placed.place = chunk_number << kSeenChunkShift | (record.x & 0x3ffffu);
  placed.detail = uint(chunk.w);
  placed.voxel = vec3(chunk.xyz + ivec3(face_voxel(record.x))) - picture.fraction.xyz - picture.fraction_rest.xyz;

  // Clip space is linear in the corners of the box.
  const mat3 rows = mat3(picture.clip_x.xyz, picture.clip_y.xyz, picture.clip_w.xyz);
  const vec3 corner = (placed.voxel + low.xyz) * rows, size = high.xyz - low.xyz;
  const vec3 along_x = size.x * vec3(rows[0].x, rows[1].x, rows[2].x);
  const vec3 along_y = size.y * vec3(rows[0].y, rows[1].y, rows[2].y);
  const vec3 along_z = size.z * vec3(rows[0].z, rows[1].z, rows[2].z);
  vec2 least = vec2(1e9), most = vec2(-1e9);
  float nearest = 1e9, farthest = 0.0;
  for (int i = 0; i < 8; ++i) {
    const vec3 c = corner + ((i & 1) != 0 ? along_x : vec3(0)) + ((i & 2) != 0 ? along_y : vec3(0)) +
                   ((i & 4) != 0 ? along_z : vec3(0));
    least = min(least, c.xy / c.z);
    most = max(most, c.xy / c.z);
    nearest = min(nearest, c.z);
    farthest = max(farthest, c.z);
  }
  placed.least = max(least, vec2(-1)), placed.most = min(most, vec2(1));
  placed.farthest = farthest;
  if (nearest <= picture.fraction.w || any(greaterThan(placed.least, placed.most))) placed.faces = 0u;
  return placed;
}

/// Around its box, px: more than places and sizes are rounded by.
const float kRim = 1.0 / 32;

#endif
