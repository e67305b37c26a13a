#version 460
#extension GL_GOOGLE_include_directive : require
// A point a shape that is small on the screen: the square of pixels that may see it. An eighth of the vertices of
// shapes.vert.glsl for a plant, and no triangle; the pixel's own ray decides, so the picture is the same.
#include "render/raster/raster.shared.h"
#include "render/extract/face_record.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindFaces) uniform usamplerBuffer faces;
layout(binding = kBindChunks) uniform isamplerBuffer chunks;
layout(binding = kBindShapeQuads) uniform samplerBuffer quads;

#define RAY_TO_FRAGMENTS
#include "render/raster/fragment_ray.glsl.h"

layout(location = 0) flat out uvec4 shape;  // its first face, how many; y of `seen`; detail
layout(location = 1) flat out vec3 voxel;   // relative to the camera

/// Of the square's rim, in pixels: more than the rasterizer rounds places and sizes by.
const float kRim = 1.0 / 32;

void main() {
  write_ray();
  const uvec2 record = texelFetch(faces, gl_VertexIndex).xy;
  const int at = int(record.y * kQuadVectors);
  const vec4 low = texelFetch(quads, at + 7), high = texelFetch(quads, at + 8);
  const ivec4 chunk = texelFetch(chunks, gl_InstanceIndex);
  shape = uvec4(record.y, floatBitsToUint(low.w), uint(gl_InstanceIndex) << kSeenChunkShift | (record.x & 0x3ffffu),
                uint(chunk.w));
  voxel = vec3(chunk.xyz + ivec3(face_voxel(record.x))) - picture.fraction.xyz - picture.fraction_rest.xyz;

  // Clip space is linear in the corners of the box.
  const mat3 rows = mat3(picture.clip_x.xyz, picture.clip_y.xyz, picture.clip_w.xyz);
  const vec3 corner = (voxel + low.xyz) * rows, size = high.xyz - low.xyz;
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
  // A point is clipped by its middle: one at the picture's border is cut to what lies in it.
  least = max(least, vec2(-1)), most = min(most, vec2(1));
  if (nearest <= picture.fraction.w || any(greaterThan(least, most))) {
    shape.y = 0u;
    gl_Position = vec4(0, 0, 1, 1);
    gl_PointSize = 1.0;
    return;
  }
  const vec2 pixels = 0.5 * (most - least) * picture.screen.xy;
  gl_Position = vec4(0.5 * (least + most), picture.fraction.w / farthest, 1);
  gl_PointSize = max(pixels.x, pixels.y) + 2.0 * kRim;
}
