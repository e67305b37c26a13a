/* Light on a voxel's face from what is known on it and around it in its plane: the formulas of both backends.
 *
 *   cells   3 x 3 voxels before the plane of the face, the face's own in the middle: index (u + 1) + 3 (v + 1)
 *   known   bit i: light is known there
 *   open    bit i: the voxel is not opaque, and so doesn't hide the sky from the face's corner
 *   at      place on the face, 0..1 along its axes u and v (light_axes)
 *
 * A corner of the face lies between four cells. The one across it counts only where one of the two beside is there,
 * since light doesn't pass between two blocks that touch along an edge.
 */
#ifndef LOAM_RENDER_LIGHT_SURFACE_LIGHT_SHARED_H
#define LOAM_RENDER_LIGHT_SURFACE_LIGHT_SHARED_H
#include "world/base/shared.h"
SHARED_NAMESPACE(render)

/// How light_interpolation says it.
SHARED_CONST uint kLightFace = 0u, kLightVertex = 1u, kLightLinear = 2u;

struct LightCells {
  vec3 value[9];
};

/// Axes u and v of the plane of a face whose normal is `axis`.
SHARED ivec2 light_axes(int axis) { return ivec2(axis == 0 ? 1 : 0, axis == 2 ? 1 : 2); }

/// Cells of the corner (i, j) of the face, i and j 0 or 1: beside it along u, along v, and across.
SHARED ivec3 corner_cells(int i, int j) { return ivec3(3 + 2 * i, 1 + 6 * j, 2 * i + 6 * j); }

SHARED bool has_cell(uint cells, int i) { return (cells >> uint(i) & 1u) != 0u; }

/// Weight of the corner (i, j) at a place.
SHARED float corner_weight(vec2 at, int i, int j) {
  return (i == 1 ? at.x : 1.0f - at.x) * (j == 1 ? at.y : 1.0f - at.y);
}

/// The part of a hemisphere, weighted by cosine, that walls of no end leave open at each corner, and bilinear between:
/// 1, 3/4, 1/2, 1/4 for the four levels of block games.
SHARED float corner_occlusion(uint open, vec2 at) {
  float sum = 0.0f;
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 2; ++i) {
      ivec3 c = corner_cells(i, j);
      bool u = has_cell(open, c.x), v = has_cell(open, c.y);
      float quarters = 1.0f + (u ? 1.0f : 0.0f) + (v ? 1.0f : 0.0f) + ((u || v) && has_cell(open, c.z) ? 1.0f : 0.0f);
      sum += corner_weight(at, i, j) * quarters * 0.25f;
    }
  return sum;
}

/// Means at the corners, bilinear between them. The middle is known.
SHARED vec3 vertex_light(SHARED_IN(LightCells) cells, uint known, vec2 at) {
  vec3 sum = vec3(0.0f);
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 2; ++i) {
      ivec3 c = corner_cells(i, j);
      bool u = has_cell(known, c.x), v = has_cell(known, c.y), across = (u || v) && has_cell(known, c.z);
      vec3 total = cells.value[4];
      float count = 1.0f;
      if (u) total += cells.value[c.x], count += 1.0f;
      if (v) total += cells.value[c.y], count += 1.0f;
      if (across) total += cells.value[c.z], count += 1.0f;
      sum += total * (corner_weight(at, i, j) / count);
    }
  return sum;
}

/// Linear between the middles of the four nearest cells; one that isn't known counts as the face's own.
SHARED vec3 linear_light(SHARED_IN(LightCells) cells, uint known, vec2 at) {
  int i = at.x >= 0.5f ? 1 : 0, j = at.y >= 0.5f ? 1 : 0;
  ivec3 c = corner_cells(i, j);
  bool u = has_cell(known, c.x), v = has_cell(known, c.y), across = (u || v) && has_cell(known, c.z);
  vec3 own = cells.value[4];
  vec3 beside_u = u ? cells.value[c.x] : own, beside_v = v ? cells.value[c.y] : own;
  vec3 beyond = across ? cells.value[c.z] : own;
  float x = abs(at.x - 0.5f), y = abs(at.y - 0.5f);
  return mix(mix(own, beside_u, x), mix(beside_v, beyond, x), y);
}

SHARED_NAMESPACE_END
#endif
