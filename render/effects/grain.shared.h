/* Grain of film: each pixel and band a little brighter or darker, most in middle tones, not at all in black and white;
 * the mean stays. A function of (seed, pixel of the whole picture, band) alone.
 *
 * knobs   grain: standard deviation at a display value of 1/2; grain_seed
 * error   zero in the mean but where it is cut off at black
 * source  E. W. H. Selwyn. A Theory of Graininess. 1935 (grains in proportion to what is developed: variance x (1 -
 * x)); Mark Jarzynski, Marc Olano. Hash Functions for GPU Rendering. 2020 (pcg3d) */
#ifndef LOAM_RENDER_EFFECTS_GRAIN_SHARED_H
#define LOAM_RENDER_EFFECTS_GRAIN_SHARED_H
#include "render/effects/effect.shared.h"

SHARED_NAMESPACE(render)

SHARED uvec3 pcg3d(uvec3 v) {
  v = v * 1664525u + 1013904223u;
  v.x += v.y * v.z, v.y += v.z * v.x, v.z += v.x * v.y;
  v = v ^ (v >> 16u);
  v.x += v.y * v.z, v.y += v.z * v.x, v.z += v.x * v.y;
  return v;
}

/* Mean 0, variance 1, within +-2.45: a sum of two uniform numbers. */
SHARED float noise_of(uint bits) {
  return (float(bits >> 16u) + float(bits & 0xffffu) - 65535.0f) * (2.4494897f / 65535.0f);
}

SHARED vec3 grain_at(EFFECT_SOURCE EFFECT_UNUSED ivec2 pixel, vec3 colour) {
  uvec3 bits = pcg3d(uvec3(uint(pixel.x + int(f.window.x)), uint(pixel.y + int(f.window.y)), f.grain.x));
  vec3 shown = min(max(colour * f.window.z, vec3(0.0f)), vec3(1.0f));
  vec3 size = 2.0f * f.strength.w * sqrt(shown * (1.0f - shown));
  vec3 noise = vec3(noise_of(bits.x), noise_of(bits.y), noise_of(bits.z));
  return max(colour + size * noise * f.window.w, min(colour, vec3(0.0f)));
}

SHARED_NAMESPACE_END
#endif
