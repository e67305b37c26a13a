#version 460
#extension GL_GOOGLE_include_directive : require
// A box of twelve triangles; instances from 1 on are moved by the width of the line in eight directions.
#include "render/raster/raster.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(push_constant) uniform Push { vec4 low, high, colour; };
layout(location = 0) out float view_depth;

void main() {
  const int face = gl_VertexIndex / 6, axis = face >> 1, corner = gl_VertexIndex % 6;
  bvec3 far;
  far[axis] = (face & 1) == 1;
  far[(axis + 1) % 3] = corner == 1 || corner == 3 || corner == 4;
  far[(axis + 2) % 3] = corner == 2 || corner == 4 || corner == 5;
  const vec3 point = mix(low.xyz, high.xyz, far);
  view_depth = dot(picture.clip_w.xyz, point);
  vec2 aside = vec2(0);
  if (gl_InstanceIndex > 0) {
    const float angle = float(gl_InstanceIndex) * (3.14159265 / 4.0);
    aside = 2.0 * low.w * vec2(cos(angle), sin(angle)) / picture.screen.xy;
  }
  gl_Position = vec4(vec2(dot(picture.clip_x.xyz, point), dot(picture.clip_y.xyz, point)) + aside * view_depth,
                     picture.fraction.w, view_depth);
}
