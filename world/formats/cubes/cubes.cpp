#include "world/formats/cubes/cubes.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <optional>

#include "world/base/jobs.h"
#include "world/formats/nbt/nbt.h"

namespace world {
namespace {

uint64_t load64(const void* at) {
  uint64_t word;
  std::memcpy(&word, at, sizeof word);
  return word;
}

/// Swaps what `a` has above `shift` under the mask with what `b` has under the mask.
void swap_parts(uint64_t& a, uint64_t& b, int shift, uint64_t mask) {
  const uint64_t difference = ((a >> shift) ^ b) & mask;
  b ^= difference;
  a ^= difference << shift;
}

/// Word i byte j <-> word j byte i.
/// source  Henry S. Warren. Hacker's Delight, 2nd edition. 2012, section 7-3
void transpose8(uint64_t (&w)[8]) {
  for (int i = 0; i < 4; ++i) swap_parts(w[i], w[i + 4], 32, 0x00000000ffffffffull);
  for (const int i : {0, 1, 4, 5}) swap_parts(w[i], w[i + 2], 16, 0x0000ffff0000ffffull);
  for (const int i : {0, 2, 4, 6}) swap_parts(w[i], w[i + 1], 8, 0x00ff00ff00ff00ffull);
}

/// Where (x, y, z) of a cube lies among the indices.
constexpr size_t place(int x, int y, int z) {
  return static_cast<size_t>((x >> 3) << 11 | (y >> 3) << 10 | (z >> 3) << 9 | (x & 7) << 6 | (y & 7) << 3 | (z & 7));
}

/// Copies 8 x 8 indices, z by x, from rows along x of the file to runs along z of the store. in_z: steps between rows.
void turn_tile(const uint8_t* in, std::ptrdiff_t in_z, uint8_t* out) {
  uint64_t rows[8];
  for (int z = 0; z < 8; ++z) rows[z] = load64(in + z * in_z);
  transpose8(rows);
  for (int x = 0; x < 8; ++x) std::memcpy(out + x * 64, &rows[x], 8);
}
void turn_tile(const uint16_t* in, std::ptrdiff_t in_z, uint16_t* out) {
  for (int z = 0; z < 8; ++z)
    for (int x = 0; x < 8; ++x) out[x * 64 + z] = in[z * in_z + x];
}

template <class Index>
void order_any(CubeOrder order, const Index* in, Index* out) {
  for (int y = 0; y < kCubeSize; ++y)
    for (int z = 0; z < kCubeSize; z += 8)
      for (int x = 0; x < kCubeSize; x += 8) {
        Index* const to = out + place(x, y, z);
        if (order == CubeOrder::yzx)
          turn_tile(in + y * 256 + z * 16 + x, 16, to);
        else
          turn_tile(in + (15 - z) * 256 + y * 16 + x, -256, to);
      }
}

template <class Index>
bool all_equal_indices(const Index* in) {
  return std::memcmp(in, in + 1, (kLeafVoxels - 1) * sizeof(Index)) == 0;
}

/// The eight leaves of a cube into the region that it lies in.
template <class Index>
bool fill_leaves(const Index* indices, const std::vector<BlockId>& blocks, int first_leaf, MemoryBudget& budget,
                 RegionBuilder& region) {
  std::array<BlockId, kLeafVoxels> values;
  for (int l = 0; l < 8; ++l, indices += kLeafVoxels) {
    const int leaf = first_leaf + (l >> 2) * 256 + (l >> 1 & 1) * 16 + (l & 1);
    if (all_equal_indices(indices)) {
      region.set_uniform(leaf, blocks[indices[0]]);
      continue;
    }
    for (size_t i = 0; i < kLeafVoxels; ++i) values[i] = blocks[indices[i]];
    if (!budget.take(kLeafVoxels * sizeof(BlockId))) return false;
    region.set_leaf(leaf, values);
  }
  return true;
}

constexpr uint64_t kRegionBytes = 40 << 10;  // an empty node and its bookkeeping

}  // namespace

std::vector<Cube> join_cubes(std::vector<std::vector<Cube>> parts) {
  std::vector<Cube> all;
  size_t count = 0;
  for (const std::vector<Cube>& part : parts) count += part.size();
  all.reserve(count);
  for (std::vector<Cube>& part : parts) std::move(part.begin(), part.end(), std::back_inserter(all));
  return all;
}

void order_cube(CubeOrder order, const uint8_t* in, uint8_t* out) { order_any(order, in, out); }
void order_cube(CubeOrder order, const uint16_t* in, uint16_t* out) { order_any(order, in, out); }

size_t packed_words(int bits, bool spanning) {
  if (spanning) return static_cast<size_t>(kCubeVoxels * bits / 64);
  const int per_word = 64 / bits;
  return static_cast<size_t>((kCubeVoxels + per_word - 1) / per_word);
}

void unpack_indices(const uint8_t* words, int bits, bool spanning, uint16_t* out) {
  const uint64_t mask = (uint64_t{1} << bits) - 1;
  if (!spanning || 64 % bits == 0) {
    const int per_word = 64 / bits;
    for (int i = 0; i < kCubeVoxels; words += 8) {
      uint64_t word = nbt::big_endian<uint64_t>(words);
      for (int n = std::min(per_word, kCubeVoxels - i); n > 0; --n, word >>= bits)
        out[i++] = static_cast<uint16_t>(word & mask);
    }
    return;
  }
  uint64_t word = 0;
  int left = 0;  // bits of `word` that are not used yet
  for (int i = 0; i < kCubeVoxels; ++i) {
    if (left >= bits) {
      out[i] = static_cast<uint16_t>(word & mask);
      word >>= bits;
      left -= bits;
      continue;
    }
    const uint64_t next = nbt::big_endian<uint64_t>(words);
    words += 8;
    out[i] = static_cast<uint16_t>((word | next << left) & mask);
    word = next >> (bits - left);
    left += 64 - bits;
  }
}

void unpack_nibbles(const uint8_t* words, uint8_t* out) {
  constexpr uint64_t kLow = 0x0f0f0f0f0f0f0f0full;
  for (int i = 0; i < kCubeVoxels; i += 16, words += 8) {
    const uint64_t word = nbt::big_endian<uint64_t>(words);
    const uint64_t even = word & kLow, odd = word >> 4 & kLow;
    // Two bytes with a gap between neighbours each, interleaved.
    const auto spread = [](uint64_t four) {
      four = (four | four << 16) & 0x0000ffff0000ffffull;
      return (four | four << 8) & 0x00ff00ff00ff00ffull;
    };
    const uint64_t low = spread(even & 0xffffffff) | spread(odd & 0xffffffff) << 8;
    const uint64_t high = spread(even >> 32) | spread(odd >> 32) << 8;
    std::memcpy(out + i, &low, 8);
    std::memcpy(out + i + 8, &high, 8);
  }
}

std::vector<uint64_t> count_states(const std::vector<Cube>& cubes, size_t states) {
  std::vector<uint64_t> counts(states);
  for (const Cube& cube : cubes) {
    if (!cube.narrow && !cube.wide) counts[cube.states[0]] += kCubeVoxels;
    for (size_t i = 0; i < kCubeVoxels && cube.narrow; ++i) ++counts[cube.states[cube.narrow[i]]];
    for (size_t i = 0; i < kCubeVoxels && cube.wide; ++i) ++counts[cube.states[cube.wide[i]]];
  }
  return counts;
}

bool fill_from_cubes(std::vector<Cube> cubes, std::span<const BlockId> block_of_state, MemoryBudget& budget,
                     Store& store) {
  // The cubes of each region, in the order of the file.
  const auto region_of = [](CubePos c) { return RegionPos{c.x >> 3, c.y >> 3, c.z >> 3}; };
  std::vector<uint32_t> sorted(cubes.size());
  for (uint32_t i = 0; i < sorted.size(); ++i) sorted[i] = i;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [&](uint32_t a, uint32_t b) { return region_of(cubes[a].pos) < region_of(cubes[b].pos); });
  std::vector<size_t> starts;
  for (size_t i = 0; i < sorted.size(); ++i)
    if (i == 0 || region_of(cubes[sorted[i]].pos) != region_of(cubes[sorted[i - 1]].pos)) starts.push_back(i);
  starts.push_back(sorted.size());

