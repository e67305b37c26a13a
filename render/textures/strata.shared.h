/* Layers of a rock, bent a little. */
#ifndef LOAM_RENDER_TEXTURES_STRATA_SHARED_H
#define LOAM_RENDER_TEXTURES_STRATA_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float strata_texture(vec2 p, uint seed) {
  float bent = p.y + 0.06f * texture_noise(p * 2.0f, 2, seed + 5u);
  float layers = texture_noise(vec2(0.5f, bent * 8.0f), 8, seed);
  return 0.7f * layers + 0.5f * texture_fractal(p, 8, 3, seed + 1u);
}

SHARED_NAMESPACE_END
#endif
