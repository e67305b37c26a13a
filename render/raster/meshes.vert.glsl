#version 460
#extension GL_GOOGLE_include_directive : require
// Three vertices a triangle, pulled from the buffer that rays walk too (render/raster/triangles.h). Positions are
// relative to the camera.
#include "render/raster/shading/mesh_rays.glsl.h"

layout(location = 0) flat out uint triangle;
layout(location = 1) flat out vec4 plane;   // not of length 1; w: of a corner
layout(location = 2) flat out vec2 depths;  // of the nearest corner and of the farthest

void main() {
  triangle = uint(gl_VertexIndex) / 3u;
  const uvec4 corners = mesh_triangle(triangle);
  vec3 corner[3];
  float depth[3];
  for (int i = 0; i < 3; ++i) {
    corner[i] = mesh_corner(corners[i], picture.camera_voxel.xyz, picture.fraction.xyz) - picture.fraction_rest.xyz;
    depth[i] = dot(picture.clip_w.xyz, corner[i]);
  }
  const vec3 across = cross(corner[1] - corner[0], corner[2] - corner[0]);
  // Of the corner nearest to the camera, where rounding is least.
  const vec3 far = vec3(dot(corner[0], corner[0]), dot(corner[1], corner[1]), dot(corner[2], corner[2]));
  plane = vec4(across, dot(across, far.x <= min(far.y, far.z) ? corner[0] : far.y <= far.z ? corner[1] : corner[2]));
  depths = vec2(min(depth[0], min(depth[1], depth[2])), max(depth[0], max(depth[1], depth[2])));
  const uint own = uint(gl_VertexIndex) % 3u;
  gl_Position = vec4(dot(picture.clip_x.xyz, corner[own]), dot(picture.clip_y.xyz, corner[own]), picture.fraction.w,
                     depth[own]);
}
