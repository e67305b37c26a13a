/// Books of matter where much happens at once: grains and liquids in large numbers, and energy where lava meets the
/// sea.
#include <gtest/gtest.h>

#include "sim/matter/matter.h"
#include "world/scenes/scene.h"

namespace sim {
namespace {

using world::BlockId;
using world::World;

BlockId named(const World& world, const char* name) { return world.palette->find(name).value(); }
void fill(World& world, const world::VoxelBox& box, BlockId block) {
  world::EditBatch batch;
  batch.fill(box, block);
  CHECK(world.store.apply(batch).ok());
}

TEST(MatterBooks, AMillionGrainsDroppedAtOnceComeToRestAndNoneIsLost) {
  World world(world::standard_blocks());
  const BlockId sand = named(world, "sand");
  fill(world, {{-100, 0, -100}, {199, 0, 199}}, named(world, "bedrock"));
  fill(world, {{0, 20, 0}, {99, 119, 99}}, sand);
  Matter matter(world, {});
  int ticks = 0;
  while (!matter.settled() && ticks < 8000) {
    matter.step(), ++ticks;
    if (ticks % 400 != 0) continue;
    ASSERT_EQ(matter.amount(sand), 1'000'000 * int64_t{kFullVoxel}) << ticks;
  }
  EXPECT_TRUE(matter.settled());
  EXPECT_EQ(matter.amount(sand), 1'000'000 * int64_t{kFullVoxel});
  EXPECT_EQ(world.store.bounds().min.y, 0);
  EXPECT_LT(world.store.bounds().max.y, 100) << "it lies on the ground";
}

TEST(MatterBooks, AWaterfallFillsASealedCaveToItsRoof) {
  // A cave of 12 x 8 x 12 m in rock, closed but for a shaft from a pond that holds more than the cave.
  World world(world::standard_blocks());
  const BlockId water = named(world, "water");
  fill(world, {{0, 0, 0}, {31, 40, 31}}, named(world, "granite"));
  fill(world, {{8, 2, 8}, {19, 9, 19}}, world::kAir);
  fill(world, {{13, 10, 13}, {13, 24, 13}}, world::kAir);
  fill(world, {{6, 25, 6}, {25, 40, 25}}, world::kAir);
  fill(world, {{6, 25, 6}, {25, 28, 25}}, water);
  const int64_t all = int64_t{20} * 20 * 4 * kFullVoxel;
  Matter matter(world, {});
  int ticks = 0;
  while (!matter.settled() && ticks < 20000) matter.step(), ++ticks;
  EXPECT_TRUE(matter.settled());
  EXPECT_EQ(matter.amount(water), all);
  int64_t inside = 0;
  for (int x = 8; x < 20; ++x)
    for (int y = 2; y < 10; ++y)
      for (int z = 8; z < 20; ++z) inside += matter.amount_at({x, y, z});
  EXPECT_GE(inside, int64_t{12} * 8 * 12 * kFullVoxel) << "no pocket stays dry";
  for (const LedgerRow& row : matter.ledger()) EXPECT_TRUE(row.exact()) << row.substance;
}

// CM15, CM16: where lava meets the sea every unit of heat is in a voxel, or in the books.
TEST(MatterBooks, HeatOfLavaInTheSeaIsExact) {
  const auto scene = world::load_scene("lava_meets_sea");
  ASSERT_TRUE(scene.ok());
  world::ImportReport report;
  auto world = world::build_world(*scene, report);
  ASSERT_TRUE(world.ok());
  const auto options = matter_options(*world, world::Accuracy::usual);
  ASSERT_TRUE(options.ok());
  Matter matter(*world, *options);
  bool any_heat = false;
  for (int i = 0; i < 200; ++i) {
    matter.step();
    if (i % 50 != 49) continue;
    for (const LedgerRow& row : matter.ledger()) {
      EXPECT_TRUE(row.exact()) << row.substance << " after " << i << ": " << row.start << " + " << row.in << " - "
                               << row.out << " is not " << row.now;
      any_heat |= row.is_heat && row.in > 0 && row.out > 0;
    }
  }
  EXPECT_TRUE(any_heat);
}

}  // namespace
}  // namespace sim
