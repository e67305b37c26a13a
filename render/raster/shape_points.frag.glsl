#version 460
#extension GL_GOOGLE_include_directive : require
// Says which face a pixel sees of the shape that a point stands for, and how far: by its own ray, as shapes.frag.glsl
// does with exact edges.
#include "render/raster/raster.shared.h"

layout(constant_id = kSpecBlends) const bool kBlends = false;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };

#include "render/raster/mirror.glsl.h"
#include "render/raster/shape_face.glsl.h"

layout(location = 0) flat in uvec4 shape;
layout(location = 1) flat in vec3 voxel;
layout(location = 0) out uvec2 seen_out;

void main() {
  if (kBlends && !chunk_shown(shape.w, floor(gl_FragCoord.xy))) discard;
  const vec3 ray = fragment_ray();
  float nearest = 1e30;
  const uint face = nearest_face(shape.x, shape.y, voxel, ray, 0.0, nearest);
  if (face == kNoQuad || behind_mirror(nearest * ray)) discard;
  gl_FragDepth = picture.fraction.w / (nearest * dot(picture.clip_w.xyz, ray));
  seen_out = uvec2(kSeenShape | face, shape.z);
}
