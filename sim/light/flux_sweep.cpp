#include "sim/light/flux_sweep.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <type_traits>

#include "world/base/jobs.h"
#include "world/scenes/sky.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/light/flux_sweep.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef LOAM_FLUX_SWEEP_ONCE
#define LOAM_FLUX_SWEEP_ONCE
namespace sim {

constexpr int kChunk = 8;  // directions that a walk along a row carries in registers
constexpr int kChunkFloats = 4 * kChunk;

/// The ordinates of one octant and the light under way along them.
///
/// values  [directions][4]; an even number of directions, the last one without weight where the set's is odd
struct FluxSweep::Octant {
  int signs = 0;  // bit a: towards the negative side of axis a
  int directions = 0;
  int floats = 0;               // 4 * directions
  AlignedFloats share[3];       // |O_a| / sum |O|
  AlignedFloats carried[3];     // weight * |O_a|: irradiance of a wall by radiance
  AlignedFloats sky;            // radiance that enters
  AlignedFloats passed, added;  // [kinds][floats] of media: T, q
  AlignedFloats crossed;        // weight * sum |O|
  // Radiance at the last voxels passed: [size.y * 8][size.z * 8][floats], [8][size.z * 8][floats], [8][8][floats].
  AlignedFloats along_x, along_y, along_z;
  FluxTotals totals;

  bool negative(int axis) const { return signs >> axis & 1; }
};

}  // namespace sim
#endif

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Two directions a vector at most: sums over directions are kept for even and odd ones apart, and so have one order.
using Floats = hn::CappedTag<float, 8>;
using F = hn::Vec<Floats>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Floats()));
static_assert(kLanes == 1 || kLanes == 4 || kLanes == 8);

/// Vector number v of the same quad for all directions.
HWY_INLINE F load_quad(const float* quad, int v) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Load(Floats(), quad + (v & 3));
#else
  return (void)v, hn::LoadDup128(Floats(), quad);
#endif
}

/// Adds sum over the directions of weight * radiance to a surface's irradiance.
template <int V>
HWY_INLINE void arrive(const F (&radiance)[V], const float* weights, float* irradiance) {
  const Floats d;
  constexpr int kPair = 8 / kLanes;  // vectors of an even and an odd direction
  alignas(32) float sums[8];
  for (int i = 0; i < kPair; ++i) {
    F sum = hn::Mul(radiance[i], hn::Load(d, weights + i * kLanes));
    for (int v = i + kPair; v < V; v += kPair)
      sum = hn::Add(sum, hn::Mul(radiance[v], hn::Load(d, weights + v * kLanes)));
    hn::Store(sum, d, sums + i * kLanes);
  }
  for (int b = 0; b < 4; ++b) irradiance[b] += sums[b] + sums[b + 4];
}

/// What a row needs to know beside the leaf.
struct Row {
  const FluxLeaf* leaf;
  const FluxGrid* grid;
  const float* radiance;
  float* irradiance;
  float *at_x, *at_z;  // [8][floats], [floats]
  const float* at_y;   // [8][floats]; may be at_x's neighbour row
  int x, y;            // in the leaf
  bool sources, count;
};

/// One row of a leaf through which light passes unhindered, for V vectors of directions from `from` on.
template <int V>
HWY_INLINE void pass_open(FluxSweep::Octant& o, const Row& row, int from) {
  const Floats d;
  const float *share_x = o.share[0].data() + from, *share_y = o.share[1].data() + from,
              *share_z = o.share[2].data() + from;
  F radiance[V];
  for (int v = 0; v < V; ++v) radiance[v] = hn::Load(d, row.at_z + from + v * kLanes);
  const bool back = o.negative(2);
  for (int k = 0; k < 8; ++k) {
    const int at = (back ? 7 - k : k) * o.floats + from;
    for (int v = 0; v < V; ++v) {
      const int i = at + v * kLanes;
      const F across = hn::Add(hn::Mul(hn::Load(d, share_x + v * kLanes), hn::Load(d, row.at_x + i)),
                               hn::Mul(hn::Load(d, share_y + v * kLanes), hn::Load(d, row.at_y + i)));
      radiance[v] = hn::Add(across, hn::Mul(hn::Load(d, share_z + v * kLanes), radiance[v]));
      hn::Store(radiance[v], d, row.at_x + i);
    }
  }
  for (int v = 0; v < V; ++v) hn::Store(radiance[v], d, row.at_z + from + v * kLanes);
}

