#include "world/store/packed_region.h"

#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "world/store/snapshot.h"

namespace world {
namespace {

/// A region whose leaves hold 1, 2, 3, 4, 5, 8, 9, 16, 17, 40, 256, 300 or 512 distinct blocks.
struct VariedRegion {
  std::vector<BlockId> values = std::vector<BlockId>(size_t{kLeavesPerRegion} * kLeafVoxels);
  LeafBlocks leaf(int i) const {
    const BlockId* p = &values[static_cast<size_t>(i) * kLeafVoxels];
    if (std::all_of(p, p + kLeafVoxels, [&](BlockId b) { return b == *p; })) return {nullptr, *p};
    return {p, kAir};
  }
};

VariedRegion varied_region(int block_limit) {
  VariedRegion region;
  std::mt19937 rng(7);
  const int kinds[] = {1, 1, 2, 3, 4, 5, 8, 9, 16, 17, 40, 256, 300, 512};
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    const int count = kinds[rng() % std::size(kinds)];
    std::vector<BlockId> blocks(static_cast<size_t>(count));
    for (BlockId& b : blocks) b = static_cast<BlockId>(rng() % static_cast<unsigned>(block_limit));
    for (int v = 0; v < kLeafVoxels; ++v)
      region.values[static_cast<size_t>(i * kLeafVoxels + v)] =
          v < count ? blocks[static_cast<size_t>(v)] : blocks[rng() % blocks.size()];
  }
  return region;
}

TEST(PackedRegion, ReadsBackWhatWasPackedByEveryWayOfReading) {
  for (const int limit : {3, 200, 65536}) {
    const VariedRegion region = varied_region(limit);
    const PackedRegion packed([&](int i) { return region.leaf(i); });
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const LeafBlocks expected = region.leaf(i), thawed = packed.leaf(i);
      ASSERT_EQ(packed.is_mixed(i), expected.values != nullptr);
      BlockId unpacked[kLeafVoxels];
      if (expected.values) packed.unpack(i, unpacked);
      for (int v = 0; v < kLeafVoxels; ++v) {
        ASSERT_EQ(packed.get(i, v), expected[v]) << "leaf " << i << ", voxel " << v;
        ASSERT_EQ(thawed[v], expected[v]);
        if (expected.values) {
          ASSERT_EQ(unpacked[v], expected[v]);
        }
      }
    }
  }
}

TEST(PackedRegion, MasksAndCountsEqualThoseOfPlainBlocks) {
  const VariedRegion region = varied_region(200);
  const PackedRegion packed([&](int i) { return region.leaf(i); });
  std::mt19937 rng(3);
  std::vector<uint8_t> bits(200);
  for (uint8_t& b : bits) b = static_cast<uint8_t>(rng());
  std::vector<int64_t> counts(200, 0), expected(200, 0);
  packed.count(counts);
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    const LeafMask mask = packed.mask(i, bits, 2);
    for (int v = 0; v < kLeafVoxels; ++v) {
      const BlockId b = region.leaf(i)[v];
      ++expected[b];
      ASSERT_EQ(mask.test(v), (bits[b] >> 2 & 1) != 0);
    }
  }
  EXPECT_EQ(counts, expected);
}

TEST(PackedRegion, TwoBlocksCostABitAVoxelAndUniformLeavesAHundredthOfIt) {
  std::vector<BlockId> leaf(kLeafVoxels, 5);
  leaf[17] = 9;
  const PackedRegion mixed([&](int) { return LeafBlocks{leaf.data(), kAir}; });
  EXPECT_LT(static_cast<double>(mixed.bytes()) / (128.0 * 128 * 128), 1.0 / 8 + 0.04);  // and 16 bytes a leaf
  const PackedRegion uniform([&](int i) { return LeafBlocks{nullptr, static_cast<BlockId>(i < 2048 ? 5 : 0)}; });
  EXPECT_LT(uniform.bytes(), 2000u);
}

