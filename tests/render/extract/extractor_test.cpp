#include "render/extract/extractor.h"

#include <gtest/gtest.h>

#include "tests/render/extract/worlds.h"
#include "world/base/jobs.h"

namespace render {
namespace {

void expect_equal(const Extractor& a, const Extractor& b) {
  ASSERT_EQ(a.chunks().size(), b.chunks().size());
  for (size_t i = 0; i < a.chunks().size(); ++i) {
    const ExtractedChunk &x = *a.chunks()[i], &y = *b.chunks()[i];
    EXPECT_EQ(x.pos, y.pos);
    EXPECT_EQ(x.origin, y.origin);
    EXPECT_EQ(x.records, y.records);
    EXPECT_EQ(x.first, y.first);
    EXPECT_EQ(x.bounds, y.bounds);
    EXPECT_EQ(x.all_bounds, y.all_bounds);
    EXPECT_EQ(x.faces, y.faces);
  }
}

TEST(Extractor, FollowingEditsEqualsExtractingAnew) {
  for (const bool merge : {true, false}) {
    World w = small_world();
    const VoxelPos origin{-40, 100, -20};
    fill(w, box_at(origin, 100, 60, 80), terrain_blocks(origin, 25));
    const int subscriber = w.store.subscribe();
    Extractor following;
    following.rebuild(WorldView(w), {merge, true});
    for (uint64_t round = 0; round < 20; ++round) {
      EditBatch batch;
      for (uint64_t i = 0; i < 1 + round * 4; ++i) {
        const uint64_t r = random_bits(5, static_cast<int64_t>(round), static_cast<int64_t>(i), 0);
        const VoxelPos v = origin + VoxelPos{static_cast<int>(r % 110), static_cast<int>(r / 110 % 64),
                                             static_cast<int>(r / 7040 % 90)};
        const BlockId block = static_cast<BlockId>(r >> 40) % 6;
        if (i % 16 == 15) {
          batch.fill({v, v + VoxelPos{9, 9, 9}}, block);
        } else {
          batch.set(v, block);
        }
      }
      ASSERT_TRUE(w.store.apply(batch).ok());
      const WorldView view(w);
      const ExtractReport report = following.update(view, w.store.take_dirty(subscriber));
      Extractor anew;
      const ExtractReport full = anew.rebuild(view, {merge, true});
      expect_equal(following, anew);
      EXPECT_EQ(report.faces, full.faces);
      EXPECT_EQ(report.quads, full.quads);
      EXPECT_EQ(report.chunks, full.chunks);
    }
    // Nothing left: no chunk left.
    EditBatch clear;
    clear.fill(w.store.bounds(), kAir);
    ASSERT_TRUE(w.store.apply(clear).ok());
    EXPECT_EQ(following.update(WorldView(w), w.store.take_dirty(subscriber)).chunks, 0u);
    EXPECT_TRUE(following.chunks().empty());
  }
}

TEST(Extractor, OneVoxelTouchesItsLeafSixNeighboursAndTheirChunksOnly) {
  World w = small_world();
  fill(w, box_at({0, 0, 0}, 192, 64, 192), terrain_blocks({0, 0, 0}, 30));
  const int subscriber = w.store.subscribe();
  Extractor extractor;
  const ExtractReport all = extractor.rebuild(WorldView(w), {true, true});
  EXPECT_EQ(all.chunks_merged, 9u);
  std::vector<uint64_t> versions;
  for (const ExtractedChunk* chunk : extractor.chunks()) versions.push_back(chunk->version);

  const auto edit = [&](VoxelPos v, BlockId block) {
    EditBatch batch;
    batch.set(v, block);
    EXPECT_TRUE(w.store.apply(batch).ok());
    return extractor.update(WorldView(w), w.store.take_dirty(subscriber));
  };
  // In the middle of a chunk and of a leaf, in the air.
  const ExtractReport middle = edit({100, 60, 100}, kStone);
  EXPECT_EQ(middle.leaves_extracted, 7u);
  EXPECT_EQ(middle.chunks_merged, 1u);
  EXPECT_EQ(middle.faces, all.faces + 6);
  size_t changed = 0;
  for (size_t i = 0; i < versions.size(); ++i) changed += extractor.chunks()[i]->version != versions[i];
  EXPECT_EQ(changed, 1u);
  // A second kind of block in its place: the masks stay, the record changes.
  EXPECT_EQ(edit({100, 60, 100}, kDirt).chunks_merged, 1u);
  // A block that covers a face of the next chunk's voxel: both chunks.
  EXPECT_EQ(edit({63, 60, 100}, kStone).chunks_merged, 1u);
  const ExtractReport beside = edit({64, 60, 100}, kStone);
  EXPECT_EQ(beside.leaves_extracted, 7u);
  EXPECT_EQ(beside.chunks_merged, 2u);
  EXPECT_EQ(beside.faces, all.faces + 6 + 6 + 6 - 2);
  // Nothing changed: nothing is done.
  EXPECT_EQ(extractor.update(WorldView(w), {}).leaves_extracted, 0u);
}

TEST(Extractor, SameForAnyNumberOfThreads) {
  World w = small_world();
  fill(w, box_at({-100, 0, -100}, 200, 64, 200), terrain_blocks({0, 0, 0}, 30));
  const WorldView view(w);
  Extractor one, many;
  {
    ThreadLimit limit(1);
    one.rebuild(view, {true, false});
  }
  many.rebuild(view, {true, false});
  expect_equal(one, many);
}

TEST(Extractor, AnOpenedCavityShowsItsFaces) {
  World w = small_world();
  EditBatch batch;
  batch.fill(box_at({-20, -20, -20}, 60, 60, 60), kStone);
  batch.fill(box_at({-10, -10, -10}, 40, 40, 40), kAir);
  ASSERT_TRUE(w.store.apply(batch).ok());
  const int subscriber = w.store.subscribe();
  Extractor extractor;
  EXPECT_EQ(extractor.rebuild(WorldView(w), {true, false}).faces, 6u * 60 * 60);
  EXPECT_TRUE(extractor.in_sealed_cavity({0, 0, 0}));
  batch = {};
  batch.fill({{-20, 3, 3}, {-11, 3, 3}}, kAir);
  ASSERT_TRUE(w.store.apply(batch).ok());
  const WorldView view(w);
  const ExtractReport report = extractor.update(view, w.store.take_dirty(subscriber));
  EXPECT_FALSE(extractor.in_sealed_cavity({0, 0, 0}));
  EXPECT_EQ(report.faces, 6u * 60 * 60 + 6u * 40 * 40 - 2 + 4 * 10);
  Extractor anew;
  anew.rebuild(view, {true, false});
  expect_equal(extractor, anew);
}

/// A plate of 2048 x 128 voxels, 32 chunks long, with bumps.
World long_plate() {
  World w = small_world();
  EditBatch batch;
  batch.fill({{0, 0, 0}, {2047, 3, 127}}, 1);
  for (int i = 0; i < 500; ++i) {
    const uint64_t r = random_bits(9, i, 0, 0);
    const VoxelPos v{static_cast<int>(r % 2040), 3, static_cast<int>(r / 2048 % 120)};
    batch.fill({v, v + VoxelPos{7, static_cast<int>(r >> 40) % 9, 7}}, 2);
  }
  CHECK(w.store.apply(batch).ok());
  return w;
}

TEST(Extractor, NearAPlaceItHoldsWhatAllOfTheWorldHasThereAndLittleMore) {
  World w = long_plate();
  const int subscriber = w.store.subscribe();
  const double need = 200;
  Extractor near;
  near.rebuild(WorldView(w), {true, true}, {{0, 0, 0}, need});
  // There and back, with edits near, far, in what was air, and in what is only kept.
  for (int step = 0; step <= 40; ++step) {
    const ChunkRange range{{step <= 20 ? step : 40 - step, 0, 0}, need};
    EditBatch batch;
    batch.set({(step * 331) % 2048, 4 + step % 3, step}, 2);
    batch.set({(step * 64 + 700) % 2048, 70 + step, 5}, 1);
    batch.fill({{step * 40, 1, 20}, {step * 40 + 9, 5, 24}}, kAir);
    ASSERT_TRUE(w.store.apply(batch).ok());
    const WorldView view(w);
    near.update(view, w.store.take_dirty(subscriber));
    near.follow(view, range);
    Extractor all;
    all.rebuild(view, {true, true});
    std::vector<const ExtractedChunk*> needed;
    for (const ExtractedChunk* c : near.chunks()) {
      EXPECT_TRUE(range.keeps(c->pos));
      if (range.needs(c->pos)) needed.push_back(c);
    }
    size_t found = 0;
    for (const ExtractedChunk* c : all.chunks()) {
      if (!range.needs(c->pos)) continue;
      ASSERT_LT(found, needed.size());
      EXPECT_EQ(needed[found]->pos, c->pos);
      EXPECT_EQ(needed[found]->records, c->records);
      EXPECT_EQ(needed[found++]->all_bounds, c->all_bounds);
    }
    EXPECT_EQ(found, needed.size());
    EXPECT_LT(near.bytes(), 0.7 * static_cast<double>(all.bytes()));
  }
  // All of it again.
  near.follow(WorldView(w), {});
  Extractor all;
  all.rebuild(WorldView(w), {true, true});
  expect_equal(near, all);
}

TEST(Extractor, LeavesNothingUnpackedInTheWorld) {
  World w = long_plate();
  w.store.pack();
  w.store.masks(MaskKind::occupied);
  w.store.masks(MaskKind::opaque);
  const size_t before = w.store.bytes_memory();
  Extractor extractor;
  EXPECT_GT(extractor.rebuild(WorldView(w), {true, true}).faces, 0u);
  EXPECT_EQ(w.store.bytes_memory(), before);
}

}  // namespace
}  // namespace render
