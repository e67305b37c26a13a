/* Vignetting: a picture darkens towards its corners. The natural falloff of a thin lens, cos^4 of the angle from its
 * axis, by the field of view that the picture has; the strength is an exponent, 1 is what a lens without stops does.
 *
 * knobs   vignette >= 0
 * source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, figure 14.10;
 *         Max Reiss. The cos^4 law of illumination. 1945 */
#ifndef LOAM_RENDER_EFFECTS_VIGNETTE_SHARED_H
#define LOAM_RENDER_EFFECTS_VIGNETTE_SHARED_H
#include "render/effects/effect.shared.h"

SHARED_NAMESPACE(render)

SHARED vec3 vignette_at(EFFECT_SOURCE EFFECT_UNUSED ivec2 pixel, vec3 colour) {
  vec2 tangent = from_middle(PASS_FRAME pixel) * f.lens.y; /* half heights are tan of half the field of view */
  return colour * pow(1.0f + dot(tangent, tangent), -2.0f * f.strength.x);
}

SHARED_NAMESPACE_END
#endif
