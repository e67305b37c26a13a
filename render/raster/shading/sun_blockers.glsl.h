// What of the sun's light arrives through what isn't opaque (render/raster/sun_blockers.h): see-through blocks let
// through what they do of each band, straight on; shapes of blocks hide it. light_through() of
// render/raycast/light_through.h.
#ifndef LOAM_RENDER_RASTER_SHADING_SUN_BLOCKERS_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_SUN_BLOCKERS_GLSL_H
#include "render/raster/shading/picture.glsl.h"
#include "render/raster/shape_quads.glsl.h"
#include "render/see_through.shared.h"

layout(constant_id = kSpecSunBlockers) const bool kSunBlockers = false;
layout(binding = kBindBlockerRegions) uniform isamplerBuffer blocker_regions;
layout(binding = kBindBlockerLeaves) uniform usamplerBuffer blocker_leaves;
layout(binding = kBindBlockerCodes) uniform usamplerBuffer blocker_codes;
layout(binding = kBindBlockerKinds, std430) readonly buffer BlockerKinds {
  ivec4 blockers_low, blockers_high;
  SeeThroughBlock blocker_kinds[];
};

/// Without its bound, which is never reached, software (Mesa 22.3.6) loses what it found.
int find_blocker_region(ivec3 region) {
  const uint last = uint(blockers_low.w);
  for (uint k = 0u, i = region_hash(region.x, region.y, region.z); k <= last; ++k, ++i) {
    const ivec4 entry = texelFetch(blocker_regions, int(i & last));
    if (entry.w == 0) return -1;
    if (entry.xyz == region) return entry.w - 1;
  }
  return -1;
}

/// The code of a voxel, and the size of the aligned cube around it that is known to be all of that code.
uint blocker_at(ivec3 voxel, int region, out int size) {
  size = 128;
  if (region < 0) return 0u;
  const ivec3 leaf = voxel >> 3 & 15, group = leaf >> 2;
  const uint first = uint(region) * 4098u, bit = uint(group.x * 16 + group.y * 4 + group.z);
  size = 32;
  if ((texelFetch(blocker_leaves, int(first + (bit >> 5u))).x >> (bit & 31u) & 1u) == 0u) return 0u;
  const uint word = texelFetch(blocker_leaves, int(first) + 2 + leaf.x * 256 + leaf.y * 16 + leaf.z).x;
  size = 8;
  if ((word & 0x80000000u) != 0u) return word & 0xffffu;
  size = 1;
  const ivec3 v = voxel & 7;
  const uint index = uint(v.x * 64 + v.y * 8 + v.z);
  return texelFetch(blocker_codes, int(word * 256u + (index >> 1u))).x >> ((index & 1u) * 16u) & 0xffffu;
}

/// Whether a ray from the origin meets the shape whose voxel's corner is there. What it starts on it doesn't meet.
bool meets_shape(uint first, vec3 corner, vec3 direction) {
  const uint end = first + faces_of_shape(first);
  for (uint face = first; face < end; ++face)
    if (meet(shape_face(face), corner, direction) > 1e-3) return true;
  return false;
}

bool beyond_blockers(ivec3 region) {
  return any(lessThan(region, blockers_low.xyz)) || any(greaterThan(region, blockers_high.xyz));
}

/// Regions have a loop of their own, as in grid.glsl.h.
vec3 sun_let_through(const ivec3 start, const vec3 fraction) {
  const vec3 direction = picture.sun.xyz, inverse = 1.0 / direction;
  const bvec3 up = greaterThanEqual(direction, vec3(0));
  ivec3 voxel = start, region = voxel >> 7;
  int axis = -1;
  uint medium = 0u;
  float t = 0.0, last = 0.0;
  vec3 through = vec3(1);
  bool ended = false;
  for (int regions = 0; !ended && regions < 8192; ++regions) {
    const int place = find_blocker_region(region);
    for (int steps = 0; steps < 8192; ++steps) {
      int size;
      uint code = blocker_at(voxel, place, size);
      bool hidden = code == kBlockerCube && axis >= 0;
      if (code >= kShapeCode) {
        hidden = meets_shape(code - kShapeCode, vec3(voxel - start) - fraction, direction);
        size = 1;
      }
      if (code >= kBlockerCube) code = 0u;
      if (code != medium && axis >= 0) {
        through *= absorbed_along(blocker_kinds[medium].absorption.xyz, t - last);
        last = t;
        // Kinds are in the order of ids. The sun's direction is the one that it has in air.
        through *= interface_shares(blocker_kinds[max(code, medium)], 1.0, blocker_kinds[medium].absorption.w,
                                    blocker_kinds[code].absorption.w, abs(direction[axis]))
                       .passed;
      }
      if (hidden || all(lessThan(through, vec3(1e-4)))) {
        through = vec3(0);
        ended = true;
        break;
      }
      medium = code;
      // Leave the cube by the nearest of its planes ahead.
      const ivec3 low = voxel & ivec3(-size), planes = low + mix(ivec3(0), ivec3(size), up);
      vec3 crossings = (vec3(planes - start) - fraction) * inverse;
      crossings = mix(crossings, vec3(1e30), equal(direction, vec3(0)));
      axis = crossings.x <= crossings.y ? (crossings.x <= crossings.z ? 0 : 2) : (crossings.y <= crossings.z ? 1 : 2);
      t = max(crossings[axis], t);
      voxel = clamp(start + ivec3(floor(fraction + t * direction)), low, low + (size - 1));
      voxel[axis] = up[axis] ? planes[axis] : planes[axis] - 1;
      if (voxel >> 7 != region) break;
    }
    region = voxel >> 7;
    // Out of all regions it is in the air, once it has left what it was in.
    if (medium == 0u && beyond_blockers(region)) break;
  }
  return through * absorbed_along(blocker_kinds[medium].absorption.xyz, 1e30);
}

#endif
