/* Round stones, with dark joints. */
#ifndef LOAM_RENDER_TEXTURES_COBBLE_SHARED_H
#define LOAM_RENDER_TEXTURES_COBBLE_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float cobble_texture(vec2 p, uint seed) {
  TextureCell c = texture_cell(p, 4, seed);
  float edge = c.second - c.nearest;
  float joint = clamp(1.0f - edge * 6.0f, 0.0f, 1.0f);
  return 0.5f * (c.value - 0.5f) - 0.9f * joint + 0.25f * texture_fractal(p, 8, 2, seed + 1u);
}

SHARED_NAMESPACE_END
#endif