/// Two rows through which light passes unhindered, `second` beyond `first` and a voxel behind it, so that twice as many
/// sums are under way: a third faster than one after the other.
template <int V>
HWY_INLINE void pass_two_open(FluxSweep::Octant& o, const Row& first, const Row& second, int from) {
  const Floats d;
  const float *share_x = o.share[0].data() + from, *share_y = o.share[1].data() + from,
              *share_z = o.share[2].data() + from;
  F one[V], two[V], beside[V];  // beside: of the first row, where the second one is
  for (int v = 0; v < V; ++v) {
    one[v] = hn::Load(d, first.at_z + from + v * kLanes);
    two[v] = hn::Load(d, second.at_z + from + v * kLanes);
    beside[v] = one[v];
  }
  const int step = o.negative(2) ? -o.floats : o.floats;
  int at = (o.negative(2) ? 7 * o.floats : 0) + from;
  const auto pass = [&](F& radiance, const float* at_x, F from_y, int v, float* to) HWY_ATTR {
    const F across = hn::Add(hn::Mul(hn::Load(d, share_x + v * kLanes), hn::Load(d, at_x)),
                             hn::Mul(hn::Load(d, share_y + v * kLanes), from_y));
    radiance = hn::Add(across, hn::Mul(hn::Load(d, share_z + v * kLanes), radiance));
    hn::Store(radiance, d, to);
  };
  for (int v = 0; v < V; ++v) {
    float* const here = first.at_x + at + v * kLanes;
    pass(one[v], here, hn::Load(d, first.at_y + at + v * kLanes), v, here);
  }
  for (int k = 1; k < 8; ++k) {
    for (int v = 0; v < V; ++v) beside[v] = one[v];
    for (int v = 0; v < V; ++v) {
      const int i = at + v * kLanes;
      pass(one[v], first.at_x + i + step, hn::Load(d, first.at_y + i + step), v, first.at_x + i + step);
      pass(two[v], second.at_x + i, beside[v], v, second.at_x + i);
    }
    at += step;
  }
  for (int v = 0; v < V; ++v) {
    float* const here = second.at_x + at + v * kLanes;
    pass(two[v], here, one[v], v, here);
    hn::Store(one[v], d, first.at_z + from + v * kLanes);
    hn::Store(two[v], d, second.at_z + from + v * kLanes);
  }
}

HWY_INLINE uint32_t surface_at(const FluxLeaf& leaf, int face, int x, int bit) {
  return leaf.first[face][x] + static_cast<uint32_t>(hwy::PopCount(leaf.wall[face].word[x] & ((1ull << bit) - 1)));
}

