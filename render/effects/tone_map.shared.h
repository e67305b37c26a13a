/* Tone mapping: how radiance beyond what a display can show is pressed into it.
 *
 *   clamp     nothing: the display cuts off what is above white
 *   reinhard  x (1 + x / w^2) / (1 + x) of luminance, w = 4: only what is four times white is white
 *   filmic    a film's curve with toe and shoulder, each band by itself, so that bright colours whiten
 *
 * knobs   tone_map
 * source  Erik Reinhard, Michael Stark, Peter Shirley, James Ferwerda. Photographic Tone Reproduction for Digital
 *         Images. 2002, equation 4; Krzysztof Narkowicz. ACES Filmic Tone Mapping Curve. 2016 (a fit of the ACES
 *         reference rendering transform, with its exposure of 0.6) */
#ifndef LOAM_RENDER_EFFECTS_TONE_MAP_SHARED_H
#define LOAM_RENDER_EFFECTS_TONE_MAP_SHARED_H
#include "render/effects/effect.shared.h"

SHARED_NAMESPACE(render)

SHARED_CONST uint kToneClamp = 0u, kToneReinhard = 1u, kToneFilmic = 2u;

SHARED float filmic_curve(float x) {
  x = 0.6f * max(x, 0.0f);
  /* Tends to 2.51 / 2.43 for large x; those that overflow when squared are there already. */
  x = min(x, 1e6f);
  return min(x * (2.51f * x + 0.03f) / (x * (2.43f * x + 0.59f) + 0.14f), 1.0f);
}

SHARED float reinhard_curve(float x) { return x * (1.0f + x / 16.0f) / (1.0f + x); }

/* Of display values: 1 is white. */
SHARED vec3 tone_mapped(uint curve, vec3 c) {
  if (curve == kToneFilmic) return vec3(filmic_curve(c.x), filmic_curve(c.y), filmic_curve(c.z));
  if (curve == kToneReinhard) {
    float bright = luminance(c);
    return bright > 0.0f ? c * (reinhard_curve(bright) / bright) : vec3(0.0f);
  }
  return c;
}

SHARED vec3 tone_map_at(EFFECT_SOURCE EFFECT_UNUSED ivec2 pixel, vec3 colour) {
  return tone_mapped(EFFECT_TONE_CURVE, colour * f.window.z) * f.window.w;
}

SHARED_NAMESPACE_END
#endif