TEST(PackedRegion, ManyThreadsMayUnpackTheSameLeaves) {
  const VariedRegion region = varied_region(9);
  const PackedRegion packed([&](int i) { return region.leaf(i); });
  const size_t at_rest = packed.bytes();
  std::vector<std::thread> threads;
  std::atomic<int> wrong{0};
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < kLeavesPerRegion; ++i)
        for (int v = 0; v < kLeafVoxels; v += 37) wrong += packed.leaf(i)[v] != region.leaf(i)[v];
    });
  for (std::thread& t : threads) t.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(packed.thaw_bytes(), packed.mixed_leaves() * (kLeafVoxels * sizeof(BlockId) + sizeof(BlockId*)));
  packed.refreeze();
  EXPECT_EQ(packed.bytes(), at_rest);
}

// ---- packed regions in a store ---------------------------------------------------------------------------------

BlockPalette palette_of(int blocks) {
  BlockPalette palette;
  for (int i = 1; i < blocks; ++i) {
    Block block;
    block.name = "block_" + std::to_string(i);
    block.opaque = i % 3 != 0;
    EXPECT_TRUE(palette.add(block).ok());
  }
  return palette;
}

EditBatch random_edits(std::mt19937& rng, int count, int blocks) {
  EditBatch batch;
  for (int i = 0; i < count; ++i) {
    const VoxelPos v{int(rng() % 300) - 150, int(rng() % 200) - 100, int(rng() % 300) - 150};
    const auto block = static_cast<BlockId>(rng() % static_cast<unsigned>(blocks));
    if (rng() % 4)
      batch.set(v, block);
    else
      batch.fill({v, v + VoxelPos{int(rng() % 20), int(rng() % 20), int(rng() % 20)}}, block);
  }
  return batch;
}

TEST(PackedStore, PackingChangesNoAnswer) {
  const BlockPalette palette = palette_of(40);
  Store store(palette), twin(palette);
  std::mt19937 rng(11);
  for (int round = 0; round < 6; ++round) {
    const EditBatch batch = random_edits(rng, 400, 40);
    ASSERT_TRUE(store.apply(batch).ok());
    ASSERT_TRUE(twin.apply(batch).ok());
    if (round == 1) (void)store.masks(MaskKind::opaque);
    if (round % 2 == 0) {
      store.pack();
    } else {
      for (const RegionPos& r : store.regions())
        if (rng() % 2) store.pack(r);
    }
    EXPECT_EQ(store.content_hash(), twin.content_hash());
    EXPECT_EQ(store.census(), twin.census());
    EXPECT_EQ(store.bounds(), twin.bounds());
    EXPECT_EQ(store.regions(), twin.regions());
    EXPECT_EQ(store.mixed_leaves(), twin.mixed_leaves());
    EXPECT_EQ(store.masks(MaskKind::opaque).count(), twin.masks(MaskKind::opaque).count());
    StoreReader reader(store);
    for (int i = 0; i < 20000; ++i) {
      const VoxelPos v{int(rng() % 330) - 160, int(rng() % 230) - 110, int(rng() % 330) - 160};
      ASSERT_EQ(reader.get(v), twin.get(v));
      ASSERT_EQ(store.get(v), twin.get(v));
      if (i % 50 == 0) {
        ASSERT_EQ(reader.leaf(leaf_from_voxel(v))[index_in_leaf(v)], twin.get(v));
      }
    }
  }
  EXPECT_LT(store.bytes_memory(), twin.bytes_memory() / 2);
}

TEST(PackedStore, UndoReachesThroughPacking) {
  const BlockPalette palette = palette_of(10);
  Store store(palette);
  std::mt19937 rng(2);
  ASSERT_TRUE(store.apply(random_edits(rng, 100, 10)).ok());
  const uint64_t before = store.content_hash();
  UndoLog log;
  ASSERT_TRUE(store.apply(random_edits(rng, 100, 10), &log).ok());
  const uint64_t after = store.content_hash();
  store.pack();
  ASSERT_TRUE(log.undo(store));
  EXPECT_EQ(store.content_hash(), before);
  store.pack();
  ASSERT_TRUE(log.redo(store));
  EXPECT_EQ(store.content_hash(), after);
}

