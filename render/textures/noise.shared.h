/* Noise from which textures are made: functions of a place and a seed, which repeat after `period` steps so that tiles
 * meet. Not a kind itself.
 * source  Ken Perlin. An Image Synthesizer. 1985; Steven Worley. A Cellular Texture Basis Function. 1996; the hash:
 *         Mark Jarzynski, Marc Olano. Hash Functions for GPU Rendering. 2020 (pcg) */
#ifndef LOAM_RENDER_TEXTURES_NOISE_SHARED_H
#define LOAM_RENDER_TEXTURES_NOISE_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(render)

SHARED uint texture_hash(uint v) {
  uint state = v * 747796405u + 2891336453u;
  uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
  return (word >> 22u) ^ word;
}

/* Of a step of the lattice, wrapped; in [0, 1). */
SHARED float texture_random(int x, int y, int period, uint seed) {
  uint u = uint((x % period + period) % period), v = uint((y % period + period) % period);
  return float(texture_hash(texture_hash(texture_hash(seed) + u) + v) >> 8) * (1.0f / 16777216.0f);
}

/* Smooth between the steps of a lattice; in [-1, 1]. */
SHARED float texture_noise(vec2 p, int period, uint seed) {
  vec2 base = floor(p), f = p - base;
  f = f * f * (3.0f - 2.0f * f);
  int x = int(base.x), y = int(base.y);
  float a = texture_random(x, y, period, seed), b = texture_random(x + 1, y, period, seed);
  float c = texture_random(x, y + 1, period, seed), d = texture_random(x + 1, y + 1, period, seed);
  return 2.0f * mix(mix(a, b, f.x), mix(c, d, f.x), f.y) - 1.0f;
}

/* Octaves of it, each twice as fine and half as strong, from `period` steps a tile on. */
SHARED float texture_fractal(vec2 p, int period, int octaves, uint seed) {
  float sum = 0.0f, part = 0.5f;
  for (int i = 0; i < octaves; ++i) {
    sum += part * texture_noise(p * float(period), period, seed + uint(i) * 101u);
    part *= 0.5f;
    period *= 2;
  }
  return sum;
}

struct TextureCell {
  float nearest, second; /* distances to the two nearest points, in steps */
  float value;           /* of the nearest, in [0, 1) */
};
SHARED TextureCell texture_cell(vec2 p, int period, uint seed) {
  p *= float(period);
  TextureCell found;
  found.nearest = found.second = 9.0f;
  found.value = 0.0f;
  int x0 = int(floor(p.x)), y0 = int(floor(p.y));
  for (int x = x0 - 1; x <= x0 + 1; ++x)
    for (int y = y0 - 1; y <= y0 + 1; ++y) {
      vec2 at = vec2(float(x), float(y)) +
                vec2(texture_random(x, y, period, seed), texture_random(x, y, period, seed + 7u)) - p;
      float d = sqrt(dot(at, at));
      if (d < found.nearest) {
        found.second = found.nearest;
        found.nearest = d;
        found.value = texture_random(x, y, period, seed + 13u);
      } else if (d < found.second) {
        found.second = d;
      }
    }
  return found;
}

/* Courses of rectangles with a joint between them, each course moved by half of one against the last: what brickwork
 * and boards have in common. x: how far into a joint, 0 or 1; y: of the rectangle, in [0, 1). */
SHARED vec2 texture_courses(vec2 p, int columns, int rows, float joint_u, float joint_v, uint seed) {
  float row = floor(p.y * float(rows)), v = p.y * float(rows) - row;
  float along = p.x * float(columns) + (int(row) % 2 == 1 ? 0.5f : 0.0f);
  float column = floor(along), u = along - column;
  float joint = u < joint_u || v < joint_v ? 1.0f : 0.0f;
  return vec2(joint, texture_random(int(column), int(row), columns * rows, seed));
}

SHARED_NAMESPACE_END
#endif
