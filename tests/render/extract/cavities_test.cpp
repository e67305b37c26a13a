#include "render/extract/cavities.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/render/extract/worlds.h"

namespace render {
namespace {

/// Sealed voxels by a flood voxel by voxel from one beyond the box.
std::set<VoxelPos> brute_force_sealed(const World& w, const VoxelBox& box) {
  VoxelBox around = box;
  for (int a = 0; a < 3; ++a) --around.min[a], ++around.max[a];
  StoreReader reader(w.store);
  const auto open = [&](VoxelPos v) {
    const BlockId b = reader.get(v);
    return b == kAir || !(*w.palette)[b].opaque;
  };
  const auto index = [&](VoxelPos v) {
    const VoxelPos d = v - around.min, size = around.max - around.min;
    return (static_cast<size_t>(d.x) * static_cast<size_t>(size.y + 1) + static_cast<size_t>(d.y)) *
               static_cast<size_t>(size.z + 1) +
           static_cast<size_t>(d.z);
  };
  std::vector<bool> reached(around.volume());
  std::vector<VoxelPos> queue{around.min};
  reached[index(around.min)] = true;
  while (!queue.empty()) {
    const VoxelPos v = queue.back();
    queue.pop_back();
    for (int f = 0; f < kFaces; ++f) {
      const VoxelPos n = v + face_step(f);
      if (!around.contains(n) || reached[index(n)] || !open(n)) continue;
      reached[index(n)] = true;
      queue.push_back(n);
    }
  }
  std::set<VoxelPos> sealed;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z)
        if (open({x, y, z}) && !reached[index({x, y, z})]) sealed.insert({x, y, z});
  return sealed;
}

std::set<VoxelPos> voxels_of(const MaskVolume& volume, const VoxelBox& box) {
  std::set<VoxelPos> all;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z)
        if (volume.test({x, y, z})) all.insert({x, y, z});
  EXPECT_EQ(volume.count(), all.size());
  return all;
}

TEST(Cavities, EqualAFloodVoxelByVoxel) {
  struct Case {
    BlockAt blocks;
    VoxelBox box;
  };
  // Near the percolation threshold (0.31 open) cavities of all sizes and winding ways out occur.
  const Case cases[] = {{random_blocks(1, 0.69f, 3), box_at({-20, -20, 100}, 50, 40, 50)},
                        {random_blocks(2, 0.80f, 5), box_at({-20, 120, 100}, 50, 40, 50)},
                        {random_blocks(3, 0.72f, 3), box_at({1, 2, 3}, 64, 64, 64)},
                        {random_blocks(4, 0.95f, 4), box_at({-8, -8, -8}, 40, 40, 40)},
                        {terrain_blocks({0, 0, 0}, 30), box_at({-60, 0, -60}, 120, 50, 120)}};
  for (const Case& c : cases) {
    World w = small_world();
    fill(w, c.box, c.blocks);
    EXPECT_EQ(voxels_of(find_sealed_cavities(w.store.masks(MaskKind::opaque)), c.box), brute_force_sealed(w, c.box));
  }
}

TEST(Cavities, AHollowBoxHoldsWholeEmptyRegions) {
  World w = small_world();
  EditBatch batch;
  // Hollow inside [-150, 300): it holds the regions 0 and 1 on each axis, which have no opaque voxel.
  const VoxelBox outer{{-160, -160, -160}, {309, 309, 309}}, inner{{-150, -150, -150}, {299, 299, 299}};
  batch.fill(outer, kStone), batch.fill(inner, kAir);
  batch.fill({{-160, 5, 5}, {-151, 5, 5}}, kGlass);
  ASSERT_TRUE(w.store.apply(batch).ok());
  EXPECT_TRUE(find_sealed_cavities(w.store.masks(MaskKind::opaque)).empty()) << "glass lets see in";
  batch = {};
  batch.set({-155, 5, 5}, kStone);
  ASSERT_TRUE(w.store.apply(batch).ok());
  const MaskVolume sealed = find_sealed_cavities(w.store.masks(MaskKind::opaque));
  EXPECT_EQ(sealed.count(), inner.volume() + 4);
  EXPECT_TRUE(sealed.test({0, 0, 0}) && sealed.test({299, 299, 299}) && sealed.test({-151, 5, 5}));
  EXPECT_FALSE(sealed.test({-156, 5, 5}));
}

TEST(Cavities, FacesTowardsThemAreLeftOutAndNoOthers) {
  World w = small_world();
  const VoxelBox box = box_at({-30, 90, -30}, 60, 60, 60);
  fill(w, box, random_blocks(9, 0.75f, 5));
  const std::set<VoxelPos> sealed = brute_force_sealed(w, box);
  ASSERT_GT(sealed.size(), 1000u);
  const WorldView view(w);
  Extractor extractor;
  extractor.rebuild(view, {true, false});
  EXPECT_EQ(unit_faces(extractor), brute_force_faces(w, box, [&](VoxelPos v) { return !sealed.contains(v); }));
  EXPECT_TRUE(extractor.in_sealed_cavity(*sealed.begin()));
  EXPECT_FALSE(extractor.in_sealed_cavity({1000, 1000, 1000}));
}

TEST(Cavities, AnEditOpensThemAtOnceAndNeverHidesWhatIsSeen) {
  World w = small_world();
  const VoxelBox box = box_at({-30, -30, -30}, 48, 48, 48);
  fill(w, box, random_blocks(21, 0.8f, 4));
  MaskVolume sealed = find_sealed_cavities(w.store.masks(MaskKind::opaque));
  const int subscriber = w.store.subscribe();
  for (uint64_t round = 0; round < 12; ++round) {
    EditBatch batch;
    for (uint64_t i = 0; i < 40; ++i) {
      const uint64_t r = random_bits(22, static_cast<int64_t>(round), static_cast<int64_t>(i), 0);
      const VoxelPos v{box.min.x + static_cast<int>(r % 48), box.min.y + static_cast<int>(r / 48 % 48),
                       box.min.z + static_cast<int>(r / 2304 % 48)};
      batch.set(v, r >> 62 == 0 ? kStone : kAir);
    }
    ASSERT_TRUE(w.store.apply(batch).ok());
    const std::set<VoxelPos> before = voxels_of(sealed, box);
    const std::vector<LeafPos> dirty = w.store.take_dirty(subscriber);
    const std::vector<LeafPos> changed = reopen_cavities(sealed, w.store.masks(MaskKind::opaque), dirty);
    const std::set<VoxelPos> now = voxels_of(sealed, box), exact = brute_force_sealed(w, box);
    EXPECT_TRUE(std::includes(exact.begin(), exact.end(), now.begin(), now.end())) << "something seen counts as sealed";
    for (const VoxelPos v : before)
      EXPECT_TRUE(now.contains(v) || std::binary_search(changed.begin(), changed.end(), leaf_from_voxel(v)));
  }
}

}  // namespace
}  // namespace render
