#include "world/gen/noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "world/gen/noise.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef LOAM_WORLD_GEN_NOISE_ONCE
#define LOAM_WORLD_GEN_NOISE_ONCE
namespace world {
namespace noise {

/// Length sqrt(2), every 22.5 degrees, in 1/4096: round(4096 * sqrt(2) * cos and sin). The largest noise is then 1.
constexpr int16_t kGradients2[16][2] = {{5793, 0},  {5352, 2217},   {4096, 4096},   {2217, 5352},
                                        {0, 5793},  {-2217, 5352},  {-4096, 4096},  {-5352, 2217},
                                        {-5793, 0}, {-5352, -2217}, {-4096, -4096}, {-2217, -5352},
                                        {0, -5793}, {2217, -5352},  {4096, -4096},  {5352, -2217}};
/// From the centre of a cube to its twelve edges; four are listed twice to make sixteen.
constexpr int8_t kGradients3[16][3] = {{1, 1, 0},  {-1, 1, 0},  {1, -1, 0}, {-1, -1, 0}, {1, 0, 1},  {-1, 0, 1},
                                       {1, 0, -1}, {-1, 0, -1}, {0, 1, 1},  {0, -1, 1},  {0, 1, -1}, {0, -1, -1},
                                       {1, 1, 0},  {0, -1, 1},  {-1, 1, 0}, {0, -1, -1}};

/// Finaliser of MurmurHash3 (Austin Appleby. 2011): each input bit reaches each output bit.
constexpr uint32_t mix32(uint32_t h) {
  h = (h ^ (h >> 16)) * 0x85ebca6bu;
  h = (h ^ (h >> 13)) * 0xc2b2ae35u;
  return h ^ (h >> 16);
}
/// 0..15: which gradient a corner has.
constexpr uint32_t corner(uint64_t seed, int64_t cx, int64_t cy, int64_t cz) {
  const uint32_t h = static_cast<uint32_t>(cx) * 0x8da6b343u ^ static_cast<uint32_t>(cy) * 0xd8163841u ^
                     static_cast<uint32_t>(cz) * 0xcb1ab31fu ^ static_cast<uint32_t>(seed >> 32);
  return mix32(mix32(h) + static_cast<uint32_t>(seed)) >> 28;
}

/// 6t^5 - 15t^4 + 10t^3 for t in [0, 4096].
constexpr int32_t fade(int32_t t) {
  const int32_t cubed = ((t * t) >> 12) * t >> 12;
  return cubed * (((t * (6 * t - 15 * kNoiseOne)) >> 12) + 10 * kNoiseOne) >> 12;
}
constexpr int32_t lerp(int32_t a, int32_t b, int32_t t) { return a + (((b - a) * t) >> 12); }

/// A position as its cell and its fraction in 1/4096.
struct Place {
  int64_t cell;
  int32_t fraction;
};
constexpr Place place(int64_t position, int cell_log2) {
  const int64_t inside = position & ((int64_t{1} << cell_log2) - 1);
  return {position >> cell_log2, static_cast<int32_t>((inside << 12) >> cell_log2)};
}

/// Along z, within one cell, noise is a fade between two straight lines: `low` from the near corners, `high` from the
/// far ones. Each line is value + slope * fraction.
struct Lines {
  int32_t low_value, low_slope, high_value, high_slope;
};

inline Lines lines2(uint64_t seed, Place x, int32_t fade_x, int64_t cz) {
  int32_t value[2], slope[2];
  for (int k = 0; k < 2; ++k) {
    const int16_t* near = kGradients2[corner(seed, x.cell, 0, cz + k)];
    const int16_t* far = kGradients2[corner(seed, x.cell + 1, 0, cz + k)];
    value[k] = lerp((near[0] * x.fraction) >> 12, (far[0] * (x.fraction - kNoiseOne)) >> 12, fade_x);
    slope[k] = lerp(near[1], far[1], fade_x);
  }
  return {value[0], slope[0], value[1], slope[1]};
}

inline Lines lines3(uint64_t seed, Place x, Place y, int32_t fade_x, int32_t fade_y, int64_t cz) {
  int32_t value[2], slope[2];
  for (int k = 0; k < 2; ++k) {
    int32_t values[2][2], slopes[2][2];
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) {
        const int8_t* g = kGradients3[corner(seed, x.cell + i, y.cell + j, cz + k)];
        values[i][j] = g[0] * (x.fraction - i * kNoiseOne) + g[1] * (y.fraction - j * kNoiseOne);
        slopes[i][j] = g[2] * kNoiseOne;
      }
    value[k] = lerp(lerp(values[0][0], values[0][1], fade_y), lerp(values[1][0], values[1][1], fade_y), fade_x);
    slope[k] = lerp(lerp(slopes[0][0], slopes[0][1], fade_y), lerp(slopes[1][0], slopes[1][1], fade_y), fade_x);
  }
  return {value[0], slope[0], value[1], slope[1]};
}

}  // namespace noise
}  // namespace world
#endif

