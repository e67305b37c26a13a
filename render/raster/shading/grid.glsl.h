// The opaque voxels of the world (render/raster/shadow_grid.h) and rays through them.
#ifndef LOAM_RENDER_RASTER_SHADING_GRID_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_GRID_GLSL_H
#include "render/raster/shading/mesh_rays.glsl.h"
#include "render/raster/shading/picture.glsl.h"

layout(binding = kBindRegions) uniform isamplerBuffer regions;
layout(binding = kBindLeaves) uniform usamplerBuffer leaves;
layout(binding = kBindMasks) uniform usamplerBuffer masks;
layout(binding = kBindSunHeights) uniform usamplerBuffer sun_heights;

/// The place of a region in `leaves`, or -1 where all of it is clear.
int find_region(ivec3 region) {
  const uint last = uint(picture.region_min.w);
  for (uint i = region_hash(region.x, region.y, region.z);; ++i) {
    const ivec4 entry = texelFetch(regions, int(i & last));
    if (entry.w == 0) return -1;
    if (entry.xyz == region) return entry.w - 1;
  }
}

/// Sides of a clear aligned box around a voxel: 128, 32, 16, 8, 4x2x4, 2 or 1; 0 where the voxel is opaque.
ivec3 clear_box(ivec3 voxel, int region) {
  if (region < 0) return ivec3(128);
  const ivec3 leaf = voxel >> 3 & 15;
  const uint word = texelFetch(leaves, region * 4096 + leaf.x * 256 + leaf.y * 16 + leaf.z).r;
  if (word < kLeafFull) return ivec3(8 << int(word));
  if (word == kLeafFull) return ivec3(0);
  // Bits as world/store/brick_volume.h lays them out.
  const int in_leaf = (voxel.x & 4) << 1 | voxel.y & 6 | voxel.z >> 2 & 1;
  const uint voxels = texelFetch(masks, int(word - kLeafMixed) * 16 + in_leaf).r;
  if (voxels == 0u) return ivec3(4, 2, 4);
  const int bit = (voxel.x & 3) << 3 | (voxel.y & 1) << 2 | voxel.z & 3;
  if ((voxels >> bit & 1u) != 0u) return ivec3(0);
  return ivec3((voxels & 0x3333u << (bit & 18)) == 0u ? 2 : 1);
}
bool is_clear(ivec3 voxel) { return clear_box(voxel, find_region(voxel >> 7)).x != 0; }

/// A ray through the grid: each crossing is worked out from its integer plane, relative to the start.
struct GridRay {
  ivec3 start;
  vec3 fraction, direction, inverse;
  bvec3 up, still;
};
/// Leaves the aligned box around a voxel by the nearest of its planes ahead, for the voxel beyond; where that is.
float leave_box(const GridRay ray, inout ivec3 voxel, const ivec3 size) {
  const ivec3 low = voxel & -size;
  const ivec3 planes = low + mix(ivec3(0), size, ray.up);
  vec3 t = (vec3(planes - ray.start) - ray.fraction) * ray.inverse;
  t = mix(t, vec3(1e30), ray.still);
  const int axis = t.x <= t.y ? (t.x <= t.z ? 0 : 2) : (t.y <= t.z ? 1 : 2);
  voxel = clamp(ray.start + ivec3(floor(ray.fraction + t[axis] * ray.direction)), low, low + (size - 1));
  voxel[axis] = ray.up[axis] ? planes[axis] : planes[axis] - 1;
  return t[axis];
}

