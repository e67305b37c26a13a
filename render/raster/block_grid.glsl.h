// Rays through the grid of blocks (render/raster/block_grid.h), and how far one runs within one block.
#ifndef LOAM_RENDER_RASTER_BLOCK_GRID_GLSL_H
#define LOAM_RENDER_RASTER_BLOCK_GRID_GLSL_H
#include "render/raster/transparency.glsl.h"

// Texels: software gathers those for all lanes at once, and loops over lanes for words of storage.
layout(binding = kBindBlockRegions) uniform isamplerBuffer block_regions;
layout(binding = kBindBlockLeaves) uniform usamplerBuffer block_leaves;
layout(binding = kBindBlockIds) uniform usamplerBuffer block_ids;
layout(binding = kBindBlockKinds) uniform usamplerBuffer block_kinds;

uint code_kind(uint code) { return texelFetch(block_kinds, int(code)).x; }
/// 1 for a mirror, kKind...Shift
uint code_properties(uint code) { return texelFetch(block_kinds, int(code)).y; }

/// As find_blocker_region() of sun_blockers.glsl.h.
int find_block_region(ivec3 region) {
  const uint last = uint(layers.eye.z);
  for (uint k = 0u, i = region_hash(region.x, region.y, region.z); k <= last; ++k, ++i) {
    const ivec4 entry = texelFetch(block_regions, int(i & last));
    if (entry.w == 0) return -1;
    if (entry.xyz == region) return entry.w - 1;
  }
  return -1;
}

layout(constant_id = kSpecShapeCodes) const bool kShapeCodes = false;

/// Sixteenths that a liquid is high in a voxel of this code; 16: it fills it, or is none.
uint code_level(uint code) {
  if (!kLiquidLevels) return 16u;
  const uint level = code_properties(code) >> kKindLevelShift & 15u;
  return level == 0u ? 16u : level;
}
uint code_block(uint code) { return kLiquidLevels ? code_properties(code) >> kKindBlockShift : code; }

/// The code of a voxel, its block's id but where a liquid ends within it or a shape stands, and the size of the aligned
/// cube around it that is known to be all of that code.
uint block_at(ivec3 voxel, int region, out int size) {
  size = 128;
  if (region < 0) return 0u;
  const ivec3 leaf = voxel >> 3 & 15, group = leaf >> 2;
  const uint first = uint(region) * 4098u, bit = uint(group.x * 16 + group.y * 4 + group.z);
  size = 32;
  if ((texelFetch(block_leaves, int(first + (bit >> 5u))).x >> (bit & 31u) & 1u) == 0u) return 0u;
  const uint word = texelFetch(block_leaves, int(first) + 2 + leaf.x * 256 + leaf.y * 16 + leaf.z).x;
  size = 8;
  if ((word & kBlockUniform) != 0u) return word & 0xffffu;
  size = 1;
  const ivec3 v = voxel & 7;
  const uint index = uint(v.x * 64 + v.y * 8 + v.z);
  return texelFetch(block_ids, int(word * 256u + (index >> 1u))).x >> ((index & 1u) * 16u) & 0xffffu;
}

/// A walk from a point of a voxel. Distances are relative to that start; each crossing follows from its integer plane.
struct BlockWalk {
  ivec3 start, voxel, region;
  vec3 fraction, direction;  // unit, so that t is in m
  int place;                 // of the region
  float t;
  int axis;    // of the last crossing; -1 at the start
  uint level;  // of the liquid's top in the voxel that was crossed last, in sixteenths; 0: a plane of the grid
};

BlockWalk begin_walk(ivec3 voxel, vec3 fraction, vec3 direction) {
  BlockWalk w;
  w.start = w.voxel = voxel;
  w.region = voxel >> 7;
  w.fraction = fraction;
  w.direction = direction;
  w.place = find_block_region(w.region);
  w.t = 0.0;
  w.axis = -1;
  w.level = 0u;
  return w;
}

