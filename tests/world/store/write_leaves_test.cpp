// Leaves written at once are a batch that sets each of their voxels: blocks, census, masks, what is dirty and unsaved,
// snapshots and undo.
#include <map>
#include <random>

#include <gtest/gtest.h>

#include "world/store/snapshot.h"
#include "world/world.h"

namespace world {
namespace {

using Leaf = std::array<BlockId, kLeafVoxels>;

/// A world, and what follows its changes.
struct Followed {
  World world{standard_blocks()};
  int subscriber = world.store.subscribe();
  UndoLog log;
};

/// The leaf as it is, somewhat changed: not at all, a voxel, a row, noise of few or many blocks, all of one block.
Leaf changed_leaf(const Store& store, LeafPos l, std::mt19937& rng) {
  Leaf leaf;
  const LeafBlocks now = store.leaf(l);
  for (int i = 0; i < kLeafVoxels; ++i) leaf[static_cast<size_t>(i)] = now[i];
  const auto block = [&](unsigned below) { return static_cast<BlockId>(rng() % below); };
  switch (rng() % 7) {
    case 0:
      break;
    case 1:
      leaf[rng() % kLeafVoxels] = block(9);
      break;
    case 2:
      std::fill_n(leaf.begin() + 64 * static_cast<int>(rng() % 8), 64, block(9));
      break;
    case 3:
      for (BlockId& b : leaf)
        if (rng() % 4 == 0) b = block(3);
      break;
    case 4:
      for (BlockId& b : leaf) b = block(278);
      break;
    case 5:
      leaf.fill(block(9));
      break;
    default:
      std::swap(leaf[rng() % kLeafVoxels], leaf[rng() % kLeafVoxels]);
      break;  // a grain that falls
  }
  return leaf;
}

void expect_equal(Followed& a, Followed& b) {
  const Store &x = a.world.store, &y = b.world.store;
  ASSERT_EQ(x.content_hash(), y.content_hash());
  ASSERT_EQ(x.census(), y.census());
  ASSERT_EQ(x.regions(), y.regions());
  for (const RegionPos& r : x.regions()) ASSERT_EQ(x.region_census(r), y.region_census(r));
  ASSERT_EQ(x.mixed_leaves(), y.mixed_leaves());
  ASSERT_EQ(x.unsaved(), y.unsaved());
  ASSERT_EQ(x.bytes_memory(), y.bytes_memory());
  ASSERT_EQ(x.mask_kinds(), y.mask_kinds());
  for (int k = 0; k < kMaskKinds; ++k) {
    if (!(x.mask_kinds() >> k & 1)) continue;
    const MaskVolume &m = x.masks(static_cast<MaskKind>(k)), &n = y.masks(static_cast<MaskKind>(k));
    ASSERT_EQ(m.count(), n.count()) << k;
    for (const MaskRegion* region : m.regions())
      for (int i = 0; i < kLeavesPerRegion; ++i) {
        const LeafPos l = leaf_from_region(region->pos) + leaf_offset_in_region(i);
        ASSERT_EQ(m.leaf(l), n.leaf(l)) << k;
      }
  }
  ASSERT_EQ(a.world.store.take_dirty(a.subscriber), b.world.store.take_dirty(b.subscriber));
}

EditBatch voxel_by_voxel(std::span<const LeafWrite> writes) {
  EditBatch batch;
  for (const LeafWrite& write : writes)
    for (int i = 0; i < kLeafVoxels; ++i) batch.set(voxel_from_leaf(write.leaf) + offset_in_leaf(i), write.values[i]);
  return batch;
}

TEST(WriteLeaves, DoWhatABatchOfAllTheirVoxelsDoes) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    std::mt19937 rng(seed);
    Followed by_leaf, by_batch;
    const bool with_undo = seed % 2 == 0;
    const unsigned kinds = seed == 1 ? 0 : seed == 2 ? (1u << kMaskKinds) - 1 : rng() % (1u << kMaskKinds);
    for (Followed* f : {&by_leaf, &by_batch})
      for (int k = 0; k < kMaskKinds; ++k)
        if (kinds >> k & 1) (void)f->world.store.masks(static_cast<MaskKind>(k));
    std::map<RegionPos, uint64_t> seen_in_snapshot;
    for (int round = 0; round < 12; ++round) {
      // Leaves of several regions in any order, some twice.
      std::vector<Leaf> leaves(40);
      std::vector<LeafWrite> writes;
      for (Leaf& leaf : leaves) {
        const LeafPos l{static_cast<int>(rng() % 4) + 14, static_cast<int>(rng() % 3) - 1, static_cast<int>(rng() % 3)};
        leaf = changed_leaf(by_leaf.world.store, l, rng);
        writes.push_back({l, leaf.data()});
      }
      if (round == 6)
        for (Followed* f : {&by_leaf, &by_batch}) f->world.store.pack();
      const uint64_t before = by_leaf.world.store.content_hash();
      const std::vector<RegionPos> regions = by_leaf.world.store.regions();
      StoreSnapshot snapshot = by_leaf.world.store.snapshot(regions);
      Store as_it_was(*by_leaf.world.palette);
      for (const RegionPos& r : regions) {
        RegionBuilder copy(r);
        for (int i = 0; i < kLeavesPerRegion; ++i) {
          const LeafBlocks leaf = by_leaf.world.store.leaf(leaf_from_region(r) + leaf_offset_in_region(i));
          if (leaf.values)
            copy.set_leaf(i, std::span<const BlockId, kLeafVoxels>(leaf.values, kLeafVoxels));
          else
            copy.set_uniform(i, leaf.uniform);
        }
        as_it_was.adopt(std::move(copy));
      }
      const auto report = by_leaf.world.store.write_leaves(writes, with_undo ? &by_leaf.log : nullptr);
      const auto batch_report = by_batch.world.store.apply(voxel_by_voxel(writes), with_undo ? &by_batch.log : nullptr);
      ASSERT_TRUE(report.ok() && batch_report.ok());
      EXPECT_EQ(report->voxels_changed, batch_report->voxels_changed);
      EXPECT_EQ(report->leaves_changed, batch_report->leaves_changed);
      ASSERT_NO_FATAL_FAILURE(expect_equal(by_leaf, by_batch)) << "seed " << seed << ", round " << round;
      // The snapshot holds what was there before.
      for (size_t i = 0; i < snapshot.size(); ++i)
        for (int leaf = 0; leaf < kLeavesPerRegion; ++leaf) {
          const LeafBlocks was = as_it_was.leaf(leaf_from_region(regions[i]) + leaf_offset_in_region(leaf));
          for (int v = 0; v < kLeafVoxels; v += 7) ASSERT_EQ(snapshot.packed(i)->get(leaf, v), was[v]);
        }
      if (!with_undo || report->leaves_changed == 0) continue;
      EXPECT_EQ(by_leaf.log.bytes(), by_batch.log.bytes());
      const uint64_t after = by_leaf.world.store.content_hash();
      for (Followed* f : {&by_leaf, &by_batch}) ASSERT_TRUE(f->log.undo(f->world.store));
      EXPECT_EQ(by_leaf.world.store.content_hash(), before);
      ASSERT_NO_FATAL_FAILURE(expect_equal(by_leaf, by_batch));
      for (Followed* f : {&by_leaf, &by_batch}) ASSERT_TRUE(f->log.redo(f->world.store));
      EXPECT_EQ(by_leaf.world.store.content_hash(), after);
      ASSERT_NO_FATAL_FAILURE(expect_equal(by_leaf, by_batch));
      if (round % 4 == 3)
        for (Followed* f : {&by_leaf, &by_batch}) f->world.store.mark_saved();
    }
  }
}

