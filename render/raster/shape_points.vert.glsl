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

#include "render/raster/placed_shape.glsl.h"

void main() {
  write_ray();
  const PlacedShape placed = place_shape(texelFetch(faces, gl_VertexIndex).xy, uint(gl_InstanceIndex));
  shape = uvec4(placed.first, placed.faces, placed.place, placed.detail);
  voxel = placed.voxel;
  if (placed.faces == 0u) {
    gl_Position = vec4(0, 0, 1, 1);
    gl_PointSize = 1.0;
    return;
  }
  // A point is clipped by its middle: one at the picture's border is cut to what lies in it.
  const vec2 pixels = 0.5 * (placed.most - placed.least) * picture.screen.xy;
  gl_Position = vec4(0.5 * (placed.least + placed.most), picture.fraction.w / placed.farthest, 1);
  gl_PointSize = max(pixels.x, pixels.y) + 2.0 * kRim;
}