/// The same among walls and media.
template <int V>
HWY_INLINE void pass_busy(FluxSweep::Octant& o, const Row& row, int from) {
  const Floats d;
  const FluxLeaf& leaf = *row.leaf;
  const int x = row.x;
  int behind[3], ahead[3];  // faces
  for (int a = 0; a < 3; ++a) {
    ahead[a] = 2 * a + (o.negative(a) ? 0 : 1);
    behind[a] = world::opposite_face(ahead[a]);
  }
  F radiance[V];
  for (int v = 0; v < V; ++v) radiance[v] = hn::Load(d, row.at_z + from + v * kLanes);
  for (int k = 0; k < 8; ++k) {
    const int z = o.negative(2) ? 7 - k : k, bit = row.y * 8 + z;
    if (!(leaf.clear.word[x] >> bit & 1)) continue;
    const int at = z * o.floats + from;
    const bool busy = leaf.busy.word[x] >> bit & 1;
    const float* wall[3] = {nullptr, nullptr, nullptr};
    if (busy) {
      for (int a = 0; a < 3; ++a)
        if (leaf.wall[behind[a]].word[x] >> bit & 1)
          wall[a] = row.radiance + size_t{4} * surface_at(leaf, behind[a], x, bit);
    }
    for (int v = 0; v < V; ++v) {
      const int i = v * kLanes;
      const F from_x = wall[0] ? load_quad(wall[0], v) : hn::Load(d, row.at_x + at + i);
      const F from_y = wall[1] ? load_quad(wall[1], v) : hn::Load(d, row.at_y + at + i);
      const F from_z = wall[2] ? load_quad(wall[2], v) : radiance[v];
      const F across = hn::Add(hn::Mul(hn::Load(d, o.share[0].data() + from + i), from_x),
                               hn::Mul(hn::Load(d, o.share[1].data() + from + i), from_y));
      radiance[v] = hn::Add(across, hn::Mul(hn::Load(d, o.share[2].data() + from + i), from_z));
    }
    if (busy) {
      const int kind = leaf.media ? row.grid->media[leaf.media - 1][x * 64 + bit] - 1 : -1;
      if (kind >= 0) {
        const size_t start = static_cast<size_t>(kind) * o.floats + from;
        for (int v = 0; v < V; ++v) {
          const F entered = radiance[v];
          radiance[v] = hn::Mul(entered, hn::Load(d, o.passed.data() + start + v * kLanes));
          if (row.count) {
            alignas(32) float lost[8];
            hn::Store(hn::Mul(hn::Sub(entered, radiance[v]), hn::Load(d, o.crossed.data() + from + v * kLanes)), d,
                      lost);
            for (int i = 0; i < kLanes; ++i)
              if (((v * kLanes + i) & 3) < 3) o.totals.absorbed[(v * kLanes + i) & 3] += lost[i];
          }
          if (row.sources) radiance[v] = hn::Add(radiance[v], hn::Load(d, o.added.data() + start + v * kLanes));
        }
      }
      for (int a = 0; a < 3; ++a)
        if (leaf.wall[ahead[a]].word[x] >> bit & 1)
          arrive<V>(radiance, o.carried[a].data() + from,
                    row.irradiance + size_t{4} * surface_at(leaf, ahead[a], x, bit));
    }
    for (int v = 0; v < V; ++v) hn::Store(radiance[v], d, row.at_x + at + v * kLanes);
  }
  for (int v = 0; v < V; ++v) hn::Store(radiance[v], d, row.at_z + from + v * kLanes);
}

/// Calls pass(vectors, from) for each chunk of the octant's directions; vectors() is a constant.
template <class Pass>
HWY_INLINE void for_chunks(const FluxSweep::Octant& o, Pass pass) {
  for (int from = 0; from < o.floats; from += kChunkFloats) {
    switch (std::min(kChunkFloats, o.floats - from) / 8) {
      case 1:
        pass(std::integral_constant<int, 8 / kLanes>(), from);
        break;
      case 2:
        pass(std::integral_constant<int, 16 / kLanes>(), from);
        break;
      case 3:
        pass(std::integral_constant<int, 24 / kLanes>(), from);
        break;
      default:
        pass(std::integral_constant<int, 32 / kLanes>(), from);
        break;
    }
  }
}

/// Power that leaves the box through the voxel's face ahead on `axis`.
void leave(FluxSweep::Octant& o, const float* radiance, int axis) {
  for (int d = 0; d < o.directions; ++d)
    for (int b = 0; b < 3; ++b) o.totals.escaped[b] += double(radiance[4 * d + b]) * o.carried[axis][4 * d + b];
}

