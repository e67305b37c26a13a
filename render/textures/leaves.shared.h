/* Leaves in clumps, with gaps of shade. */
#ifndef LOAM_RENDER_TEXTURES_LEAVES_SHARED_H
#define LOAM_RENDER_TEXTURES_LEAVES_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float leaves_texture(vec2 p, uint seed) {
  TextureCell c = texture_cell(p, 8, seed);
  float clump = texture_fractal(p, 4, 2, seed + 1u);
  return 0.9f * (c.value - 0.5f) - (c.nearest > 0.62f ? 0.7f : 0.0f) + 0.5f * clump;
}

SHARED_NAMESPACE_END
#endif
