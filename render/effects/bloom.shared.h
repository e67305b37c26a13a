/* Bloom: a lens diffuses a part of the light that enters it, which shows around what is bright. That part is taken from
 * its pixel and spread by a sum of three Gaussians of equal weight, whose widths are 1, 1/4 and 1/16 of the radius: so
 * light falls off about as the square of the distance, with a sharp core. What is spread equals what is taken.
 *
 *   out = in + bloom (sum of lobes / 3 - bright(in)),   bright(c) = c max(0, m - threshold) / m,  m = largest band of c
 *
 * knobs   bloom 0..1; bloom_radius: standard deviation of the widest lobe over the picture's height; bloom_threshold,
 *         in white; bloom_levels: how often a picture may be halved before a lobe is blurred. 0 is the kernel itself
 * error   of halvings: tools/bench/subjects/bloom_levels.cpp. Kernels end at four standard deviations (6e-5 of the
 *         light) and are scaled to a sum of 1
 * source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.10.5;
 *         Greg Spencer, Peter Shirley, Kurt Zimmerman, Donald Greenberg. Physically-Based Glare Effects for Digital
 *         Images. 1995 (a sharp core and wide tails); Masaki Kawase. Frame Buffer Postprocessing Effects in DOUBLE-
 *         S.T.E.A.L. 2003 (a sum of Gaussians, from smaller pictures); Ken Turkowski. Incremental Computation of the
 *         Gaussian. GPU Gems 3, 2007 */
#ifndef LOAM_RENDER_EFFECTS_BLOOM_SHARED_H
#define LOAM_RENDER_EFFECTS_BLOOM_SHARED_H
#include "render/effects/effect.shared.h"

SHARED_NAMESPACE(render)

/* One step of making a lobe: from a level, or the picture itself, to another place of the same buffer. */
struct BloomStep {
  int from; /* first number of the level read; -1: the picture, of which what is bright */
  int from_width, from_height;
  int to; /* first number of the level written */
  int to_width, to_height;
  uint kind;
  float sigma; /* pixels of the level; of blurring */
};
SHARED_CONST uint kBloomHalve = 0u, kBloomRows = 1u, kBloomColumns = 2u;

SHARED vec3 bright_part(EFFECT_FRAME vec3 c) {
  float most = max(c.x, max(c.y, c.z));
  return most > f.bloom.x ? c * ((most - f.bloom.x) / most) : vec3(0.0f);
}

SHARED vec3 bloom_texel(EFFECT_SOURCE SHARED_IN(BloomStep) step, int x, int y) {
  if (step.from < 0) return bright_part(PASS_FRAME texel(EFFECT_PASS x, y));
  x = min(max(x, 0), step.from_width - 1), y = min(max(y, 0), step.from_height - 1);
  int at = step.from + 3 * (y * step.from_width + x);
  return vec3(EFFECT_BLURRED(at), EFFECT_BLURRED(at + 1), EFFECT_BLURRED(at + 2));
}

/* 1 3 3 1 along both axes: a texel lies in the middle of four. */
SHARED vec3 bloom_halved(EFFECT_SOURCE SHARED_IN(BloomStep) step, int x, int y) {
  vec3 sum = vec3(0.0f);
  for (int j = 0; j < 4; ++j) {
    int row = 2 * y - 1 + j;
    vec3 inner = bloom_texel(EFFECT_PASS step, 2 * x, row) + bloom_texel(EFFECT_PASS step, 2 * x + 1, row);
    vec3 outer = bloom_texel(EFFECT_PASS step, 2 * x - 1, row) + bloom_texel(EFFECT_PASS step, 2 * x + 2, row);
    sum += (j == 1 || j == 2 ? 3.0f : 1.0f) * (3.0f * inner + outer);
  }
  return sum * (1.0f / 64.0f);
}

SHARED int bloom_reach(float sigma) { return int(ceil(4.0f * sigma)); }

SHARED vec3 bloom_blurred(EFFECT_SOURCE SHARED_IN(BloomStep) step, int x, int y) {
  int dx = step.kind == kBloomRows ? 1 : 0, dy = 1 - dx, reach = bloom_reach(step.sigma);
  /* exp(-n^2 / (2 sigma^2)) from one n to the next by two products. */
  float inverse = 1.0f / (step.sigma * step.sigma);
  float weight = 1.0f, ratio = exp(-0.5f * inverse), faster = ratio * ratio;
  vec3 sum = bloom_texel(EFFECT_PASS step, x, y);
  float all = 1.0f;
  for (int n = 1; n <= reach; ++n) {
    weight *= ratio, ratio *= faster;
    sum += weight * (bloom_texel(EFFECT_PASS step, x + n * dx, y + n * dy) +
                     bloom_texel(EFFECT_PASS step, x - n * dx, y - n * dy));
    all += 2.0f * weight;
  }
  return sum / all;
}

SHARED vec3 bloom_made(EFFECT_SOURCE SHARED_IN(BloomStep) step, int x, int y) {
  return step.kind == kBloomHalve ? bloom_halved(EFFECT_PASS step, x, y) : bloom_blurred(EFFECT_PASS step, x, y);
}

SHARED vec3 blurred_texel(EFFECT_SOURCE ivec4 lobe, int x, int y) {
  int at = lobe.x + 3 * (min(max(y, 0), lobe.z - 1) * lobe.y + min(max(x, 0), lobe.y - 1));
  return vec3(EFFECT_BLURRED(at), EFFECT_BLURRED(at + 1), EFFECT_BLURRED(at + 2));
}

/* A lobe at the middle of a pixel, bilinear. */
SHARED vec3 lobe_at(EFFECT_SOURCE ivec4 lobe, ivec2 pixel) {
  if (lobe.w == 0 && f.lobe_map.x == 1.0f && f.lobe_map.y == 0.0f && f.lobe_map.z == 0.0f)
    return blurred_texel(EFFECT_PASS lobe, pixel.x, pixel.y);
  float scale = f.lobe_map.x / float(1 << lobe.w);
  vec2 at = (vec2(float(pixel.x) + f.lobe_map.y, float(pixel.y) + f.lobe_map.z) + 0.5f) * scale - 0.5f;
  vec2 low = floor(at), part = at - low;
  int x = int(low.x), y = int(low.y);
  vec3 upper = mix(blurred_texel(EFFECT_PASS lobe, x, y), blurred_texel(EFFECT_PASS lobe, x + 1, y), part.x);
  vec3 lower = mix(blurred_texel(EFFECT_PASS lobe, x, y + 1), blurred_texel(EFFECT_PASS lobe, x + 1, y + 1), part.x);
  return mix(upper, lower, part.y);
}

SHARED vec3 bloom_at(EFFECT_SOURCE EFFECT_UNUSED ivec2 pixel, vec3 colour) {
  vec3 spread = vec3(0.0f);
  for (int i = 0; i < kBloomLobes; ++i) spread += lobe_at(EFFECT_PASS f.lobe[i], pixel);
  return colour + f.strength.z * (spread * f.bloom.y - bright_part(PASS_FRAME colour));
}

SHARED_NAMESPACE_END
#endif
