#version 460
#extension GL_GOOGLE_include_directive : require
// Four vertices a plane of a billboard cloud.
#include "render/raster/billboards.shared.h"
#include "render/raster/raster.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindBillboardPlanes, std430) readonly buffer Planes { BillboardPlane planes[]; };
layout(binding = kBindBillboardDraws, std430) readonly buffer Draws { BillboardDraw draws[]; };

#define RAY_TO_FRAGMENTS
#include "render/raster/fragment_ray.glsl.h"

layout(location = 0) flat out vec4 normal;  // w: of the plane's points, relative to the camera
layout(location = 1) flat out vec4 along_u;
layout(location = 2) flat out vec4 along_v;
layout(location = 3) flat out ivec4 tree;
layout(location = 4) flat out uvec4 texels;
// Of the picture: a pixel reads what its vertex says faster than a uniform.
layout(location = 5) flat out vec4 fraction;
layout(location = 6) flat out vec3 fraction_rest;

void main() {
  write_ray();
  const BillboardDraw draw = draws[gl_VertexIndex >> 2];
  const BillboardPlane plane = planes[draw.plane.x];
  const vec3 low = vec3(draw.tree.xyz) - picture.fraction.xyz;
  const float u = plane.u.w + ((gl_VertexIndex & 1) != 0 ? kBillboardTexel * float(plane.texels.y) : 0.0);
  const float v = plane.v.w + ((gl_VertexIndex & 2) != 0 ? kBillboardTexel * float(plane.texels.z) : 0.0);
  const vec3 point = low + plane.normal.w * plane.normal.xyz + u * plane.u.xyz + v * plane.v.xyz;
  normal = vec4(plane.normal.xyz, plane.normal.w + dot(plane.normal.xyz, low));
  along_u = vec4(plane.u.xyz, plane.u.w + dot(plane.u.xyz, low));
  along_v = vec4(plane.v.xyz, plane.v.w + dot(plane.v.xyz, low));
  tree = draw.tree;
  texels = plane.texels;
  fraction = picture.fraction;
  fraction_rest = picture.fraction_rest.xyz;
  gl_Position = vec4(dot(picture.clip_x.xyz, point), dot(picture.clip_y.xyz, point), picture.fraction.w,
                     dot(picture.clip_w.xyz, point));
}
