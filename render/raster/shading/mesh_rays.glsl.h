// Rays against the triangles of a picture (render/raster/triangles.h).
#ifndef LOAM_RENDER_RASTER_SHADING_MESH_RAYS_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_MESH_RAYS_GLSL_H
#include "render/raster/shading/picture.glsl.h"

layout(constant_id = kSpecMeshes) const bool kMeshes = false;
layout(constant_id = kSpecTrianglesAlone) const bool kTrianglesAlone = false;
layout(binding = kBindMeshes) uniform usamplerBuffer meshes;

uvec4 mesh_triangle(uint triangle) { return texelFetch(meshes, int(picture.meshes.y + triangle)); }

/// A corner relative to a point of the world.
vec3 mesh_corner(uint vertex, ivec3 voxel, vec3 fraction) {
  const int at = int(picture.meshes.z + 3u * vertex);
  const uvec4 place = texelFetch(meshes, at);
  const uvec2 rest = texelFetch(meshes, at + 1).xy;
  return vec3(ivec3(place.xyz) - voxel) +
         (vec3(uintBitsToFloat(place.w), uintBitsToFloat(rest.x), uintBitsToFloat(rest.y)) - fraction);
}

/// Whether a ray from the origin meets a triangle within t_max. The common edge of two triangles has the same value in
/// both but for its sign, so that no ray passes between them.
bool meets_triangle(vec3 a, vec3 b, vec3 c, vec3 direction, float t_max) {
  precise const float ab = dot(direction, cross(a, b)), bc = dot(direction, cross(b, c)),
                      ca = dot(direction, cross(c, a));
  if (!(min(ab, min(bc, ca)) >= 0.0 || max(ab, max(bc, ca)) <= 0.0)) return false;
  const vec3 normal = cross(b - a, c - a);
  const float speed = dot(normal, direction);
  if (speed == 0.0) return false;
  const float t = dot(normal, a) / speed;
  return t >= 0.0 && t <= t_max;
}

/// A triangle but one along a unit direction from a point of a voxel within `t`, or kNoTriangle: any, or the nearest,
/// and t is then where.
uint find_triangle(const ivec3 start, const vec3 fraction, const vec3 direction, inout float t, uint but, bool any) {
  uint found = kNoTriangle;
  const vec3 origin = vec3(start - picture.mesh_base.xyz) + fraction;
  // More than rounding takes of the origin and along the ray.
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
      if (i == but) continue;
      const uvec4 corners = mesh_triangle(i);
      const vec3 a = mesh_corner(corners.x, start, fraction), b = mesh_corner(corners.y, start, fraction),
                 c = mesh_corner(corners.z, start, fraction);
      if (!meets_triangle(a, b, c, direction, t)) continue;
      if (any) return i;
      const vec3 normal = cross(b - a, c - a);
      t = dot(normal, a) / dot(normal, direction);
      found = i;
    }
    ++node;
  }
  return found;
}

/// Whether any triangle but one lies along a unit direction up to t_max from a point of a voxel.
bool meets_mesh(const ivec3 start, const vec3 fraction, const vec3 direction, float t_max, uint but) {
  return find_triangle(start, fraction, direction, t_max, but, true) != kNoTriangle;
}

#endif
