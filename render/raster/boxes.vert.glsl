#version 460
#extension GL_GOOGLE_include_directive : require
// Bodies: twelve triangles each.
#include "render/raster/raster.shared.h"
#include "render/inhabitants.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindBoxes, std430) readonly buffer Boxes { DrawnBox boxes[]; };
layout(location = 0) flat out vec3 radiance;
layout(location = 1) out vec3 hit;

void main() {
  const int face = gl_VertexIndex / 6, axis = face >> 1, corner = gl_VertexIndex % 6;
  const int u = corner == 1 || corner == 3 || corner == 4 ? 1 : 0, v = corner == 2 || corner == 4 || corner == 5 ? 1 : 0;
  const DrawnBox box = boxes[gl_InstanceIndex];
  bvec3 high;
  high[axis] = (face & 1) == 1;
  high[(axis + 1) % 3] = u == 1;
  high[(axis + 2) % 3] = v == 1;
  const vec3 point = hit = mix(box.low.xyz, box.high.xyz, high);
  radiance = box.radiance[face].rgb;
  gl_Position = vec4(dot(picture.clip_x.xyz, point), dot(picture.clip_y.xyz, point), picture.fraction.w,
                     dot(picture.clip_w.xyz, point));
}
