/* Bricks four courses high, two a course, with light joints. */
#ifndef LOAM_RENDER_TEXTURES_BRICK_SHARED_H
#define LOAM_RENDER_TEXTURES_BRICK_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float brick_texture(vec2 p, uint seed) {
  vec2 course = texture_courses(p, 2, 4, 0.07f, 0.13f, seed);
  return course.x > 0.5f ? 0.75f : 0.7f * (course.y - 0.5f) + 0.3f * texture_fractal(p, 8, 3, seed + 1u) - 0.1f;
}

SHARED_NAMESPACE_END
#endif
