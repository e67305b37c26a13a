/* Where along a ray through fog the sun is asked for: shafts of light, and what lies in shadow.
 *
 * From where the ray first comes into a medium to where it leaves the last one, or has met kFogShaftShare of all that
 * scatters towards the eye, the ray is cut into equal pieces; in each, one point stands for it: the sun lights all of
 * the piece as much as that point. Media are integrated over the pieces, so that where nothing hides the sun any number
 * of pieces is exact. The points of neighbouring pixels lie apart, or pieces would show as steps. Written once for C++
 * and GLSL.
 *
 * source  Balazs Toth, Tamas Umenhoffer. Real-time Volumetric Lighting in Participating Media. 2009 (rays that are
 *         shifted from pixel to pixel); the shift: Jorge Jimenez. Next Generation Post Processing in Call of Duty:
 *         Advanced Warfare. 2014, "interleaved gradient noise" */
#ifndef LOAM_RENDER_LIGHT_FOG_SHAFTS_SHARED_H
#define LOAM_RENDER_LIGHT_FOG_SHAFTS_SHARED_H
#include "world/media/medium.shared.h"

SHARED_NAMESPACE(render)

#ifdef __cplusplus
using world::shared::log_one_plus, world::shared::opacity, world::shared::real;
#endif

SHARED_CONST float kFogShaftShare = 0.98f;
SHARED_CONST float kFogShaftFarthest = 1e6f; /* m: what lies beyond is lit as there */
SHARED_CONST int kFogShaftGridSteps = 4;     /* through a density grid, to find where pieces lie */
/* To find where they end: lengths that double from 1 m on, past the farthest, then halvings between the last two. */
SHARED_CONST int kFogShaftDoublings = 20, kFogShaftHalvings = 6;

/* Of each piece before its point, in [0, 1). */
SHARED float fog_shaft_shift(float column, float row) {
  return fract(52.9829189f * fract(0.06711056f * column + 0.00583715f * row));
}

/* Whether the pieces go to the end of the media, which saves the search for a nearer one: where light comes through all
 * of them, and they are about as dense in their first half as in the other. Depths: means of the bands. */
SHARED bool fog_shafts_go_through(real first_half, real total) { return total < 4.0f && first_half < 0.75f * total; }

/* The depth after which they end else; total: that of the whole ray. */
SHARED real fog_shaft_depth(real total) { return -log_one_plus(-kFogShaftShare * opacity(total)); }

SHARED_NAMESPACE_END
#endif