/// Leaves the aligned cube of this size around the voxel. The voxel may then lie in another region: enter_region().
void leave_cube(inout BlockWalk w, int size) {
  const bvec3 up = greaterThanEqual(w.direction, vec3(0));
  const ivec3 low = w.voxel & ivec3(-size);
  const ivec3 planes = low + mix(ivec3(0), ivec3(size), up);
  vec3 t = (vec3(planes - w.start) - w.fraction) / w.direction;
  t = mix(t, vec3(1e30), equal(w.direction, vec3(0)));
  w.axis = t.x <= t.y ? (t.x <= t.z ? 0 : 2) : (t.y <= t.z ? 1 : 2);
  w.level = 0u;
  w.t = max(t[w.axis], w.t);
  w.voxel = clamp(w.start + ivec3(floor(w.fraction + w.t * w.direction)), low, low + (size - 1));
  w.voxel[w.axis] = up[w.axis] ? planes[w.axis] : planes[w.axis] - 1;
}
bool left_region(BlockWalk w) { return w.voxel >> 7 != w.region; }
/// False: out of all regions. Walks have a loop for regions around that for their steps, as in shading/grid.glsl.h.
bool enter_region(inout BlockWalk w) {
  const ivec3 next = w.voxel >> 7;
  if (any(lessThan(next, layers.region_min.xyz)) || any(greaterThan(next, layers.region_max.xyz))) {
    // Outside: on only while the ray may still come in, and into the air out there.
    const bvec3 up = greaterThanEqual(w.direction, vec3(0));
    const bvec3 away = bvec3((next.x < layers.region_min.x && !up.x) || (next.x > layers.region_max.x && up.x),
                             (next.y < layers.region_min.y && !up.y) || (next.y > layers.region_max.y && up.y),
                             (next.z < layers.region_min.z && !up.z) || (next.z > layers.region_max.z && up.z));
    if (any(away) && w.place < 0) return false;
  }
  w.region = next;
  w.place = find_block_region(next);
  return true;
}

/// A walk in a voxel whose liquid ends within it.
struct LiquidTop {
  float t;             // where the walk crosses it; 1e30: it runs level
  bool ahead, liquid;  // not yet; the walk is in the liquid
};
LiquidTop liquid_top(BlockWalk w, uint level) {
  LiquidTop top;
  const float height = float(w.voxel.y - w.start.y) + float(level) / 16.0 - w.fraction.y, up = w.direction.y;
  top.t = up == 0.0 ? 1e30 : height / up;
  // In the order of (t, axis).
  const bool crossed = w.level != 0u || top.t < w.t || (top.t == w.t && w.axis != 0);
  top.liquid = up == 0.0 ? height > 0.0 : crossed != (up > 0.0);
  top.ahead = !crossed;
  return top;
}
/// Crosses it, where that comes before the voxel's end.
bool cross_top(inout BlockWalk w, LiquidTop top, uint level) {
  if (!top.ahead) return false;
  BlockWalk next = w;
  leave_cube(next, 1);
  if (!(top.t < next.t || (top.t == next.t && next.axis != 0))) return false;
  w.t = max(top.t, w.t);
  w.axis = 1;
  w.level = level;
  return true;
}

/// The point of the last crossing, seen from the side the walk comes from.
FacePoint crossed_point(BlockWalk w, uint block) {
  FacePoint p;
  const bool up = w.direction[w.axis] >= 0.0;
  p.block = block;
  p.face = 2u * uint(w.axis) + (up ? 0u : 1u);
  p.front = w.voxel;
  p.front[w.axis] += up ? -1 : 1;
  p.fraction = clamp(w.fraction + w.t * w.direction - vec3(p.front - w.start), vec3(0), vec3(1));
  p.fraction[w.axis] = up ? 1.0 : 0.0;
  if (kLiquidLevels && w.level != 0u) {
    // As a face of the voxel's upper side.
    p.front = w.voxel + ivec3(0, 1, 0);
    p.fraction.y = 0.0;
  }
  p.layer = p.bare = false;
  p.level = w.level;
  p.to_eye = -w.direction;
  p.step_x = p.step_y = vec3(0);
  return p;
}

/// How far a ray runs from a point of a voxel until the kind changes, m.
float run_length(ivec3 voxel, vec3 fraction, vec3 direction, uint kind) {
  BlockWalk w = begin_walk(voxel, fraction, direction);
  bool inside = true, ended = false;
  for (int regions = 0; inside && !ended && regions < 4096; ++regions) {
    for (int steps = 0; steps < 4096; ++steps) {
      int size;
      const uint code = block_at(w.voxel, w.place, size);
      const uint level = code_level(code);
      if (kLiquidLevels && level < 16u) {
        const LiquidTop top = liquid_top(w, level);
        ended = (top.liquid ? code_kind(code) : 0u) != kind || cross_top(w, top, level);
        size = 1;
      } else {
        ended = code_kind(code) != kind;
      }
      if (ended) break;
      leave_cube(w, size);
      if (left_region(w)) break;
    }
    if (!ended) inside = enter_region(w);
  }
  return ended ? w.t : 1e30;
}

#endif
