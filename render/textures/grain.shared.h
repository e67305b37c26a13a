/* Bark and other matter that runs upright, with dark furrows. */
#ifndef LOAM_RENDER_TEXTURES_GRAIN_SHARED_H
#define LOAM_RENDER_TEXTURES_GRAIN_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float grain_texture(vec2 p, uint seed) {
  float bent = p.x + 0.05f * texture_noise(vec2(p.x * 4.0f, p.y * 4.0f), 4, seed + 5u);
  float furrow = texture_noise(vec2(bent * 16.0f, p.y * 4.0f), 16, seed);
  return (furrow < -0.35f ? -0.6f : 0.0f) + 0.5f * furrow + 0.2f * texture_fractal(p, 16, 2, seed + 1u);
}

SHARED_NAMESPACE_END
#endif
