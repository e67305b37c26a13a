/* The effects of a picture in their order: the lens, then the film, then the screen. Which there are is a mask of
 * 1 << EFFECT_<name>; in a shader a constant of the pipeline, so that what is off is not in it. */
#ifndef LOAM_RENDER_EFFECTS_CHAIN_SHARED_H
#define LOAM_RENDER_EFFECTS_CHAIN_SHARED_H
#include "render/effects/effect.shared.h"

#include "render_effects.members.h"

SHARED_NAMESPACE(render)

#define APPLY_EFFECT(name) \
  if ((effects & (1u << EFFECT_##name)) != 0u) colour = name##_at(EFFECT_PASS pixel, colour);

SHARED vec3 effects_at(EFFECT_SOURCE uint effects, ivec2 pixel) {
  vec3 colour = texel(EFFECT_PASS pixel.x, pixel.y);
  APPLY_EFFECT(chromatic_aberration)
  APPLY_EFFECT(bloom)
  APPLY_EFFECT(lens_flare)
  APPLY_EFFECT(vignette)
  APPLY_EFFECT(exposure)
  APPLY_EFFECT(tone_map)
  APPLY_EFFECT(grain)
  return colour;
}

#undef APPLY_EFFECT

SHARED_NAMESPACE_END
#endif
