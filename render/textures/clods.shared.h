/* Earth: crumbs of several sizes. */
#ifndef LOAM_RENDER_TEXTURES_CLODS_SHARED_H
#define LOAM_RENDER_TEXTURES_CLODS_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float clods_texture(vec2 p, uint seed) {
  TextureCell c = texture_cell(p, 8, seed);
  return 0.8f * (c.value - 0.5f) - 0.5f * (c.nearest - 0.4f) + 0.6f * texture_fractal(p, 4, 4, seed + 1u);
}

SHARED_NAMESPACE_END
#endif