void pass_leaf(FluxSweep::Octant& o, const FluxGrid& grid, const int (&at)[3], const float* radiance, float* irradiance,
               bool sources, bool count) {
  const FluxLeaf& leaf = grid.leaves[grid.place({at[0], at[1], at[2]})];
  const size_t row_floats = size_t{8} * static_cast<size_t>(grid.size[2]) * o.floats;
  const size_t in_row = size_t{8} * static_cast<size_t>(at[2]) * o.floats;
  bool last[3];
  for (int a = 0; a < 3; ++a) last[a] = at[a] == (o.negative(a) ? 0 : grid.size[a] - 1);
  for (int i = 0; i < 8; ++i) {
    const int x = o.negative(0) ? 7 - i : i;
    float* const side_y = o.along_y.data() + x * row_floats + in_row;
    const auto row_of = [&](int j) {
      const int y = o.negative(1) ? 7 - j : j;
      Row row;
      row.leaf = &leaf, row.grid = &grid, row.radiance = radiance, row.irradiance = irradiance;
      row.at_x = o.along_x.data() + (size_t{8} * at[1] + y) * row_floats + in_row;
      row.at_y = j == 0 ? side_y : o.negative(1) ? row.at_x + row_floats : row.at_x - row_floats;
      row.at_z = o.along_z.data() + static_cast<size_t>(x * 8 + y) * o.floats;
      row.x = x, row.y = y, row.sources = sources, row.count = count;
      return row;
    };
    const auto bits = [&](const world::LeafMask& mask, const Row& row) { return mask.word[x] >> (8 * row.y) & 0xff; };
    const auto is_open = [&](const Row& row) { return bits(leaf.clear, row) == 0xff && bits(leaf.busy, row) == 0; };
    for (int j = 0; j < 8; ++j) {
      const Row row = row_of(j);
      if (bits(leaf.clear, row) == 0) continue;
      if (!is_open(row)) {
        for_chunks(o, [&](auto vectors, int from) HWY_ATTR { pass_busy<vectors()>(o, row, from); });
        continue;
      }
      const Row next = j < 7 ? row_of(j + 1) : row;
      if (j == 7 || !is_open(next)) {
        for_chunks(o, [&](auto vectors, int from) HWY_ATTR { pass_open<vectors()>(o, row, from); });
        continue;
      }
      for_chunks(o, [&](auto vectors, int from) HWY_ATTR { pass_two_open<vectors()>(o, row, next, from); });
      ++j;
    }
    std::copy_n(row_of(7).at_x, 8 * o.floats, side_y);
    if (!count) continue;
    // Power that leaves the box: what the last voxels of a side hold now goes through their faces ahead.
    for (int j = 0; j < 8; ++j) {
      const Row row = row_of(j);
      for (uint64_t left = bits(leaf.clear, row); left; left &= left - 1) {
        const int z = std::countr_zero(left), bit = row.y * 8 + z;
        const bool end[3] = {last[0] && i == 7, last[1] && j == 7, last[2] && z == (o.negative(2) ? 0 : 7)};
        for (int a = 0; a < 3; ++a)
          if (end[a] && !(leaf.wall[2 * a + (o.negative(a) ? 0 : 1)].word[x] >> bit & 1))
            leave(o, row.at_x + static_cast<size_t>(z) * o.floats, a);
      }
    }
  }
}

