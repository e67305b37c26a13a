/* Maps of the sun around the eye, each over a larger place with larger texels: how a point finds its texels.
 *
 *   frame     u, v across the light and w along it, unit; metres from the corner of a voxel that stays
 *   cascade   covers what lies within `reach` of the eye along u and v; so it covers a ball around the eye, and turning
 *             the eye asks for no new texel
 *   texel     number i along u lies at (i + 0.5) * texel, whatever the eye does; it is kept in slot i modulo the map's
 *             side, so that a moving eye keeps all texels that it still needs
 *   blend     the outer tenth of a cascade goes over into the next one
 *   words     eye u, eye v (m), texels a side, cascades; then of each cascade: texel, reach (m), 0, 0; then depths
 *
 * source  Fan Zhang, Hanqiu Sun, Leilei Xu, Lee Kit Lun. Parallel-Split Shadow Maps for Large-Scale Virtual
 *         Environments. 2006 (the split)
 *         Frank Losasso, Hugues Hoppe. Geometry Clipmaps. 2004 (toroidal update around the eye)
 */
#ifndef LOAM_RENDER_LIGHT_SUN_CASCADES_SHARED_H
#define LOAM_RENDER_LIGHT_SUN_CASCADES_SHARED_H
#include "world/base/shared.h"
SHARED_NAMESPACE(render)

SHARED_CONST int kMostSunCascades = 8;
SHARED_CONST uint kSunCascadeWords = 4u;   /* of a cascade, after as many of all */
SHARED_CONST uint kSunCascadeDepths = 64u; /* where depths begin */

/// How much of the next cascade a point shows at this distance from the eye along u or v.
SHARED float sun_cascade_blend(float distance, float reach) {
  return clamp((distance / reach - 0.9f) * 10.0f, 0.0f, 1.0f);
}

/// A texel's place among the depths; `side`: a power of two.
SHARED uint sun_cascade_slot(int cascade, int x, int y, int side) {
  return kSunCascadeDepths + (uint(cascade) * uint(side) + uint(y & (side - 1))) * uint(side) + uint(x & (side - 1));
}

SHARED_NAMESPACE_END
#endif
