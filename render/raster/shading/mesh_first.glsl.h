// What triangle of a picture a bent or mirrored ray meets first, and what that shows.
#ifndef LOAM_RENDER_RASTER_SHADING_MESH_FIRST_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_MESH_FIRST_GLSL_H
#include "render/raster/shading/mesh.glsl.h"

/// Along a unit direction from a point of a voxel, within `t`, which is then where; or kNoTriangle. As meets_mesh().
uint first_mesh(const ivec3 start, const vec3 fraction, const vec3 direction, inout float t) {
  uint found = kNoTriangle;
  const vec3 origin = vec3(start - picture.mesh_base.xyz) + fraction;
  const vec3 size = abs(origin);
  const float slack = 5e-7 * (max(size.x, max(size.y, size.z)) + intBitsToFloat(picture.mesh_base.w));
  const vec3 inverse = 1.0 / mix(direction, vec3(1e-20), equal(direction, vec3(0)));
  for (uint node = 0u; node < picture.meshes.x;) {
    const uvec4 first = texelFetch(meshes, int(2u * node)), second = texelFetch(meshes, int(2u * node + 1u));
    const vec3 low = (uintBitsToFloat(first.xyz) - slack - origin) * inverse,
               high = (uintBitsToFloat(second.xyz) + slack - origin) * inverse;
    const vec3 in_at = min(low, high), out_at = max(low, high);
    const float enter = max(max(in_at.x, in_at.y), max(in_at.z, 0.0)),
                leave = min(min(out_at.x, out_at.y), min(out_at.z, t));
    if (!(enter <= leave * 1.000001 + slack)) {
      node = first.w;
      continue;
    }
    const uint last = (second.w >> kNodeLeafBits) + (second.w & (1u << kNodeLeafBits) - 1u);
    for (uint i = second.w >> kNodeLeafBits; i < last; ++i) {
      const uvec4 corners = mesh_triangle(i);
      const vec3 a = mesh_corner(corners.x, start, fraction), b = mesh_corner(corners.y, start, fraction),
                 c = mesh_corner(corners.z, start, fraction);
      if (!meets_triangle(a, b, c, direction, t)) continue;
      const vec3 normal = cross(b - a, c - a);
      t = dot(normal, a) / dot(normal, direction);
      found = i;
    }
    ++node;
  }
  return found;
}

/// Radiance of a triangle at t along the ray.
vec3 first_mesh_radiance(uint triangle, const ivec3 start, const vec3 fraction, const vec3 direction, float t) {
  const vec3 from =
      vec3(start - picture.camera_voxel.xyz) + (fraction - picture.fraction.xyz - picture.fraction_rest.xyz);
  return mesh_radiance_at(triangle, from + t * direction, direction);
}

#endif