TEST(PackedStore, EvictedRegionsReadAsAirAndComeBackByInstall) {
  const BlockPalette palette = palette_of(10);
  Store store(palette);
  std::mt19937 rng(4);
  ASSERT_TRUE(store.apply(random_edits(rng, 300, 10)).ok());
  (void)store.masks(MaskKind::occupied);
  store.mark_saved();
  const int follower = store.subscribe();
  const uint64_t before = store.content_hash();
  const Census census = store.census();
  const RegionPos r = store.regions().front();
  RegionBuilder copy(r);
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    const LeafBlocks leaf = store.leaf(leaf_from_region(r) + leaf_offset_in_region(i));
    if (leaf.values)
      copy.set_leaf(i, std::span<const BlockId, kLeafVoxels>(leaf.values, kLeafVoxels));
    else
      copy.set_uniform(i, leaf.uniform);
  }
  PreparedRegion prepared(copy, palette, store.mask_kinds());
  store.evict(r);
  EXPECT_NE(store.content_hash(), before);
  EXPECT_TRUE(store.region_census(r).empty());
  EXPECT_EQ(store.masks(MaskKind::occupied).region(r), nullptr);
  EXPECT_FALSE(store.take_dirty(follower).empty());
  store.install(std::move(prepared));
  EXPECT_EQ(store.content_hash(), before);
  EXPECT_EQ(store.census(), census);
  EXPECT_EQ(store.masks(MaskKind::occupied).count(), store.voxel_count());
  EXPECT_TRUE(store.unsaved().empty()) << "what a save holds already is no change";
}

TEST(StoreSnapshot, HoldsTheWorldOfItsMomentWhileAnotherThreadReadsIt) {
  const BlockPalette palette = palette_of(10);
  std::mt19937 rng(9);
  for (int round = 0; round < 8; ++round) {
    Store store(palette), moment(palette);
    const EditBatch first = random_edits(rng, 200, 10);
    ASSERT_TRUE(store.apply(first).ok());
    ASSERT_TRUE(moment.apply(first).ok());
    if (round % 2) store.pack();
    const std::vector<RegionPos> regions = store.unsaved();
    StoreSnapshot snapshot = store.snapshot(regions);
    store.mark_saved();
    std::vector<std::shared_ptr<const PackedRegion>> copies(regions.size());
    std::thread writer([&] {
      for (size_t i = 0; i < regions.size(); ++i) copies[i] = snapshot.packed(i);
    });
    for (int edit = 0; edit < 20; ++edit) ASSERT_TRUE(store.apply(random_edits(rng, 20, 10)).ok());
    writer.join();
    for (size_t i = 0; i < regions.size(); ++i)
      for (int l = 0; l < kLeavesPerRegion; ++l) {
        const LeafBlocks expected = moment.leaf(leaf_from_region(regions[i]) + leaf_offset_in_region(l));
        for (int v = 0; v < kLeafVoxels; v += 5) ASSERT_EQ(copies[i] ? copies[i]->get(l, v) : kAir, expected[v]);
      }
    EXPECT_FALSE(store.unsaved().empty());
  }
}

TEST(StoreSnapshot, OutlivesItsStore) {
  const BlockPalette palette = palette_of(4);
  StoreSnapshot snapshot;
  {
    Store store(palette);
    EditBatch batch;
    batch.set({1, 2, 3}, 2);
    ASSERT_TRUE(store.apply(batch).ok());
    snapshot = store.snapshot(store.unsaved());
  }
  ASSERT_EQ(snapshot.size(), 1u);
  EXPECT_EQ(snapshot.packed(0)->get(0, index_in_leaf({1, 2, 3})), 2);
}

}  // namespace
}  // namespace world
