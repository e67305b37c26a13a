/* Boards four to a metre, with dark gaps and long grain. */
#ifndef LOAM_RENDER_TEXTURES_PLANKS_SHARED_H
#define LOAM_RENDER_TEXTURES_PLANKS_SHARED_H
#include "render/textures/noise.shared.h"

SHARED_NAMESPACE(render)

SHARED float planks_texture(vec2 p, uint seed) {
  vec2 course = texture_courses(p, 1, 4, 0.02f, 0.07f, seed);
  float grain = texture_noise(vec2(p.x * 4.0f, p.y * 32.0f), 32, seed + 1u);
  return course.x > 0.5f ? -0.9f : 0.6f * (course.y - 0.5f) + 0.35f * grain;
}

SHARED_NAMESPACE_END
#endif
