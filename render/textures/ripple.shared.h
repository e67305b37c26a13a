/* Sand: ripples that the wind made, and grains. */
#ifndef LOAM_RENDER_TEXTURES_RIPPLE_SHARED_H
#define LOAM_RENDER_TEXTURES_RIPPLE_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float ripple_texture(vec2 p, uint seed) {
  float wave = p.y * 4.0f + 0.3f * texture_noise(p * 4.0f, 4, seed + 5u);
  float fine = texture_random(int(floor(p.x * 32.0f)), int(floor(p.y * 32.0f)), 32, seed) - 0.5f;
  return 0.45f * sin(6.2831853f * wave) + 0.7f * fine;
}

SHARED_NAMESPACE_END
#endif