TEST(WriteLeaves, ThatChangeNothingMarkNothing) {
  Followed f;
  Leaf leaf{};
  for (size_t i = 0; i < leaf.size(); ++i) leaf[i] = static_cast<BlockId>(i % 5);
  const LeafWrite write{{1, 2, 3}, leaf.data()};
  ASSERT_TRUE(f.world.store.write_leaves({&write, 1}).ok());
  f.world.store.mark_saved();
  EXPECT_EQ(f.world.store.take_dirty(f.subscriber), (std::vector<LeafPos>{{1, 2, 3}}));
  const auto again = f.world.store.write_leaves({&write, 1}, &f.log);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->leaves_changed, 0u);
  EXPECT_TRUE(f.world.store.unsaved().empty());
  EXPECT_TRUE(f.world.store.take_dirty(f.subscriber).empty());
  EXPECT_EQ(f.log.undo_steps(), 0u);
  const Leaf air{};
  const LeafWrite nothing{{100, 2, 3}, air.data()};
  ASSERT_TRUE(f.world.store.write_leaves({&nothing, 1}).ok());
  EXPECT_EQ(f.world.store.regions().size(), 1u);
}

TEST(WriteLeaves, OutsideOfTheWorldOrThePaletteAreAnErrorAndChangeNothing) {
  Followed f;
  Leaf good{}, bad{};
  good.fill(1);
  bad[511] = static_cast<BlockId>(f.world.palette->size());
  const auto refused = [&](LeafPos l, const Leaf& leaf) {
    const LeafWrite writes[] = {{{0, 0, 0}, good.data()}, {l, leaf.data()}};
    const auto result = f.world.store.write_leaves(writes);
    EXPECT_FALSE(result.ok());
    EXPECT_EQ(f.world.store.voxel_count(), 0u);
    return result.ok() ? "" : result.error().message;
  };
  EXPECT_NE(refused({1, 1, 1}, bad).find("palette"), std::string::npos);
  for (const int32_t beyond : {kWorldBorder / 8, -kWorldBorder / 8 - 1, INT32_MAX, INT32_MIN})
    EXPECT_NE(refused({0, beyond, 0}, good).find("border"), std::string::npos);
  const LeafWrite last[] = {{{kWorldBorder / 8 - 1, -kWorldBorder / 8, 0}, good.data()}};
  EXPECT_TRUE(f.world.store.write_leaves(last).ok());
}

}  // namespace
}  // namespace world
