/* Light at a point from that in the eight voxels whose middles lie around it: the formulas of both backends.
 *
 *   place   of the point among the middles, 0..1 on each axis; voxel i is at (i & 1, i >> 1 & 1, i >> 2)
 *   clear   bit i: voxel i has light of its own, being neither opaque nor otherwise closed to light
 *
 * Light doesn't pass between blocks that touch along an edge or in a corner: a voxel counts only where light gets to it
 * from the point's own through sides of voxels among the eight. Of those the light is linear between the middles:
 *
 *   l(lit) + sum w(i) (l(i) - l(lit)) / sum w(i)     over i reached, lit being the voxel that they are reached from
 *
 * so that what is equal everywhere comes out as it is, bit for bit.
 */
#ifndef LOAM_RENDER_LIGHT_VOXEL_LIGHT_SHARED_H
#define LOAM_RENDER_LIGHT_VOXEL_LIGHT_SHARED_H
#include "world/base/shared.h"
SHARED_NAMESPACE(render)

/// In place of a code: the voxel has no light of its own.
SHARED_CONST uint kLightClosed = 0xfffffffeu;

/// The voxel that holds the point.
SHARED int own_voxel(vec3 place) {
  return (place.x >= 0.5f ? 1 : 0) | (place.y >= 0.5f ? 2 : 0) | (place.z >= 0.5f ? 4 : 0);
}

SHARED float voxel_weight(vec3 place, int i) {
  return ((i & 1) != 0 ? place.x : 1.0f - place.x) * ((i & 2) != 0 ? place.y : 1.0f - place.y) *
         ((i & 4) != 0 ? place.z : 1.0f - place.z);
}

/// The point's own voxel where that is clear, else of those that are the one that weighs most. clear != 0
SHARED int lit_voxel(uint clear, vec3 place) {
  int own = own_voxel(place);
  if ((clear >> uint(own) & 1u) != 0u) return own;
  int best = 0;
  float most = -1.0f;
  for (int i = 0; i < 8; ++i) {
    float weight = voxel_weight(place, i);
    if ((clear >> uint(i) & 1u) != 0u && weight > most) best = i, most = weight;
  }
  return best;
}

/// Those of the clear ones that light gets to from one of them.
SHARED uint reached_voxels(uint clear, int from) {
  uint reached = 1u << uint(from);
  for (int i = 0; i < 4; ++i)  // no way among eight is longer
    reached |= clear & ((reached & 0x55u) << 1 | (reached & 0xaau) >> 1 | (reached & 0x33u) << 2 |
                        (reached & 0xccu) >> 2 | (reached & 0x0fu) << 4 | (reached & 0xf0u) >> 4);
  return reached;
}

SHARED_NAMESPACE_END
#endif
