/* Cloth: threads that pass over and under each other. */
#ifndef LOAM_RENDER_TEXTURES_WEAVE_SHARED_H
#define LOAM_RENDER_TEXTURES_WEAVE_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float weave_texture(vec2 p, uint seed) {
  int x = int(floor(p.x * 16.0f)), y = int(floor(p.y * 16.0f));
  vec2 f = fract(p * 16.0f) - 0.5f;
  float over = (x + y) % 2 == 0 ? 1.0f - 2.5f * f.y * f.y : 0.55f - 2.5f * f.x * f.x;
  return over - 0.6f + 0.4f * (texture_random(x, y, 16, seed) - 0.5f);
}

SHARED_NAMESPACE_END
#endif
