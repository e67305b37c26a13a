/// Worlds as generators make them are at rest: nothing moves in them until somebody comes.
#include <gtest/gtest.h>

#include "sim/matter/matter.h"
#include "world/scenes/scene.h"

namespace sim {
namespace {

struct NewWorld {
  const char* generator;
  uint64_t seed;
  world::VoxelPos size;
  std::map<std::string, double> parameters = {};
};

void expect_rest(const NewWorld& choice) {
  SCOPED_TRACE(std::string(choice.generator) + ", seed " + std::to_string(choice.seed));
  world::Scene scene;
  scene.name = scene.generator = choice.generator;
  scene.seed = scene.simulation.seed = choice.seed;
  scene.parameters = choice.parameters;
  scene.box.min = {-choice.size.x / 2, 0, -choice.size.z / 2};
  scene.box.max = scene.box.min + choice.size - world::VoxelPos{1, 1, 1};
  world::ImportReport report;
  auto made = world::build_world(scene, report);
  ASSERT_TRUE(made.ok()) << made.error().message;
  auto options = matter_options(*made, world::Accuracy::usual);
  ASSERT_TRUE(options.ok());
  Matter matter(*made, *options);
  ASSERT_TRUE(matter.begin().ok());
  constexpr int kTicks = 8;  // a liquid looks four times before it sleeps
  for (int tick = 0; tick < kTicks; ++tick) ASSERT_EQ(matter.step().voxels_changed, 0u) << "in tick " << tick;
  EXPECT_EQ(matter.awake_leaves(), 0u);
  EXPECT_TRUE(matter.settled());
}

TEST(NewWorld, OfAValleyIsAtRestFromItsFirstTick) {
  for (const uint64_t seed : {1, 2, 3, 77}) expect_rest({"valley", seed, {384, 256, 384}});
}

TEST(NewWorld, IsAtRestAlsoWhereItIsCutInTheMiddleOfRegions) {
  expect_rest({"valley", 9, {250, 190, 301}});
  expect_rest({"valley", 5, {16, 90, 1024}});
}

TEST(NewWorld, OfLevelGroundUnderWaterIsAtRest) {
  expect_rest({"flat", 1, {100, 40, 70}, {{"ground_m", 10}, {"water_depth_m", 5}}});
}

}  // namespace
}  // namespace sim
