#include "sim/matter/fire_kernel.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "world/base/random.h"
#include "world/base/simd.h"
#include "world/space/coords.h"
#include "world/store/leaf_shifts.h"

namespace sim {
namespace {

using world::kLeafVoxels;
using world::LeafMask;

template <class T>
using Values = std::array<T, kLeafVoxels>;

LeafMask random_mask(int seed, uint64_t of) {
  LeafMask m;
  for (int i = 0; i < kLeafVoxels; ++i)
    if (world::random_bits(static_cast<uint64_t>(seed), i, 0, 0) % of == 0) m.set(i);
  return m;
}
template <class Claim>
void for_each_simd_level(Claim claim) {
  for (const world::SimdLevel& level : world::simd_levels()) {
    const world::SimdChoice choice(level);
    SCOPED_TRACE(level.name);
    claim();
  }
}

TEST(FireKernel, VoxelsAreFoundByBlockAndByHeat) {
  Values<world::BlockId> ids;
  Values<int32_t> heats;
  for (int i = 0; i < kLeafVoxels; ++i) {
    const uint64_t r = world::random_bits(1, i, 0, 0);
    ids[static_cast<size_t>(i)] = static_cast<world::BlockId>(65533 + r % 3);
    heats[static_cast<size_t>(i)] = static_cast<int32_t>(r >> 32) >> (r % 4 * 8);
  }
  heats[7] = INT32_MIN, heats[8] = INT32_MAX;
  for_each_simd_level([&] {
    const LeafMask of = voxels_of(ids.data(), 65534);
    for (const int32_t least : {INT32_MIN, -5, 0, 1, 1 << 20, INT32_MAX}) {
      const LeafMask from = voxels_from(heats.data(), least);
      for (int i = 0; i < kLeafVoxels; ++i)
        EXPECT_EQ(from.test(i), heats[static_cast<size_t>(i)] >= least) << i << ' ' << least;
    }
    for (int i = 0; i < kLeafVoxels; ++i) EXPECT_EQ(of.test(i), ids[static_cast<size_t>(i)] == 65534) << i;
  });
}

TEST(FireKernel, SharesOfWhatBurnsAreCountedAsVoxelByVoxel) {
  for (const uint64_t of : {1, 2, 7}) {
    const LeafMask burns = random_mask(2, of), takes = random_mask(3, 2);
    LeafMask beyond[6];
    const LeafMask* sides[6];
    for (int f = 0; f < 6; ++f) beyond[f] = random_mask(4 + f, of), sides[f] = &beyond[f];
    const TimesMasks times = count_burning(burns, sides, takes);
    const LeafMask any = world::across_any(burns, sides);
    Values<int32_t> expected{};
    int64_t sum = 0;
    for (int i = 0; i < kLeafVoxels; ++i) {
      const world::VoxelPos v{i >> 6, i >> 3 & 7, i & 7};
      int count = 0, beside = 0;
      for (int f = 0; f < 6; ++f) {
        const world::VoxelPos n = v + world::face_step(static_cast<world::Face>(f));
        const bool leaves = ((n.x | n.y | n.z) & ~7) != 0;
        if (!(leaves ? beyond[f] : burns).test(world::index_in_leaf(n))) continue;
        count += f == world::kFaceNegY ? 2 : 1;
        ++beside;
      }
      EXPECT_EQ(any.test(i), beside > 0) << i;
      if (burns.test(i)) ++count;
      if (!takes.test(i)) count = 0;
      int bits = 0;
      for (int k = 0; k < 4; ++k) bits |= times.times[k].test(i) << k;
      EXPECT_EQ(bits, count) << i;
      expected[static_cast<size_t>(i)] = 1000 - i + count * 77777;
      sum += count;
    }
    for_each_simd_level([&] {
      Values<int32_t> heats;
      for (int i = 0; i < kLeafVoxels; ++i) heats[static_cast<size_t>(i)] = 1000 - i;
      EXPECT_EQ(add_times(times, 77777, heats.data()), sum);
      EXPECT_EQ(heats, expected);
    });
  }
}

TEST(FireKernel, FuelIsSpentUntilNothingIsLeft) {
  const LeafMask which = random_mask(5, 3), kept = random_mask(6, 2);
  for_each_simd_level([&] {
    Values<uint16_t> spent;
    for (int i = 0; i < kLeafVoxels; ++i) spent[static_cast<size_t>(i)] = static_cast<uint16_t>(i * 128);
    spent[0] = 65535 - 20000, spent[1] = 65536 - 20000;
    Values<uint16_t> expected = spent;
    LeafMask all;
    for (int i = 0; i < kLeafVoxels; ++i) {
      if (!which.test(i)) continue;
      const int sum = spent[static_cast<size_t>(i)] + 20000;
      if (sum >= 65536) all.set(i);
      expected[static_cast<size_t>(i)] = static_cast<uint16_t>(sum >= 65536 ? 0 : sum);
    }
    EXPECT_EQ(spend(which, 20000, spent.data()), all);
    EXPECT_EQ(spent, expected);
    for (int i = 0; i < kLeafVoxels; ++i)
      if (!kept.test(i)) expected[static_cast<size_t>(i)] = 0;
    keep_only(kept, spent.data());
    EXPECT_EQ(spent, expected);
  });
}

}  // namespace
}  // namespace sim
