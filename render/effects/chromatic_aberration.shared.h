/* Lateral chromatic aberration: a lens magnifies each band a little differently, red most, so that edges away from the
 * middle get coloured fringes. Grows linearly with the distance from the axis.
 *
 * knobs   chromatic_aberration: by how much red's picture is larger and blue's smaller than green's
 * error   bilinear between pixels: the two bands are softened by up to half a pixel
 * source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, figure 14.11 */
#ifndef LOAM_RENDER_EFFECTS_CHROMATIC_ABERRATION_SHARED_H
#define LOAM_RENDER_EFFECTS_CHROMATIC_ABERRATION_SHARED_H
#include "render/effects/effect.shared.h"

SHARED_NAMESPACE(render)

SHARED vec3 between_texels(EFFECT_SOURCE vec2 at) {
  vec2 low = floor(at), part = at - low;
  int x = int(low.x), y = int(low.y);
  vec3 upper = mix(texel(EFFECT_PASS x, y), texel(EFFECT_PASS x + 1, y), part.x);
  vec3 lower = mix(texel(EFFECT_PASS x, y + 1), texel(EFFECT_PASS x + 1, y + 1), part.x);
  return mix(upper, lower, part.y);
}

SHARED vec3 chromatic_aberration_at(EFFECT_SOURCE EFFECT_UNUSED ivec2 pixel, vec3 colour) {
  vec2 shift = from_middle(PASS_FRAME pixel) * (f.lens.z * f.strength.y); /* pixels */
  vec2 here = vec2(float(pixel.x), float(pixel.y));
  /* Red of a larger picture comes from nearer the middle. */
  return vec3(between_texels(EFFECT_PASS here - shift).x, colour.y, between_texels(EFFECT_PASS here + shift).z);
}

SHARED_NAMESPACE_END
#endif
