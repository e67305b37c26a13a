// The opaque voxels of the world (render/raster/shadow_grid.h) and rays through them.
#ifndef LOAM_RENDER_RASTER_SHADING_GRID_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_GRID_GLSL_H
#include "render/raster/shading/picture.glsl.h"

layout(binding = kBindRegions, std430) readonly buffer Regions { ivec4 regions[]; };
layout(binding = kBindGroups, std430) readonly buffer Groups { uint groups[]; };
layout(binding = kBindMasks, std430) readonly buffer Masks { uint masks[]; };

/// The place of a region in `groups`, or -1 where all of it is clear.
int find_region(ivec3 region) {
  const uint last = uint(picture.region_min.w);
  for (uint i = region_hash(region.x, region.y, region.z);; ++i) {
    const ivec4 entry = regions[i & last];
    if (entry.w == 0) return -1;
    if (entry.xyz == region) return entry.w - 1;
  }
}

/// Size of the clear aligned cube around a voxel: 128, 32, 8 or 1; 0 where the voxel is opaque.
int clear_cube(ivec3 voxel, int region) {
  if (region < 0) return 128;
  const ivec3 leaf = voxel >> 3, g = leaf >> 2 & 3, l = leaf & 3, v = voxel & 7;
  const uint at = (uint(region) * 64u + uint(g.x * 16 + g.y * 4 + g.z)) * kGroupWords;
  const uint bit = uint(l.x * 16 + l.y * 4 + l.z);
  const uvec2 any = uvec2(groups[at], groups[at + 1u]);
  if ((any.x | any.y) == 0u) return 32;
  if (((bit < 32u ? any.x : any.y) >> (bit & 31u) & 1u) == 0u) return 8;
  const uvec2 full = uvec2(groups[at + 2u], groups[at + 3u]);
  if (((bit < 32u ? full.x : full.y) >> (bit & 31u) & 1u) != 0u) return 0;
  const uvec2 mixed = any & ~full;
  const uint below = (1u << (bit & 31u)) - 1u;
  const uint before = bit < 32u ? uint(bitCount(mixed.x & below)) : uint(bitCount(mixed.x) + bitCount(mixed.y & below));
  const uint index = uint(v.y * 8 + v.z);
  const uint word = masks[(groups[at + 4u] + before) * 16u + uint(v.x) * 2u + (index >> 5)];
  return (word >> (index & 31u) & 1u) != 0u ? 0 : 1;
}

/// Whether nothing opaque lies along a direction up to t_max from a point of a voxel. Distances are relative to the
/// start, and each crossing is worked out from its integer plane; the start is the voxel in front of a face, so no bias
/// is needed.
bool clear_between(const ivec3 start, const vec3 fraction, const vec3 direction, float t_max) {
  const bvec3 up = greaterThanEqual(direction, vec3(0));
  const vec3 inverse = 1.0 / direction;
  ivec3 voxel = start, region = voxel >> 7;
  int place = find_region(region);
  for (int steps = 0; steps < 16384; ++steps) {
    const int size = clear_cube(voxel, place);
    if (size == 0) return false;
    // Leave the clear cube by the nearest of its planes ahead.
    const ivec3 low = voxel & ivec3(-size);
    const ivec3 planes = low + mix(ivec3(0), ivec3(size), up);
    vec3 t = (vec3(planes - start) - fraction) * inverse;
    t = mix(t, vec3(1e30), equal(direction, vec3(0)));
    const int axis = t.x <= t.y ? (t.x <= t.z ? 0 : 2) : (t.y <= t.z ? 1 : 2);
    if (!(t[axis] < t_max)) return true;
    voxel = clamp(start + ivec3(floor(fraction + t[axis] * direction)), low, low + (size - 1));
    voxel[axis] = up[axis] ? planes[axis] : planes[axis] - 1;
    const ivec3 next = voxel >> 7;
    if (next != region) {
      if (any(lessThan(next, picture.region_min.xyz)) || any(greaterThan(next, picture.region_max.xyz))) return true;
      region = next;
      place = find_region(region);
    }
  }
  return true;
}

/// Whether nothing opaque lies between a point of a voxel and the sun.
bool sun_visible(const ivec3 start, const vec3 fraction) {
  return clear_between(start, fraction, picture.sun.xyz, 1e30);
}

#endif