  std::atomic<bool> fits{true};
  const auto is_air = [](const std::vector<BlockId>& blocks) {
    return std::all_of(blocks.begin(), blocks.end(), [](BlockId b) { return b == kAir; });
  };
  std::vector<std::optional<RegionBuilder>> built(starts.size() - 1);
  parallel_for(built.size(), [&](size_t r) {
    if (!fits || !budget.take(kRegionBytes)) {
      fits = false;
      return;
    }
    RegionBuilder& region = built[r].emplace(region_of(cubes[sorted[starts[r]]].pos));
    std::vector<BlockId> blocks;
    bool any = false;
    for (size_t i = starts[r]; i < starts[r + 1]; ++i) {
      Cube& cube = cubes[sorted[i]];
      const int first_leaf = (cube.pos.x & 7) << 9 | (cube.pos.y & 7) << 5 | (cube.pos.z & 7) << 1;
      blocks.clear();
      for (const StateNumber state : cube.states) blocks.push_back(block_of_state[state]);
      any |= !is_air(blocks);
      bool filled = true;
      if (cube.narrow) {
        filled = fill_leaves(cube.narrow.get(), blocks, first_leaf, budget, region);
      } else if (cube.wide) {
        filled = fill_leaves(cube.wide.get(), blocks, first_leaf, budget, region);
      } else {
        for (int l = 0; l < 8; ++l)
          region.set_uniform(first_leaf + (l >> 2) * 256 + (l >> 1 & 1) * 16 + (l & 1), blocks[0]);
      }
      if (!filled) fits = false;
      budget.give_back(cube.wide ? 2 * kCubeVoxels : cube.narrow ? kCubeVoxels : 0);
      cube = Cube();
    }
    if (!any) built[r].reset();
  });
  if (!fits) return false;
  for (std::optional<RegionBuilder>& region : built)
    if (region) store.adopt(std::move(*region));
  return true;
}

}  // namespace world