/// Whether nothing opaque lies along a direction up to t_max from a point of a voxel; start_is_clear: it is known that
/// nothing opaque is there, as before a face, which saves a look. The start is the voxel in front of a face, so no bias
/// is needed. Regions have a loop of their own: to look one up costs more than the rest of a step, and software would
/// do so at each.
bool clear_between(const ivec3 start, const vec3 fraction, const vec3 direction, float t_max, bool start_is_clear) {
  const GridRay ray = GridRay(start, fraction, direction, 1.0 / direction, greaterThanEqual(direction, vec3(0)),
                              equal(direction, vec3(0)));
  ivec3 voxel = start;
  if (start_is_clear && !(leave_box(ray, voxel, ivec3(1)) < t_max)) return true;
  for (int steps = 0; steps < (1 << 24);) {
    const ivec3 region = voxel >> 7;
    if (any(lessThan(region, picture.region_min.xyz)) || any(greaterThan(region, picture.region_max.xyz))) return true;
    const int place = find_region(region);
    for (; steps < (1 << 24) && voxel >> 7 == region; ++steps) {
      const ivec3 size = clear_box(voxel, place);
      if (size.x == 0) return false;
      if (!(leave_box(ray, voxel, size) < t_max)) return true;
    }
  }
  return true;
}

/// What the height map says of the ray to the sun from a point of a voxel: 1: nothing is on it, 0: something is, -1: it
/// must be cast, up to t_max. As cast_piece() of world/store/parallel_rays.cpp.
int sun_look(const ivec3 start, const vec3 fraction, out float t_max) {
  t_max = 1e30;
  const int axis = picture.sun_cells.z & 3;
  const bool down = picture.sun_cells.z >= 4;
  const ivec3 from = start - picture.camera_voxel.xyz;
  const vec3 at = vec3(from) + fraction;
  const int from_main = axis == 0 ? from.x : axis == 1 ? from.y : from.z;
  const int k = picture.sun_cells.w + (down ? -from_main : from_main);
  const vec2 across = vec2(dot(picture.sun_u.xyz, at) + picture.sun_u.w, dot(picture.sun_v.xyz, at) + picture.sun_v.w);
  const ivec2 cell = ivec2(floor(across)) + picture.sun_base.xy;
  const ivec2 block = cell >> 6;
  uint says = 0u;
  if (all(greaterThanEqual(block, ivec2(0))) && all(lessThan(block, picture.sun_cells.xy)))
    says = texelFetch(sun_heights, (block.x * picture.sun_cells.y + block.y << 12) | (cell.x & 56) << 6 |
                                       (cell.y & 56) << 3 | (cell.x & 7) << 3 | (cell.y & 7))
               .r;
  // So far off floats don't tell cells apart.
  if (picture.sun_cells.x == 0 || any(greaterThan(abs(from), ivec3(8192)))) return -1;
  const int end = int(says & 0xffffu), shut = int(says >> 16);
  if (k >= end) return 1;
  if (max(k, 0) < shut) return 0;
  // Behind the last slab in which anything is set the ray is free.
  const float main = axis == 0 ? fraction.x : axis == 1 ? fraction.y : fraction.z;
  t_max = (float(end - k) - (down ? 1.0 - main : main)) * intBitsToFloat(picture.sun_base.z);
  return -1;
}

/// The same with the triangles of the picture, but for one that the start lies on. Where they stand for voxels too, the
/// start may lie outside of its voxel.
bool nothing_between(const ivec3 start, const vec3 fraction, const vec3 direction, float t_max, uint triangle) {
  return (kTrianglesAlone || clear_between(start, fraction, direction, t_max, triangle == kNoTriangle)) &&
         !(kMeshes && meets_mesh(start, fraction, direction, t_max, triangle));
}

/// Set where a ray to the sun was cast.
bool sun_ray_cast = false;

/// Whether nothing opaque lies between a point of a voxel and the sun, nor any triangle but one.
bool sun_visible(const ivec3 start, const vec3 fraction, uint triangle) {
  if (kTrianglesAlone) return !meets_mesh(start, fraction, picture.sun.xyz, 1e30, triangle);
  float t_max;
  const int says = sun_look(start, fraction, t_max);
  sun_ray_cast = sun_ray_cast || says < 0;
  const bool open =
      says < 0 ? clear_between(start, fraction, picture.sun.xyz, t_max, triangle == kNoTriangle) : says > 0;
  return open && !(kMeshes && meets_mesh(start, fraction, picture.sun.xyz, 1e30, triangle));
}

#endif
