#include "world/store/leaf_shifts.h"

#include <gtest/gtest.h>

#include "world/base/random.h"

namespace world {
namespace {

LeafMask random_mask(uint64_t seed) {
  LeafMask m;
  for (int x = 0; x < 8; ++x) m.word[x] = mix64(seed * 8 + static_cast<uint64_t>(x));
  return m;
}

TEST(LeafShifts, AcrossAFaceLiesTheNextVoxelOfThisLeafOrOfTheOneBeyond) {
  for (uint64_t seed = 1; seed <= 20; ++seed)
    for (int face = 0; face < kFaces; ++face) {
      const LeafMask here = random_mask(seed), beyond = random_mask(seed + 1000);
      const LeafMask shifted = across(here, beyond, face), side = side_of(face);
      for (int i = 0; i < kLeafVoxels; ++i) {
        const VoxelPos next = offset_in_leaf(i) + face_step(face);
        const bool inside = leaf_from_voxel(next) == LeafPos{0, 0, 0};
        EXPECT_EQ(shifted.test(i), (inside ? here : beyond).test(next)) << face << ' ' << i;
        EXPECT_EQ(side.test(i), !inside) << face << ' ' << i;
      }
    }
}

}  // namespace
}  // namespace world
