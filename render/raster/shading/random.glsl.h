// The numbers of render/trace/sampler.h, bit for bit, so that a light is sampled where the ray caster samples it.
// 64-bit numbers are (low, high) pairs: no device needs to have them.
#ifndef LOAM_RENDER_RASTER_SHADING_RANDOM_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_RANDOM_GLSL_H

uvec2 sum64(uvec2 a, uvec2 b) {
  uint carry;
  const uint low = uaddCarry(a.x, b.x, carry);
  return uvec2(low, a.y + b.y + carry);
}
uvec2 product64(uvec2 a, uvec2 b) {
  uint high, low;
  umulExtended(a.x, b.x, high, low);
  return uvec2(low, high + a.x * b.y + a.y * b.x);
}
uvec2 shifted64(uvec2 a, uint right) { return uvec2(a.x >> right | a.y << (32u - right), a.y >> right); }

/// world::mix64
uvec2 mix64(uvec2 h) {
  h = product64(h ^ shifted64(h, 30u), uvec2(0x1ce4e5b9u, 0xbf58476du));
  h = product64(h ^ shifted64(h, 27u), uvec2(0x133111ebu, 0x94d049bbu));
  return h ^ shifted64(h, 31u);
}
/// world::hash_combine
uvec2 hash_combine(uvec2 h, uvec2 value) {
  return mix64(sum64(product64(sum64(h, uvec2(1u, 0u)), uvec2(0x7f4a7c15u, 0x9e3779b9u)), value));
}

uint owen_scrambled(uint v, uint seed) {
  v = bitfieldReverse(v);
  v ^= v * 0x3d20adeau;
  v += seed;
  v *= (seed >> 16) | 1u;
  v ^= v * 0x05526c56u;
  v ^= v * 0x53a22864u;
  return bitfieldReverse(v);
}
uint sobol_1(uint index) {
  uint result = 0u;
  for (uint direction = 0x80000000u; index != 0u; index >>= 1, direction ^= direction >> 1)
    if ((index & 1u) != 0u) result ^= direction;
  return result;
}
float unit_float(uint fraction) { return float(fraction >> 8) * (1.0 / 16777216.0); }

/// Of the pixel at hand; main() sets it once.
uvec2 sampler_key;
uvec2 sampler_key_of(uvec2 seed, uvec2 pixel) { return hash_combine(hash_combine(seed, pixel), uvec2(0x10a3u, 0u)); }

/// Sampler::two() of the sample's number.
vec2 sampler_two(uint dimension, uint number, bool independent) {
  if (independent) {
    const uvec2 key = hash_combine(sampler_key, uvec2(number, 0u));
    return vec2(unit_float(hash_combine(key, uvec2(dimension, 0u)).y),
                unit_float(hash_combine(key, uvec2(dimension + 1u, 0u)).y));
  }
  const uvec2 hash = hash_combine(sampler_key, uvec2(dimension, 0u)), more = mix64(sum64(hash, uvec2(1u, 0u)));
  const uint index = owen_scrambled(number, hash.x);
  return vec2(unit_float(owen_scrambled(bitfieldReverse(index), hash.y)),
              unit_float(owen_scrambled(sobol_1(index), more.x)));
}

#endif
