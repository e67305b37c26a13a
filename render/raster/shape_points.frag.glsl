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
  // Faces that look away lie behind those that don't.
  float nearest = 1e30;
  uint seen = 0u;
  for (uint face = shape.x; face < shape.x + shape.y; ++face) {
    const int at = int(face * kQuadVectors);
    const vec4 along_u = texelFetch(quads, at + 4), along_v = texelFetch(quads, at + 5), plane = texelFetch(quads, at + 6);
    const float t = (dot(plane.xyz, voxel) + plane.w) / dot(plane.xyz, ray);
    const vec3 place = t * ray - voxel;
    const vec2 on = vec2(dot(place, along_u.xyz), dot(place, along_v.xyz)) - vec2(along_u.w, along_v.w);
    if (t > 0.0 && t < nearest && lies_within(on)) {
      nearest = t;
      seen = kSeenShape | face;
    }
  }
  if (seen == 0u || behind_mirror(nearest * ray)) discard;
  gl_FragDepth = picture.fraction.w / (nearest * dot(picture.clip_w.xyz, ray));
  seen_out = uvec2(seen, shape.z);
}