void sweep_octant(FluxSweep::Octant& o, const FluxGrid& grid, const float* radiance, float* irradiance, bool sources,
                  bool count) {
  const auto fill = [&](AlignedFloats& to) {
    if (!sources) {
      std::fill(to.begin(), to.end(), 0.0f);
      return;
    }
    for (size_t i = 0; i < to.size(); i += o.floats) std::copy_n(o.sky.data(), o.floats, to.data() + i);
  };
  fill(o.along_x);
  for (int i = 0; i < grid.size[0]; ++i) {
    fill(o.along_y);
    for (int j = 0; j < grid.size[1]; ++j) {
      fill(o.along_z);
      for (int k = 0; k < grid.size[2]; ++k) {
        const int at[3] = {o.negative(0) ? grid.size[0] - 1 - i : i, o.negative(1) ? grid.size[1] - 1 - j : j,
                           o.negative(2) ? grid.size[2] - 1 - k : k};
        if (!grid.leaves[grid.place({at[0], at[1], at[2]})].solid)
          pass_leaf(o, grid, at, radiance, irradiance, sources, count);
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim {

namespace {
HWY_EXPORT(sweep_octant);
constexpr double kPi = 3.14159265358979323846;
}  // namespace

FluxSweep::FluxSweep(const FluxGrid& grid, const Ordinates& set, const world::Environment& environment) : grid_(grid) {
  double voxel_crossing = 0;  // sum over all ordinates of weight * sum |O|
  for (const auto& octant : set.octants)
    for (const Ordinate& o : octant)
      voxel_crossing += double(o.weight) * (double(o.along[0]) + o.along[1] + o.along[2]);
  for (int signs = 0; signs < 8; ++signs) {
    if (set.octants[signs].empty()) continue;
    Octant& octant = octants_.emplace_back();
    octant.signs = signs;
    octant.directions = (static_cast<int>(set.octants[signs].size()) + 1) & ~1;
    octant.floats = 4 * octant.directions;
    const size_t kinds = grid.kinds.size();
    for (int a = 0; a < 3; ++a) octant.share[a].assign(octant.floats, 0), octant.carried[a].assign(octant.floats, 0);
    octant.sky.assign(octant.floats, 0), octant.crossed.assign(octant.floats, 0);
    octant.passed.assign(kinds * octant.floats, 0), octant.added.assign(kinds * octant.floats, 0);
    for (size_t d = 0; d < set.octants[signs].size(); ++d) {
      const Ordinate& o = set.octants[signs][d];
      const double sum = double(o.along[0]) + o.along[1] + o.along[2];
      const double cosine = octant.negative(1) ? -o.along[1] : o.along[1];
      // Light goes along the ordinate: the sky that it comes from lies behind.
      const world::Radiance3 sky = world::sky_radiance(environment, -cosine);
      const double bands[3] = {sky.r, sky.g, sky.b};
      for (int b = 0; b < 3; ++b) {
        const size_t i = 4 * d + b;
        for (int a = 0; a < 3; ++a) {
          octant.share[a][i] = static_cast<float>(o.along[a] / sum);
          octant.carried[a][i] = o.weight * o.along[a];
        }
        octant.sky[i] = static_cast<float>(bands[b] * kPi / set.half_range);
        octant.crossed[i] = static_cast<float>(o.weight * sum);
        for (size_t k = 0; k < kinds; ++k) {
          octant.passed[k * octant.floats + i] = static_cast<float>(std::exp(-grid.kinds[k].absorption[b] / sum));
          octant.added[k * octant.floats + i] = static_cast<float>(grid.kinds[k].emission[b] / voxel_crossing);
        }
      }
    }
    octant.along_x.resize(size_t{64} * grid.size[1] * grid.size[2] * octant.floats);
    octant.along_y.resize(size_t{64} * grid.size[2] * octant.floats);
    octant.along_z.resize(size_t{64} * octant.floats);
  }
  for (auto& arrived : arrived_) arrived.resize(grid.surfaces.size() * 4);
}

FluxSweep::~FluxSweep() = default;

size_t FluxSweep::bytes() const {
  size_t floats = 0;
  for (const Octant& o : octants_) floats += o.along_x.size() + o.along_y.size() + o.along_z.size();
  for (const auto& arrived : arrived_) floats += arrived.size();
  return floats * sizeof(float);
}

void FluxSweep::run(const float* radiance, float* irradiance, bool sources, FluxTotals* totals) {
  // An octant and its opposite arrive on different surfaces: they share an array.
  for (auto& arrived : arrived_) std::fill(arrived.begin(), arrived.end(), 0.0f);
  world::parallel_for(octants_.size(), [&](size_t i) {
    Octant& o = octants_[i];
    o.totals = {};
    HWY_DYNAMIC_DISPATCH(sweep_octant)
    (o, grid_, radiance, arrived_[std::min(o.signs, 7 - o.signs)].data(), sources, totals != nullptr);
  });
  world::parallel_ranges(arrived_[0].size(), 16384, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i)
      irradiance[i] = (arrived_[0][i] + arrived_[1][i]) + (arrived_[2][i] + arrived_[3][i]);
  });
  if (!totals) return;
  *totals = {};
  for (const Octant& o : octants_) {
    for (int b = 0; b < 3; ++b) totals->escaped[b] += o.totals.escaped[b], totals->absorbed[b] += o.totals.absorbed[b];
    if (!sources) continue;
    for (int a = 0; a < 3; ++a) {
      const uint64_t faces = grid_.open_faces[2 * a + (o.negative(a) ? 1 : 0)];
      for (int i = 0; i < o.floats; ++i)
        if ((i & 3) < 3) totals->sky[i & 3] += double(faces) * o.sky[i] * o.carried[a][i];
    }
  }
}

}  // namespace sim
#endif
