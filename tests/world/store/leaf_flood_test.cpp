#include "world/store/leaf_flood.h"

#include <gtest/gtest.h>

#include "world/base/random.h"

namespace world {
namespace {

/// Voxel by voxel, until nothing is added.
LeafMask touching_slowly(LeafMask mask, const LeafMask& within) {
  for (bool grew = true; grew;) {
    grew = false;
    for (int i = 0; i < kLeafVoxels; ++i) {
      if (mask.test(i) || !within.test(i)) continue;
      for (int face = 0; face < kFaces; ++face) {
        const VoxelPos v = offset_in_leaf(i) + face_step(face);
        if (((v.x | v.y | v.z) & ~7) != 0 || !mask.test(v)) continue;
        mask.set(i);
        grew = true;
        break;
      }
    }
  }
  return mask;
}

TEST(LeafFlood, ReachesWhatFacesJoinAndNothingElse) {
  for (int seed = 0; seed < 400; ++seed) {
    // From caves of single voxels to solid with few holes.
    LeafMask within, start;
    for (int i = 0; i < kLeafVoxels; ++i)
      if (static_cast<int>(random_bits(1, seed, i, 0) % 16) < 3 + seed % 13) within.set(i);
    const int from = static_cast<int>(random_bits(2, seed, 0, 0) % kLeafVoxels);
    start.set(from);
    within.set(from);
    ASSERT_EQ(touching(start, within), touching_slowly(start, within)) << "seed " << seed;
  }
  EXPECT_TRUE(touching({}, kAllMask).is_none());
}

}  // namespace
}  // namespace world
