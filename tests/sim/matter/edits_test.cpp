#include <gtest/gtest.h>

#include <thread>

#include "sim/matter/thermal.h"
#include "tests/sim/matter/matter_support.h"
#include "world/base/random.h"

namespace sim {
namespace {

using world::BlockId;
using world::EditBatch;
using world::Layer;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

/// A basin of bedrock with water on one side and sand above.
World basin() {
  World world(world::standard_blocks());
  fill(world, {{0, 0, 0}, {40, 20, 24}}, block_named(world, "bedrock"));
  fill(world, {{1, 1, 1}, {39, 20, 23}}, world::kAir);
  fill(world, {{1, 1, 1}, {12, 12, 23}}, block_named(world, "water"));
  fill(world, {{20, 14, 5}, {30, 19, 15}}, block_named(world, "sand"));
  return world;
}

void expect_exact(Matter& matter) {
  for (const LedgerRow& row : matter.ledger())
    EXPECT_TRUE(row.exact()) << row.substance << ": " << row.start << " + " << row.in << " - " << row.out << " is not "
                             << row.now;
}

/// The edit of a serial number: single voxels and boxes, of water, sand, stone and air.
EditBatch edit_of(const World& world, uint64_t serial) {
  constexpr const char* kBlocks[] = {"water", "sand", "stone", "air"};
  const uint64_t r = world::random_bits(21, static_cast<int64_t>(serial), 0, 0);
  const VoxelPos v{static_cast<int>(2 + r % 34), static_cast<int>(1 + (r >> 8) % 16),
                   static_cast<int>(2 + (r >> 16) % 18)};
  EditBatch batch;
  const BlockId block = block_named(world, kBlocks[r >> 32 & 3]);
  if (r >> 40 & 1)
    batch.set(v, block);
  else
    batch.fill({v, v + VoxelPos{2, 1, 2}}, block);
  return batch;
}
constexpr uint64_t kEdits = 400;
EditTime time_of(uint64_t serial) { return {30 + serial / 8, serial}; }

uint64_t run_with_threads(int threads) {
  World world = basin();
  Matter matter(world, {});
  std::vector<std::thread> editors;
  for (int t = 0; t < threads; ++t)
    editors.emplace_back([&, t] {
      for (uint64_t serial = static_cast<uint64_t>(t); serial < kEdits; serial += static_cast<uint64_t>(threads))
        ASSERT_TRUE(matter.edit(edit_of(world, serial), time_of(serial)).ok());
    });
  for (int i = 0; i < 20; ++i) matter.step();  // while they edit
  for (std::thread& editor : editors) editor.join();
  for (int i = 0; i < 80; ++i) matter.step();
  expect_exact(matter);
  return matter.state_hash();
}

TEST(MatterEdits, OfManyThreadsWhileItStepsAreThoseOfOne) {
  World world = basin();
  Matter matter(world, {});
  for (uint64_t serial = 0; serial < kEdits; ++serial)
    ASSERT_TRUE(matter.edit(edit_of(world, serial), time_of(serial)).ok());
  for (int i = 0; i < 100; ++i) matter.step();
  expect_exact(matter);
  for (const int threads : {1, 3, 8}) EXPECT_EQ(run_with_threads(threads), matter.state_hash()) << threads;
}

TEST(MatterEdits, AreThoseOfTheStoreAfterAFlush) {
  // The same edits by the queue, and by hand between ticks.
  World queued = basin(), by_hand = basin();
  Matter a(queued, {}), b(by_hand, {});
  for (uint64_t tick = 0; tick < 60; ++tick) {
    if (tick % 3 == 0) {
      const EditBatch batch = edit_of(queued, tick);
      ASSERT_TRUE(a.edit(batch).ok());
      EXPECT_FALSE(a.settled()) << "an edit waits";
      b.flush();
      ASSERT_TRUE(by_hand.store.apply(batch).ok());
    }
    a.step(), b.step();
    ASSERT_EQ(a.state_hash(), b.state_hash()) << tick;
  }
  expect_exact(a), expect_exact(b);
  const auto total = [](Matter& matter) {
    int64_t sum = 0;
    for (const LedgerRow& row : matter.ledger()) sum += row.in - row.out;
    return sum;
  };
  EXPECT_EQ(total(a), total(b));
}

TEST(MatterEdits, PutsMoreThanPagesHoldIntoTheStore) {
  World world = basin();
  Matter matter(world, {});
  for (int i = 0; i < 5; ++i) matter.step();
  EditBatch batch;
  batch.fill({{-200, 0, -200}, {-73, 7, -73}}, block_named(world, "stone"));
  batch.fill({{0, 0, 0}, {39, 63, 63}}, block_named(world, "sand"));  // over what moves
  ASSERT_TRUE(matter.edit(batch).ok());
  matter.step();
  expect_exact(matter);
  EXPECT_EQ(matter.amount(block_named(world, "stone")), int64_t{128} * 8 * 128 * kFullVoxel);
  EXPECT_EQ(matter.amount(block_named(world, "water")), 0);
  EXPECT_EQ(matter.amount(block_named(world, "sand")), int64_t{40} * 64 * 64 * kFullVoxel);
}

TEST(MatterEdits, CallForRulesThatNothingCalledFor) {
  World world(world::standard_blocks());
  fill(world, {{0, 0, 0}, {15, 3, 15}}, block_named(world, "stone"));
  Matter matter(world, {});
  for (int i = 0; i < 3; ++i) EXPECT_EQ(matter.step().leaves_visited, 0u);
  EditBatch batch;
  batch.set({8, 9, 8}, block_named(world, "sand"));
  ASSERT_TRUE(matter.edit(batch).ok());
  for (int i = 0; i < 20; ++i) matter.step();
  EXPECT_TRUE(matter.settled());
  EXPECT_EQ(world.store.get({8, 4, 8}), block_named(world, "sand"));
  expect_exact(matter);
  // One that calls for nothing is written too.
  World still(world::standard_blocks());
  fill(still, {{0, 0, 0}, {15, 3, 15}}, block_named(still, "stone"));
  Matter none(still, {});
  EditBatch stone;
  stone.set({8, 9, 8}, block_named(still, "stone"));
  ASSERT_TRUE(none.edit(stone).ok());
  none.step();
  EXPECT_EQ(still.store.get({8, 9, 8}), block_named(still, "stone"));
  EXPECT_TRUE(none.settled());
}

TEST(MatterEdits, OutsideOfTheWorldAreRefused) {
  World world = basin();
  Matter matter(world, {});
  EditBatch batch;
  batch.set({1, 1, 1}, block_named(world, "stone"));
  batch.set({world::kWorldBorder, 0, 0}, block_named(world, "stone"));
  const world::Status refused = matter.edit(batch);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("border"), std::string::npos);
  EditBatch unknown;
  unknown.set({1, 1, 1}, static_cast<BlockId>(world.palette->size()));
  EXPECT_FALSE(matter.edit(unknown).ok());
}

// CM13: a million wait, and nothing is dropped; more than fit are refused, and what waited is done.
TEST(CM13, AFullQueueRefusesAndLosesNothing) {
  World world(world::standard_blocks());
  fill(world, {{0, 0, 0}, {127, 0, 127}}, block_named(world, "stone"));
  Matter matter(world, {});
  const BlockId stone = block_named(world, "stone");
  EditBatch million;
  for (int i = 0; i < 1'000'000; ++i) million.set({i & 127, 1 + (i >> 14), i >> 7 & 127}, stone);
  ASSERT_TRUE(matter.edit(million).ok());
  ASSERT_TRUE(matter.edit(million).ok());
  EditBatch more;
  for (size_t i = 0; i < kMostWaitingEdits - 2'000'000 + 1; ++i) more.set({0, 100, 0}, stone);
  const world::Status full = matter.edit(more);
  ASSERT_FALSE(full.ok());
  EXPECT_NE(full.error().message.find("simulate a tick first"), std::string::npos);
  matter.step();
  EXPECT_EQ(matter.amount(stone), (128 * 128 + 1'000'000) * int64_t{kFullVoxel});
  EXPECT_TRUE(matter.edit(more).ok());
  expect_exact(matter);
}

// ---- what a voxel held ---------------------------------------------------------------------------------------------

TEST(MatterEdits, TakeTheAmountOfWhatTheyReplace) {
  for (const bool queue : {true, false}) {
    World world(world::standard_blocks());
    fill(world, {{0, 0, 0}, {15, 7, 15}}, block_named(world, "bedrock"));
    fill(world, {{3, 1, 3}, {3, 7, 3}}, world::kAir);
    fill(world, {{3, 1, 3}, {3, 2, 3}}, block_named(world, "water"));
    world.store.make_int_layer(Layer::liquid).set({3, 2, 3}, 1000);
    Matter matter(world, {});
    for (int i = 0; i < 10; ++i) matter.step();
    ASSERT_TRUE(matter.settled());
    const auto edit = [&](const char* block) {
      EditBatch batch;
      batch.set({3, 2, 3}, block_named(world, block));
      if (queue)
        ASSERT_TRUE(matter.edit(batch).ok());
      else
        ASSERT_TRUE(world.store.apply(batch).ok());
      matter.step();
      expect_exact(matter);
    };
    EXPECT_EQ(matter.amount_at({3, 2, 3}), 1000);
    edit("stone");
    EXPECT_EQ(matter.amount(block_named(world, "water")), kFullVoxel);
    edit("water");
    EXPECT_EQ(matter.amount_at({3, 2, 3}), kFullVoxel) << (queue ? "queue" : "store");
    EXPECT_EQ(matter.amount(block_named(world, "water")), 2 * kFullVoxel);
  }
}

TEST(MatterEdits, TakeTheHeatOfWhatTheyReplace) {
  for (const bool queue : {true, false}) {
    World world(world::standard_blocks());
    fill(world, {{0, 0, 0}, {15, 7, 15}}, block_named(world, "granite"));
    fill(world, {{8, 10, 8}, {8, 10, 8}}, block_named(world, "sand"));  // so that there are cells
    world.store.make_int_layer(Layer::heat).set({3, 3, 3}, 5000);
    world.store.make_int_layer(Layer::heat).set({4, 3, 3}, 700);
    Matter matter(world, {});
    matter.step();
    matter.flush();
    EditBatch batch;
    batch.set({3, 3, 3}, block_named(world, "stone"));
    if (queue)
      ASSERT_TRUE(matter.edit(batch).ok());
    else
      ASSERT_TRUE(world.store.apply(batch).ok());
    matter.step();
    matter.flush();
    const world::IntLayer* heat = world.store.find_int_layer(Layer::heat);
    ASSERT_NE(heat, nullptr);
    EXPECT_EQ(heat->get({3, 3, 3}), 0) << (queue ? "queue" : "store");
    EXPECT_EQ(heat->get({4, 3, 3}), 700);
    expect_exact(matter);
    const std::vector<LedgerRow> rows = matter.ledger();
    ASSERT_TRUE(rows.back().is_heat);
    EXPECT_EQ(rows.back().start, 5700);
    EXPECT_EQ(rows.back().out, 5000);
    EXPECT_EQ(rows.back().now, 700);
  }
}

TEST(MatterEdits, UndoBringsAFullVoxelBack) {
  World world(world::standard_blocks());
  fill(world, {{0, 0, 0}, {7, 0, 7}}, block_named(world, "bedrock"));
  fill(world, {{3, 1, 3}, {3, 1, 3}}, block_named(world, "water"));
  world.store.make_int_layer(Layer::liquid).set({3, 1, 3}, 1000);
  world::UndoLog undo;
  EditBatch batch;
  batch.set({3, 1, 3}, block_named(world, "stone"));
  ASSERT_TRUE(world.store.apply(batch, &undo).ok());
  EXPECT_FALSE(world.store.find_int_layer(Layer::liquid)->active({3, 1, 3}));
  ASSERT_TRUE(undo.undo(world.store));
  EXPECT_EQ(world.store.get({3, 1, 3}), block_named(world, "water"));
  EXPECT_FALSE(world.store.find_int_layer(Layer::liquid)->active({3, 1, 3}));
}

/// A grain that falls through warm air, where no fluid is near: it changes places with what was there.
TEST(MatterEdits, AGrainThatComesLeavesTheHeatOfTheAirItPushesAway) {
  World world(world::standard_blocks());
  fill(world, {{0, 0, 0}, {23, 0, 23}}, block_named(world, "bedrock"));
  fill(world, {{11, 14, 11}, {12, 17, 12}}, block_named(world, "sand"));
  world::IntLayer& heat = world.store.make_int_layer(Layer::heat);
  int64_t before = 0;
  for (int y = 1; y < 12; ++y)
    for (int x = 8; x < 16; ++x) heat.set({x, y, 11}, 100 * y + x), before += 100 * y + x;
  Matter matter(world, {});
  for (int i = 0; i < 60 && !matter.settled(); ++i) matter.step();
  ASSERT_TRUE(matter.settled());
  const std::vector<LedgerRow> rows = matter.ledger();
  ASSERT_TRUE(rows.back().is_heat);
  EXPECT_EQ(rows.back().now, before);
  EXPECT_EQ(rows.back().in + rows.back().out, 0);
  int64_t on_sand = 0;
  const world::IntLayer* after = world.store.find_int_layer(Layer::heat);
  for (int x = 0; x < 24; ++x)
    for (int y = 0; y < 24; ++y)
      for (int z = 0; z < 24; ++z)
        if (world.store.get({x, y, z}) == block_named(world, "sand")) on_sand += after->get({x, y, z});
  EXPECT_EQ(on_sand, 0) << "sand came cold, and the air stays warm";
}

}  // namespace
}  // namespace sim