HWY_BEFORE_NAMESPACE();
namespace world {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// At most eight lanes: most cells hold eight or sixteen points, and wider vectors would run half empty.
using Tag = hn::CappedTag<int32_t, 8>;

// Points of one cell, at `inside`, inside + step, ... metres from its near corner.
HWY_INLINE void fill_cell(const noise::Lines& lines, int32_t inside, int32_t step, int cell_log2, int count,
                          int32_t* HWY_RESTRICT out) {
  const Tag d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto one = hn::Set(d, kNoiseOne);
  const auto low_value = hn::Set(d, lines.low_value), low_slope = hn::Set(d, lines.low_slope);
  const auto high_value = hn::Set(d, lines.high_value), high_slope = hn::Set(d, lines.high_slope);
  auto metres = hn::Add(hn::Set(d, inside), hn::Mul(hn::Iota(d, 0), hn::Set(d, step)));
  const auto stride = hn::Set(d, step * lanes);
  for (int i = 0; i < count; i += lanes, metres = hn::Add(metres, stride)) {
    const auto w =
        cell_log2 <= 12 ? hn::ShiftLeftSame(metres, 12 - cell_log2) : hn::ShiftRightSame(metres, cell_log2 - 12);
    const auto low = hn::Add(low_value, hn::ShiftRight<12>(hn::Mul(low_slope, w)));
    const auto high = hn::Add(high_value, hn::ShiftRight<12>(hn::Mul(high_slope, hn::Sub(w, one))));
    const auto cubed = hn::ShiftRight<12>(hn::Mul(hn::ShiftRight<12>(hn::Mul(w, w)), w));
    const auto inner = hn::Sub(hn::Mul(w, hn::Set(d, 6)), hn::Set(d, 15 * kNoiseOne));
    const auto outer = hn::Add(hn::ShiftRight<12>(hn::Mul(w, inner)), hn::Set(d, 10 * kNoiseOne));
    const auto t = hn::ShiftRight<12>(hn::Mul(cubed, outer));
    const auto value = hn::Add(low, hn::ShiftRight<12>(hn::Mul(hn::Sub(high, low), t)));
    if (i + lanes <= count) {
      hn::StoreU(value, d, out + i);
    } else {
      HWY_ALIGN int32_t rest[8];
      hn::Store(value, d, rest);
      for (int k = 0; i + k < count; ++k) out[i + k] = rest[k];
    }
  }
}

// How many of the points from z on lie in z's cell.
HWY_INLINE int points_in_cell(int64_t inside, int step, int cell_log2, int count) {
  const int64_t fit = ((int64_t{1} << cell_log2) - inside + step - 1) / step;
  return fit < count ? static_cast<int>(fit) : count;
}

void Noise2Row(uint64_t seed, int cell_log2, int64_t x, int64_t z, int step, int count, int32_t* out) {
  const noise::Place px = noise::place(x, cell_log2);
  const int32_t fade_x = noise::fade(px.fraction);
  while (count > 0) {
    const int64_t cz = z >> cell_log2, inside = z - (cz << cell_log2);
    const int n = points_in_cell(inside, step, cell_log2, count);
    fill_cell(noise::lines2(seed, px, fade_x, cz), static_cast<int32_t>(inside), step, cell_log2, n, out);
    out += n, count -= n, z += int64_t{n} * step;
  }
}

void Noise3Row(uint64_t seed, int horizontal_log2, int vertical_log2, int64_t x, int64_t y, int64_t z, int step,
               int count, int32_t* out) {
  const noise::Place px = noise::place(x, horizontal_log2), py = noise::place(y, vertical_log2);
  const int32_t fade_x = noise::fade(px.fraction), fade_y = noise::fade(py.fraction);
  while (count > 0) {
    const int64_t cz = z >> horizontal_log2, inside = z - (cz << horizontal_log2);
    const int n = points_in_cell(inside, step, horizontal_log2, count);
    fill_cell(noise::lines3(seed, px, py, fade_x, fade_y, cz), static_cast<int32_t>(inside), step, horizontal_log2, n,
              out);
    out += n, count -= n, z += int64_t{n} * step;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace world
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace world {

HWY_EXPORT(Noise2Row);
HWY_EXPORT(Noise3Row);

void noise2_row(uint64_t seed, int cell_log2, int64_t x, int64_t z, int step, int count, int32_t* out) {
  HWY_DYNAMIC_DISPATCH(Noise2Row)(seed, cell_log2, x, z, step, count, out);
}

void noise3_row(uint64_t seed, int horizontal_log2, int vertical_log2, int64_t x, int64_t y, int64_t z, int step,
                int count, int32_t* out) {
  HWY_DYNAMIC_DISPATCH(Noise3Row)(seed, horizontal_log2, vertical_log2, x, y, z, step, count, out);
}

}  // namespace world
#endif
