#include "world/formats/cubes/cubes.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <optional>

#include "world/base/jobs.h"
#include "world/formats/nbt/nbt.h"

namespace world {
namespace {

/// 16 bytes, in one register wherever there are such: not through Highway, whose baseline here is a lane at a time.
using Bytes16 = uint8_t __attribute__((vector_size(16)));

Bytes16 load16(const uint8_t* at) {
  Bytes16 bytes;
  std::memcpy(&bytes, at, sizeof bytes);
  return bytes;
}
/// a0 b0 a1 b1 ... of the lower and of the upper halves.
Bytes16 interleave_lower(Bytes16 a, Bytes16 b) {
  return __builtin_shufflevector(a, b, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
}
Bytes16 interleave_upper(Bytes16 a, Bytes16 b) {
  return __builtin_shufflevector(a, b, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
}

/// Where (x, y, z) of a cube lies among the indices.
constexpr size_t place(int x, int y, int z) {
  return static_cast<size_t>((x >> 3) << 11 | (y >> 3) << 10 | (z >> 3) << 9 | (x & 7) << 6 | (y & 7) << 3 | (z & 7));
}

/// Turns one layer of constant y, 16 rows along x `in_z` apart, into runs along z of the store.
void turn_layer(const uint8_t* in, std::ptrdiff_t in_z, int y, uint8_t* out) {
  // Unrolled, so that rows are registers: twice as fast as through memory.
  Bytes16 row[16], next[16];
#pragma GCC unroll 16
  for (int z = 0; z < 16; ++z) row[z] = load16(in + z * in_z);
    // Interleaving row i with row i + 8, four times, transposes 16 x 16 bytes.
#pragma GCC unroll 4
  for (int step = 0; step < 4; ++step) {
#pragma GCC unroll 8
    for (int i = 0; i < 8; ++i) {
      next[2 * i] = interleave_lower(row[i], row[i + 8]);
      next[2 * i + 1] = interleave_upper(row[i], row[i + 8]);
    }
#pragma GCC unroll 16
    for (int i = 0; i < 16; ++i) row[i] = next[i];
  }
#pragma GCC unroll 16
  for (int x = 0; x < 16; ++x) {
    uint64_t half[2];
    std::memcpy(half, &row[x], sizeof half);
    std::memcpy(out + place(x, y, 0), &half[0], 8);
    std::memcpy(out + place(x, y, 8), &half[1], 8);
  }
}
void turn_layer(const uint16_t* in, std::ptrdiff_t in_z, int y, uint16_t* out) {
  for (int x = 0; x < 16; ++x)
    for (int z = 0; z < 16; ++z) out[place(x, y, z)] = in[z * in_z + x];
}

template <class Index>
void order_any(CubeOrder order, const Index* in, Index* out) {
  for (int y = 0; y < kCubeSize; ++y) {
    if (order == CubeOrder::yzx)
      turn_layer(in + y * 256, 16, y, out);
    else
      turn_layer(in + 15 * 256 + y * 16, -256, y, out);
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
  for (int i = 0; i < kCubeVoxels; i += 32, words += 16) {
    const uint64_t pair[2] = {nbt::big_endian<uint64_t>(words), nbt::big_endian<uint64_t>(words + 8)};
    Bytes16 packed;
    std::memcpy(&packed, pair, sizeof packed);
    const Bytes16 even = packed & 15, odd = packed >> 4;
    const Bytes16 first = interleave_lower(even, odd), second = interleave_upper(even, odd);
    std::memcpy(out + i, &first, 16);
    std::memcpy(out + i + 16, &second, 16);
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
