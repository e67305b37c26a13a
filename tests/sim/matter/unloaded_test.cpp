/// CM12: regions that go while something moves, and come again.
#include <gtest/gtest.h>

#include <optional>

#include "tests/sim/matter/matter_support.h"

namespace sim {
namespace {

using world::BlockId;
using world::Layer;
using world::RegionPos;
using world::VoxelPos;
using world::World;

constexpr RegionPos kEast{1, 0, 0};
constexpr int kBorder = world::kRegionSize;

/// A region that isn't in the store: its blocks and layers.
struct Stored {
  std::vector<std::pair<world::LeafPos, std::array<BlockId, world::kLeafVoxels>>> leaves;
  std::vector<std::pair<Layer, world::AnyLayer>> layers;
};

Stored take_out(World& world, RegionPos r) {
  Stored stored;
  world::StoreReader reader(world.store);
  for (int i = 0; i < world::kLeavesPerRegion; ++i) {
    const world::LeafPos l = world::leaf_from_region(r) + world::leaf_offset_in_region(i);
    const world::LeafBlocks leaf = reader.leaf(l);
    if (!leaf.values && leaf.uniform == world::kAir) continue;
    auto& [pos, values] = stored.leaves.emplace_back();
    pos = l;
    for (int v = 0; v < world::kLeafVoxels; ++v) values[static_cast<size_t>(v)] = leaf[v];
  }
  for (const Layer layer : {Layer::liquid, Layer::gas, Layer::heat})
    if (const world::IntLayer* values = world.store.find_int_layer(layer); values && values->holds(r))
      stored.layers.emplace_back(layer, values->copy_of(std::span(&r, 1)));
  world.store.evict(r);
  return stored;
}

void put_back(World& world, RegionPos r, Stored& stored) {
  std::vector<world::LeafWrite> writes;
  for (const auto& [pos, values] : stored.leaves) writes.push_back({pos, values.data()});
  ASSERT_TRUE(world.store.write_leaves(writes).ok());
  for (auto& [layer, values] : stored.layers) world.store.install(layer, r, std::move(values));
}

/// A trough of bedrock across the border between two regions; what is to move lies in the western half.
World trough() {
  World world(world::standard_blocks());
  fill(world, {{kBorder - 24, 0, 0}, {kBorder + 23, 14, 15}}, block_named(world, "bedrock"));
  fill(world, {{kBorder - 23, 1, 1}, {kBorder + 22, 14, 14}}, world::kAir);
  return world;
}

void expect_exact(Matter& matter) {
  for (const LedgerRow& row : matter.ledger())
    EXPECT_TRUE(row.exact()) << row.substance << ": " << row.start << " + " << row.in << " - " << row.out << " is not "
                             << row.now;
}

int settle(Matter& matter, int most) {
  int ticks = 0;
  while (!matter.settled() && ticks < most) matter.step(), ++ticks;
  EXPECT_TRUE(matter.settled());
  return ticks;
}

/// How much of a block there is from x on.
int64_t amount_east(World& world, Matter& matter, const char* block) {
  matter.flush();
  const BlockId id = block_named(world, block);
  int64_t sum = 0;
  for (int x = kBorder; x < kBorder + 24; ++x)
    for (int y = 0; y < 15; ++y)
      for (int z = 0; z < 16; ++z)
        if (world.store.get({x, y, z}) == id)
          sum += matter.amount_at({x, y, z}) ? matter.amount_at({x, y, z}) : kFullVoxel;
  return sum;
}

TEST(CM12, WaterWaitsAsleepAtWhatIsAwayAndGoesOnWhenItComes) {
  World world = trough();
  fill(world, {{kBorder - 12, 1, 1}, {kBorder - 1, 8, 14}}, block_named(world, "water"));
  const BlockId water = block_named(world, "water");
  const int64_t all = int64_t{12} * 8 * 14 * kFullVoxel;
  Matter matter(world, {});
  Stored east = take_out(world, kEast);
  matter.set_unloaded(kEast, true);
  settle(matter, 3000);
  EXPECT_EQ(matter.amount(water), all);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(matter.step().leaves_visited, 0u) << "it doesn't ask again and again";
  put_back(world, kEast, east);
  matter.set_unloaded(kEast, false);
  for (int i = 0; i < 12; ++i) matter.step();
  EXPECT_GT(amount_east(world, matter, "water"), 0);
  // Out again while it flows, and in, with its partial voxels.
  for (int round = 0; round < 4; ++round) {
    EXPECT_FALSE(matter.settled());
    matter.flush();
    const int64_t there = amount_east(world, matter, "water");
    east = take_out(world, kEast);
    matter.set_unloaded(kEast, true);
    for (int i = 0; i < 10; ++i) matter.step();
    expect_exact(matter);
    EXPECT_EQ(matter.amount(water), all - there) << "what went is booked, and nothing else";
    matter.flush();
    put_back(world, kEast, east);
    matter.set_unloaded(kEast, false);
    for (int i = 0; i < 5; ++i) matter.step();
    expect_exact(matter);
    EXPECT_EQ(matter.amount(water), all);
  }
  settle(matter, 6000);
  EXPECT_EQ(matter.amount(water), all);
  EXPECT_GT(amount_east(world, matter, "water"), all / 3) << "it stands level on both sides";
}

TEST(CM12, WaterThatWentAwayIsNoLongerWatched) {
  World world = trough();
  fill(world, {{kBorder + 14, 1, 1}, {kBorder + 22, 8, 14}}, block_named(world, "water"));
  Matter matter(world, {});
  for (int i = 0; i < 5; ++i) matter.step();
  EXPECT_GT(matter.awake_leaves(), 0u);
  matter.flush();
  take_out(world, kEast);
  matter.set_unloaded(kEast, true);
  // What is left is dry, and looks once.
  matter.step(), matter.step();
  EXPECT_TRUE(matter.settled()) << matter.awake_leaves();
}

TEST(CM12, GrainsWaitAtWhatIsAway) {
  World world = trough();
  fill(world, {{kBorder - 3, 1, 4}, {kBorder - 1, 14, 11}}, block_named(world, "sand"));
  const BlockId sand = block_named(world, "sand");
  const int64_t all = int64_t{3} * 14 * 8 * kFullVoxel;
  Matter matter(world, {});
  Stored east = take_out(world, kEast);
  matter.set_unloaded(kEast, true);
  settle(matter, 1000);
  EXPECT_EQ(matter.amount(sand), all);
  put_back(world, kEast, east);
  matter.set_unloaded(kEast, false);
  settle(matter, 1000);
  EXPECT_EQ(matter.amount(sand), all);
  EXPECT_GT(amount_east(world, matter, "sand"), all / 10) << "the heap slid over the border";
}

TEST(CM12, HeatWaitsAtWhatIsAway) {
  World world(world::standard_blocks());
  fill(world, {{kBorder - 8, 0, 0}, {kBorder + 7, 7, 7}}, block_named(world, "copper_block"));
  world::IntLayer& heat = world.store.make_int_layer(Layer::heat);
  for (int y = 0; y < 8; ++y)
    for (int z = 0; z < 8; ++z) heat.set({kBorder - 1, y, z}, 100000000);
  MatterOptions options;
  options.effects = {"heat"};
  options.knobs.heat_speed = 20;
  Matter matter(world, options);
  Stored east = take_out(world, kEast);
  matter.set_unloaded(kEast, true);
  for (int i = 0; i < 30; ++i) matter.step();
  expect_exact(matter);
  matter.flush();
  EXPECT_FALSE(world.store.find_int_layer(Layer::heat)->active({kBorder, 3, 3}));
  put_back(world, kEast, east);
  matter.set_unloaded(kEast, false);
  for (int i = 0; i < 30; ++i) matter.step();
  matter.flush();
  EXPECT_GT(world.store.find_int_layer(Layer::heat)->get({kBorder, 3, 3}), 100000);
  expect_exact(matter);
}

TEST(CM12, EditsOfWhatIsAwayWaitUntilItIsThere) {
  World world = trough();
  fill(world, {{kBorder - 12, 1, 1}, {kBorder - 12, 8, 14}}, block_named(world, "water"));
  Matter matter(world, {});
  Stored east = take_out(world, kEast);
  matter.set_unloaded(kEast, true);
  world::EditBatch batch;
  batch.fill({{kBorder - 2, 5, 5}, {kBorder + 1, 5, 5}}, block_named(world, "stone"));
  ASSERT_TRUE(matter.edit(batch).ok());
  for (int i = 0; i < 3; ++i) matter.step();
  EXPECT_EQ(matter.amount(block_named(world, "stone")), 2 * kFullVoxel);
  EXPECT_TRUE(world.store.region_census(kEast).empty());
  matter.flush();
  put_back(world, kEast, east);
  matter.set_unloaded(kEast, false);
  EXPECT_FALSE(matter.settled());
  matter.step();
  EXPECT_EQ(matter.amount(block_named(world, "stone")), 4 * kFullVoxel);
  expect_exact(matter);
}

// A crate that slides towards a region that is away waits at its border with its velocity, and goes on.
TEST(CM12, ABodyWaitsForTheRegion) {
  World world = trough();
  world.simulation.bodies = {{.name = "crate",
                              .position = world::WorldPoint::from(kBorder - 4, 1, 8),
                              .size = {1, 1, 1},
                              .velocity = {8, 0, 0},
                              .density_kg_per_m3 = 600,
                              .friction = 0}};
  Matter matter(world, {});
  ASSERT_TRUE(matter.begin().ok());
  const auto x = [&] { return from_fixed(matter.bodies()->all()[0].box.min).x; };
  matter.set_unloaded(kEast, true);
  Stored stored = take_out(world, kEast);
  for (int i = 0; i < 60; ++i) matter.step();
  EXPECT_LT(x(), kBorder - 1.0);
  EXPECT_GT(x(), kBorder - 2.0);
  EXPECT_FALSE(matter.settled()) << "it waits";
  put_back(world, kEast, stored);
  matter.set_unloaded(kEast, false);
  for (int i = 0; i < 20; ++i) matter.step();
  EXPECT_GT(x(), kBorder + 2.0);
}

}  // namespace
}  // namespace sim
