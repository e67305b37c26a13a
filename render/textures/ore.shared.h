/* A rock with pieces of something else that shine out of it. */
#ifndef LOAM_RENDER_TEXTURES_ORE_SHARED_H
#define LOAM_RENDER_TEXTURES_ORE_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float ore_texture(vec2 p, uint seed) {
  TextureCell c = texture_cell(p, 4, seed);
  float rock = 0.35f * texture_fractal(p, 8, 3, seed + 1u);
  return c.nearest < 0.33f && c.value > 0.35f ? 0.9f - c.nearest : rock - 0.2f;
}

SHARED_NAMESPACE_END
#endif
