/// Each inner loop of extraction gives what a loop over single bits gives, at every SIMD level.

#include "render/extract/kernels.h"

#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "world/base/random.h"
#include "world/base/simd.h"

namespace render {
namespace {

using namespace world;

/// Dense, sparse, empty and full masks by turns.
LeafMask random_mask(int i, uint64_t stream) {
  LeafMask mask;
  for (int w = 0; w < 8; ++w) {
    const auto bits = [&](int k) { return random_bits(7, i, w, k, 0, stream); };
    const uint64_t word[6] = {bits(0), bits(0) & bits(1) & bits(2), bits(0) | bits(1) | bits(2), 0,
                              ~0ull,   bits(0) & ~bits(1)};
    mask.word[w] = word[i % 6];
  }
  return mask;
}

template <class Body>
void at_every_simd_level(Body body) {
  for (const SimdLevel& level : simd_levels()) {
    const SimdChoice choice(level);
    SCOPED_TRACE(level.name);
    body();
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(ExtractKernels, FacesAreCounted) {
  at_every_simd_level([] {
    for (size_t count : {0u, 1u, 3u, 17u}) {
      std::vector<LeafFaces> faces(count);
      uint64_t expected = 0;
      auto* words = reinterpret_cast<uint64_t*>(faces.data());
      const size_t masks = count * sizeof(LeafFaces) / sizeof(LeafMask);
      for (size_t m = 0; m < masks; ++m) {
        const LeafMask mask = random_mask(static_cast<int>(m), 1);
        std::copy(mask.word, mask.word + 8, words + m * 8);
        expected += static_cast<uint64_t>(mask.count());
      }
      ASSERT_EQ(count_faces(faces.data(), count), expected);
    }
  });
}

TEST(ExtractKernels, EqualNeighboursAreThoseOfABruteForceLoop) {
  at_every_simd_level([] {
    for (int i = 0; i < 60; ++i) {
      const auto leaf_of_ids = [&](uint64_t stream) {
        std::array<BlockId, kLeafVoxels> ids;
        for (int v = 0; v < kLeafVoxels; ++v) {
          const uint64_t bits = random_bits(8, i, v, 0, 0, stream);
          // Few ids so that neighbours are often equal; ids that differ in the high byte only, too.
          ids[static_cast<size_t>(v)] = static_cast<BlockId>((bits & 1) | (bits >> 8 & 1) << 15);
        }
        return ids;
      };
      const auto ids = leaf_of_ids(0), x = leaf_of_ids(1), y = leaf_of_ids(2), z = leaf_of_ids(3);
      const BlockId* const next[3] = {i % 4 == 1 ? nullptr : x.data(), i % 4 == 2 ? nullptr : y.data(),
                                      i % 4 == 3 ? nullptr : z.data()};
      LeafMask out[3];
      equal_neighbours(ids.data(), next, out);
      for (int v = 0; v < kLeafVoxels; ++v)
        for (int axis = 0; axis < 3; ++axis) {
          VoxelPos neighbour = offset_in_leaf(v);
          const bool outside = ++neighbour[axis] == kLeafSize;
          const size_t index = static_cast<size_t>(index_in_leaf(neighbour));
          const bool equal = outside ? next[axis] && next[axis][index] == ids[static_cast<size_t>(v)]
                                     : ids[index] == ids[static_cast<size_t>(v)];
          ASSERT_EQ(out[axis].test(v), equal) << "leaf " << i << ", voxel " << v << ", axis " << axis;
        }
    }
  });
}

TEST(ExtractKernels, EightLeavesLieSideBySide) {
  at_every_simd_level([] {
    for (int i = 0; i < 60; ++i) {
      LeafMask leaves[8];
      const LeafMask* pointers[8];
      for (int l = 0; l < 8; ++l) {
        leaves[l] = random_mask(i + (i % 7 == 0 ? 3 : l), static_cast<uint64_t>(l));
        pointers[l] = &leaves[l];
      }
      constexpr uint64_t kUntouched = 0x5aa5f00dull;
      std::vector<uint64_t> rows(8 * kRowPitch, kUntouched);
      const uint64_t used = rows_from_leaves(pointers, rows.data());
      for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y) {
          uint64_t expected = 0;
          for (int z = 0; z < 64; ++z)
            expected |= static_cast<uint64_t>(leaves[z / 8].test(VoxelPos{x, y, z & 7})) << z;
          ASSERT_EQ(used >> (x * 8 + y) & 1, expected != 0);
          const uint64_t row = rows[static_cast<size_t>(x) * kRowPitch + static_cast<size_t>(y)];
          // A row that is zero may be left as it was.
          if (used >> (x * 8 + y) & 1) {
            ASSERT_EQ(row, expected) << "x " << x << ", y " << y;
          }
        }
    }
  });
}

TEST(ExtractKernels, SwappingYAndZTwiceIsNothing) {
  at_every_simd_level([] {
    for (int i = 0; i < 60; ++i) {
      const LeafMask mask = random_mask(i, 2);
      LeafMask swapped, back;
      swap_yz(mask, swapped);
      swap_yz(swapped, back);
      ASSERT_EQ(back, mask);
      for (int v = 0; v < kLeafVoxels; ++v) {
        const VoxelPos p = offset_in_leaf(v);
        ASSERT_EQ(swapped.test(VoxelPos{p.x, p.z, p.y}), mask.test(v));
      }
    }
  });
}

/// What can be reached from `seeds` through faces within `open`.
LeafMask breadth_first(const LeafMask& open, const LeafMask& seeds) {
  LeafMask reached;
  std::vector<VoxelPos> work;
  const auto visit = [&](VoxelPos v) {
    if (v.x < 0 || v.y < 0 || v.z < 0 || v.x > 7 || v.y > 7 || v.z > 7 || !open.test(v) || reached.test(v)) return;
    reached.set(index_in_leaf(v));
    work.push_back(v);
  };
  for (int i = 0; i < kLeafVoxels; ++i)
    if (seeds.test(i)) visit(offset_in_leaf(i));
  while (!work.empty()) {
    const VoxelPos v = work.back();
    work.pop_back();
    for (int f = 0; f < kFaces; ++f) visit(v + face_step(f));
  }
  return reached;
}

TEST(ExtractKernels, FloodReachesWhatABreadthFirstSearchReaches) {
  at_every_simd_level([] {
    for (int i = 0; i < 240; ++i) {
      const LeafMask open = random_mask(i, 3);
      LeafMask first, then;
      for (int w = 0; w < 8; ++w) {
        const auto bits = [&](int k) { return random_bits(9, i, w, k); };
        first.word[w] = i % 7 == 0 ? 0 : bits(0) & bits(1) & bits(2) & bits(3) & bits(4);
        then.word[w] = i % 5 == 0 ? 0 : bits(5) & bits(6) & bits(7) & bits(8) & bits(9);
      }
      LeafMask reached, seeds;
      ASSERT_EQ(flood_leaf(open, first, reached), !breadth_first(open, first).is_none()) << i;
      ASSERT_EQ(reached, breadth_first(open, first)) << i;
      const LeafMask before = reached;
      for (int w = 0; w < 8; ++w) seeds.word[w] = first.word[w] | then.word[w];
      const bool changed = flood_leaf(open, then, reached);
      ASSERT_EQ(reached, breadth_first(open, seeds)) << i;
      ASSERT_EQ(changed, !(reached == before)) << i;
    }
  });
}

}  // namespace
}  // namespace render
