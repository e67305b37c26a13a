/* Cast stone and plaster: almost even, with pores. */
#ifndef LOAM_RENDER_TEXTURES_CONCRETE_SHARED_H
#define LOAM_RENDER_TEXTURES_CONCRETE_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float concrete_texture(vec2 p, uint seed) {
  float pore = texture_random(int(floor(p.x * 32.0f)), int(floor(p.y * 32.0f)), 32, seed);
  return 0.6f * texture_fractal(p, 2, 4, seed + 1u) - (pore > 0.96f ? 0.8f : 0.0f);
}

SHARED_NAMESPACE_END
#endif
