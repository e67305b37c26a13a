/* Mineral grains: noise of all sizes, and single grains that stand out. */
#ifndef LOAM_RENDER_TEXTURES_SPECKLE_SHARED_H
#define LOAM_RENDER_TEXTURES_SPECKLE_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float speckle_texture(vec2 p, uint seed) {
  float grains = texture_random(int(floor(p.x * 32.0f)), int(floor(p.y * 32.0f)), 32, seed + 3u);
  return 0.8f * texture_fractal(p, 4, 4, seed) + (grains > 0.9f ? 0.45f : grains < 0.1f ? -0.45f : 0.0f);
}

SHARED_NAMESPACE_END
#endif
