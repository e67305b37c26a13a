/* Roofs: rows of tiles, each darker towards its upper edge. */
#ifndef LOAM_RENDER_TEXTURES_TILES_SHARED_H
#define LOAM_RENDER_TEXTURES_TILES_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float tiles_texture(vec2 p, uint seed) {
  vec2 course = texture_courses(p, 4, 4, 0.1f, 0.08f, seed);
  float v = fract(p.y * 4.0f);
  return course.x > 0.5f ? -0.9f : 0.5f * (course.y - 0.5f) + 0.5f - 0.8f * v;
}

SHARED_NAMESPACE_END
#endif
