/// Gradient noise in fixed point: the same bits on every machine, compiler and SIMD level, at any coordinate.
///
/// A lattice of cells of 2^k metres; each corner has a gradient chosen by a hash of (seed, corner); between corners a
/// fifth-degree fade. Values and fractions are in units of 1/4096 (kNoiseOne is 1.0); shifts round down.
///
/// range     |noise| <= 1.05 * kNoiseOne; zero at every lattice corner
/// gradient  a step of s metres along an axis changes it by at most 9 * s / cell (tests hold it, at any coordinate)
/// fails     never: positions are 64-bit, corners wrap modulo 2^32 cells
/// source    Ken Perlin. Improving Noise. 2002 (fade, and the 12 edge gradients in 3-D)
#pragma once

#include <cstdint>

namespace world {

constexpr int32_t kNoiseOne = 4096;

/// out[i] = noise at (x, z + i * step), i in [0, count). A row costs little more than its points: the corners of a
/// cell are visited once. step > 0; 1 <= cell_log2 <= 24.
void noise2_row(uint64_t seed, int cell_log2, int64_t x, int64_t z, int step, int count, int32_t* out);

/// Cells may be flatter than wide: 2^horizontal_log2 in x and z, 2^vertical_log2 in y.
void noise3_row(uint64_t seed, int horizontal_log2, int vertical_log2, int64_t x, int64_t y, int64_t z, int step,
                int count, int32_t* out);

inline int32_t noise2(uint64_t seed, int cell_log2, int64_t x, int64_t z) {
  int32_t value;
  noise2_row(seed, cell_log2, x, z, 1, 1, &value);
  return value;
}
inline int32_t noise3(uint64_t seed, int horizontal_log2, int vertical_log2, int64_t x, int64_t y, int64_t z) {
  int32_t value;
  noise3_row(seed, horizontal_log2, vertical_log2, x, y, z, 1, 1, &value);
  return value;
}

}  // namespace world
