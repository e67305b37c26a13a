// What triangle of a picture a bent or mirrored ray meets first, and what that shows.
#ifndef LOAM_RENDER_RASTER_SHADING_MESH_FIRST_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_MESH_FIRST_GLSL_H
#include "render/raster/shading/mesh.glsl.h"

/// Along a unit direction from a point of a voxel, within `t`, which is then where; or kNoTriangle. As meets_mesh().
uint first_mesh(const ivec3 start, const vec3 fraction, const vec3 direction, inout float t) {
  return find_triangle(start, fraction, direction, t, kNoTriangle, false);
}

/// Radiance of a triangle at t along the ray.
vec3 first_mesh_radiance(uint triangle, const ivec3 start, const vec3 fraction, const vec3 direction, float t) {
  const vec3 from =
      vec3(start - picture.camera_voxel.xyz) + (fraction - picture.fraction.xyz - picture.fraction_rest.xyz);
  return mesh_radiance_at(triangle, from + t * direction, direction);
}

#endif
