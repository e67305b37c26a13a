#include "sim/light/flood.h"

#include "tests/sim/light/light_support.h"
#include "world/base/jobs.h"
#include "world/base/simd.h"

namespace sim {
namespace {

using world::EditBatch;
using world::LightModel;
using world::Store;

/// Rooms, pillars, single voxels and holes of random blocks within a box.
EditBatch random_edits(uint64_t seed, int count, const VoxelBox& box, size_t kinds) {
  EditBatch batch;
  for (int i = 0; i < count; ++i) {
    const auto pick = [&](int what, int n) { return static_cast<int>(bits(seed, i, what) % static_cast<uint64_t>(n)); };
    VoxelBox part;
    for (int a = 0; a < 3; ++a) part.min[a] = box.min[a] + pick(a, box.max[a] - box.min[a] + 1);
    part.max = part.min;
    const int shape = pick(3, 10);
    if (shape >= 7)
      for (int a = 0; a < 3; ++a)
        part.max[a] = std::min(box.max[a], part.min[a] + pick(4 + a, shape == 9 ? 14 : shape == 8 ? 5 : 2));
    const BlockId block = pick(7, 5) < 2 ? world::kAir : static_cast<BlockId>(pick(8, static_cast<int>(kinds)));
    batch.fill(part, block);
  }
  return batch;
}

TEST(FloodLight, EqualsTheQueueOnRandomWorldsOfEveryKindOfBlock) {
  const LightBlocks blocks = every_kind_of_block();
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    Store store(blocks.palette);
    // Across the corner of eight regions, and of many leaves.
    const VoxelBox box{{-20, -20, -20}, {19, 12, 19}};
    ASSERT_TRUE(store.apply(random_edits(seed, static_cast<int>(seed * seed) * 4, box, blocks.palette.size())).ok());
    FloodLight light(store, LightModel::flood4, blocks.rules);
    light.compute();
    expect_equal_to_queue(store, light, "seed " + std::to_string(seed));
  }
}

// The rival of the benchmark is no straw man only if its edits work too.
TEST(LightQueue, AfterAnyEditEqualsAllAnew) {
  const LightBlocks blocks = every_kind_of_block();
  const VoxelBox box{{0, 0, 0}, {24, 20, 22}};
  tools::LightQueue edited(box, 15, blocks.rules.all_bands), anew(box, 15, blocks.rules.all_bands);
  edited.light_all();
  int most = 0;
  for (int64_t i = 0; i < 300; ++i) {
    VoxelPos v;
    for (int a = 0; a < 3; ++a) v[a] = static_cast<int>(bits(3, i, a) % static_cast<uint64_t>(box.max[a] + 1));
    const auto kind = static_cast<uint8_t>(bits(3, i, 3) % 4 ? bits(3, i, 4) % blocks.palette.size() : 0);
    edited.set(v, kind);
    anew.put(v, kind);
    if (i % 10) continue;
    anew.light_all();
    for (int x = 0; x <= box.max.x; ++x)
      for (int y = 0; y <= box.max.y; ++y)
        for (int z = 0; z <= box.max.z; ++z) {
          most = std::max(most, edited.lamps({x, y, z}));
          ASSERT_EQ(edited.sky({x, y, z}), anew.sky({x, y, z})) << i << ": " << x << ' ' << y << ' ' << z;
          ASSERT_EQ(edited.lamps({x, y, z}), anew.lamps({x, y, z})) << i << ": " << x << ' ' << y << ' ' << z;
        }
  }
  EXPECT_EQ(most, 15);
}

TEST(FloodLight, IsTheSameOnEachInstructionSet) {
  const LightBlocks blocks = every_kind_of_block();
  Store store(blocks.palette);
  ASSERT_TRUE(store.apply(random_edits(5, 300, {{0, 0, 0}, {60, 60, 60}}, blocks.palette.size())).ok());
  FloodLight best(store, LightModel::flood4, blocks.rules);
  best.compute();
  for (const world::SimdLevel& level : world::simd_levels()) {
    const world::SimdChoice choice(level);
    FloodLight light(store, LightModel::flood4, blocks.rules);
    light.compute();
    EXPECT_EQ(light.volume().content_hash(), best.volume().content_hash()) << level.name;
  }
}

/// A world, edited again and again; after each batch its light must be what all anew gives.
void edit_and_compare(uint64_t seed, LightModel model, int batches, int most_edits, const VoxelBox& box,
                      int check_queue, uint64_t& edits, LightReport& total) {
  const LightBlocks blocks = every_kind_of_block();
  Store store(blocks.palette);
  ASSERT_TRUE(store.apply(random_edits(seed, 60, box, blocks.palette.size())).ok());
  FloodLight light(store, model, blocks.rules);
  light.update();
  for (int b = 0; b < batches; ++b) {
    const int count = 1 + static_cast<int>(bits(seed, b, 99) % static_cast<uint64_t>(most_edits));
    ASSERT_TRUE(
        store.apply(random_edits(seed * 1000 + static_cast<uint64_t>(b), count, box, blocks.palette.size())).ok());
    edits += static_cast<uint64_t>(count);
    const LightReport report = light.update();
    total.windows += report.windows;
    total.queues += report.queues, total.queue_voxels += report.queue_voxels, total.queues_left += report.queues_left;
    FloodLight anew(store, model, blocks.rules);
    anew.compute();
    ASSERT_EQ(light.volume().content_hash(), anew.volume().content_hash()) << "seed " << seed << ", batch " << b;
    if (check_queue && b % check_queue == check_queue - 1)
      expect_equal_to_queue(store, light, "seed " + std::to_string(seed) + ", batch " + std::to_string(b));
    if (testing::Test::HasFailure()) return;
  }
}

// Hard cases CL1, CL6 and CL13: 10^5 edits in all.
TEST(FloodLight, AfterAnyEditsEqualsAllAnew) {
  uint64_t edits = 0;
  for (const int threads : {1, 2, 8}) {
    const world::ThreadLimit limit(threads);
    LightReport total;
    for (uint64_t seed = 1; seed <= 6 && !HasFailure(); ++seed) {
      edit_and_compare(100 * static_cast<uint64_t>(threads) + seed, LightModel::flood4, 40, 4,
                       {{-6, -6, -6}, {5, 9, 5}}, 20, edits, total);
      edit_and_compare(200 * static_cast<uint64_t>(threads) + seed, LightModel::flood4, 30, 60,
                       {{-30, -20, -40}, {40, 30, 20}}, 30, edits, total);
    }
    // In one batch so many that they take several windows.
    edit_and_compare(300 + static_cast<uint64_t>(threads), LightModel::flood4, 6, 9000,
                     {{-70, -40, -150}, {200, 90, 30}}, 0, edits, total);
    // One voxel at a time, in a crowd and in the open: most reach few voxels.
    edit_and_compare(400 + static_cast<uint64_t>(threads), LightModel::flood4, 300, 1, {{-9, -9, -9}, {8, 12, 8}}, 100,
                     edits, total);
    edit_and_compare(500 + static_cast<uint64_t>(threads), LightModel::flood_rgb, 100, 1, {{-9, -9, -9}, {8, 12, 8}}, 0,
                     edits, total);
    // Each way of following a change was taken, and the change from the one to the other.
    EXPECT_GE(total.queues, 300u);
    EXPECT_GE(total.queue_voxels, 2 * total.queues);
    EXPECT_GE(total.windows, 300u);
    EXPECT_GE(total.queues_left, 100u);
  }
  EXPECT_GE(edits, 100'000u);
}

}  // namespace
}  // namespace sim
