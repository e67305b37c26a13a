/* Grass from above: short strokes, some dry. */
#ifndef LOAM_RENDER_TEXTURES_BLADES_SHARED_H
#define LOAM_RENDER_TEXTURES_BLADES_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float blades_texture(vec2 p, uint seed) {
  int x = int(floor(p.x * 32.0f)), y = int(floor(p.y * 32.0f));
  float blade = texture_random(x, y / 2, 32, seed) - 0.5f, fine = texture_random(x, y, 32, seed + 3u) - 0.5f;
  return 0.9f * blade + 0.4f * fine + 0.4f * texture_fractal(p, 4, 2, seed + 1u);
}

SHARED_NAMESPACE_END
#endif
