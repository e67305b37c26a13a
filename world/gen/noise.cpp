#include "world/gen/noise.h"

namespace world {

namespace {

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
constexpr uint32_t corner_hash(uint64_t seed, int64_t cx, int64_t cy, int64_t cz) {
  const uint32_t h = static_cast<uint32_t>(cx) * 0x8da6b343u ^ static_cast<uint32_t>(cy) * 0xd8163841u ^
                     static_cast<uint32_t>(cz) * 0xcb1ab31fu ^ static_cast<uint32_t>(seed >> 32);
  return mix32(mix32(h) + static_cast<uint32_t>(seed));
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

/// Evaluates a row, asking for the lines of each cell once.
template <class LinesOfCell>
void row(int cell_log2, int64_t z, int step, int count, int32_t* out, const LinesOfCell& lines_of_cell) {
  for (int i = 0; i < count;) {
    const int64_t cell = (z + int64_t{i} * step) >> cell_log2;
    const int64_t left = ((cell + 1) << cell_log2) - (z + int64_t{i} * step);  // metres to the end of the cell
    const int64_t fit = (left + step - 1) / step;
    const int end = fit < count - i ? i + static_cast<int>(fit) : count;
    const Lines lines = lines_of_cell(cell);
    for (; i < end; ++i) {
      const int32_t w = place(z + int64_t{i} * step, cell_log2).fraction;
      const int32_t low = lines.low_value + ((lines.low_slope * w) >> 12);
      const int32_t high = lines.high_value + ((lines.high_slope * (w - kNoiseOne)) >> 12);
      out[i] = lerp(low, high, fade(w));
    }
  }
}

}  // namespace

void noise2_row(uint64_t seed, int cell_log2, int64_t x, int64_t z, int step, int count, int32_t* out) {
  const auto [cx, u] = place(x, cell_log2);
  const int32_t su = fade(u);
  row(cell_log2, z, step, count, out, [&, cx = cx, u = u](int64_t cz) {
    int32_t value[2], slope[2];
    for (int k = 0; k < 2; ++k) {
      const int16_t* near = kGradients2[corner_hash(seed, cx, 0, cz + k) >> 28];
      const int16_t* far = kGradients2[corner_hash(seed, cx + 1, 0, cz + k) >> 28];
      value[k] = lerp((near[0] * u) >> 12, (far[0] * (u - kNoiseOne)) >> 12, su);
      slope[k] = lerp(near[1], far[1], su);
    }
    return Lines{value[0], slope[0], value[1], slope[1]};
  });
}

void noise3_row(uint64_t seed, int horizontal_log2, int vertical_log2, int64_t x, int64_t y, int64_t z, int step,
                int count, int32_t* out) {
  const auto [cx, u] = place(x, horizontal_log2);
  const auto [cy, v] = place(y, vertical_log2);
  const int32_t su = fade(u), sv = fade(v);
  row(horizontal_log2, z, step, count, out, [&, cx = cx, cy = cy, u = u, v = v](int64_t cz) {
    int32_t value[2], slope[2];
    for (int k = 0; k < 2; ++k) {
      int32_t values[2][2], slopes[2][2];
      for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j) {
          const int8_t* g = kGradients3[corner_hash(seed, cx + i, cy + j, cz + k) >> 28];
          values[i][j] = g[0] * (u - i * kNoiseOne) + g[1] * (v - j * kNoiseOne);
          slopes[i][j] = g[2] * kNoiseOne;
        }
      value[k] = lerp(lerp(values[0][0], values[0][1], sv), lerp(values[1][0], values[1][1], sv), su);
      slope[k] = lerp(lerp(slopes[0][0], slopes[0][1], sv), lerp(slopes[1][0], slopes[1][1], sv), su);
    }
    return Lines{value[0], slope[0], value[1], slope[1]};
  });
}

}  // namespace world
