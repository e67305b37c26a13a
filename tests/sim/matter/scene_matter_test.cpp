/// What a scene says of its matter: temperature at rest, and reactions of its own.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <utility>

#include "tests/sim/matter/heat_support.h"
#include "world/saves/save_file.h"
#include "world/scenes/scene.h"
#include "world/scenes/scene_reactions.h"

namespace sim {
namespace {

using world::World;

class SceneMatter : public testing::Test {
 protected:
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / ("loam-scene-matter-" + std::to_string(::getpid()) + ".toml");
  ~SceneMatter() override { std::filesystem::remove(path_); }
  world::Result<World> build(const std::string& text) {
    std::ofstream(path_) << text;
    TRY(const world::Scene scene, world::load_scene(path_.string()));
    world::ImportReport report;
    TRY(World world, world::build_world(scene, report));
    TRY_STATUS(world::add_scene_reactions(path_.string(), world));
    return world;
  }
  std::string error_of(const std::string& text) {
    const auto world = build(text);
    if (!world.ok()) return world.error().message;
    const auto options = matter_options(*world, world::Accuracy::usual);
    return options.ok() ? "" : options.error().message;
  }
};

const std::string kScene = R"(what = "two blocks that react"
temperature_k = 260
[[fill]]
min = [0, 0, 0]
max = [7, 0, 7]
block = "bedrock"
[[fill]]
min = [3, 1, 3]
max = [3, 1, 3]
block = "stone"
[[fill]]
min = [4, 1, 3]
max = [4, 1, 3]
block = "dirt"
[world]
generator = "empty"
size = [32, 32, 32]
)";

TEST_F(SceneMatter, ReactionsOfASceneHappenAndAreSaved) {
  const std::string text = kScene + R"([[reaction]]
what = "stone meets dirt"
row = "stone + dirt -> granite + granite"
unbalanced = "a test"
)";
  auto world = build(text);
  ASSERT_TRUE(world.ok()) << world.error().message;
  const auto options = matter_options(*world, world::Accuracy::usual);
  ASSERT_TRUE(options.ok()) << options.error().message;
  ASSERT_EQ(options->reactions.size(), 1u);
  EXPECT_EQ(options->rest_k, 260);
  // As in the file.
  const size_t line = static_cast<size_t>(std::count(kScene.begin(), kScene.end(), '\n')) + 3;
  EXPECT_EQ(options->reactions[0].origin, path_.string() + ":" + std::to_string(line) + ":7");
  const std::filesystem::path saved = path_.string() + ".loam";
  ASSERT_TRUE(world::write_world(*world, saved).ok());
  for (int from_save = 0; from_save < 2; ++from_save) {
    if (from_save) {
      world::ImportReport report;
      const auto scene = world::load_scene(saved.string());
      ASSERT_TRUE(scene.ok());
      world = world::build_world(*scene, report);
      ASSERT_TRUE(world.ok());
    }
    const auto again = matter_options(*world, world::Accuracy::usual);
    ASSERT_TRUE(again.ok()) << again.error().message;
    Matter matter(*world, *again);
    for (int i = 0; i < 4; ++i) matter.step();
    EXPECT_EQ(matter.amount(block_named(*world, "granite")), 2 * kFullVoxel) << from_save;
    for (const EffectReport& effect : matter.effects())
      if (effect.name == "reactions") {
        EXPECT_TRUE(effect.called_for);
      }
  }
  std::filesystem::remove(saved);
}

TEST_F(SceneMatter, AReactionThatIsWrongIsSaidWithItsPlaceInTheScene) {
  const auto place = [&](int line) { return path_.string() + ":" + std::to_string(line); };
  const int lines = static_cast<int>(std::count(kScene.begin(), kScene.end(), '\n'));
  EXPECT_EQ(error_of(kScene + "[[reaction]]\nwhat = \"x\"\nrow = \"stone -> dirt\"\nrat = [1, 2]\n")
                .find(place(lines + 4) + ":1: unknown key 'rat'"),
            0u);
  EXPECT_EQ(error_of(kScene + "[[reaction]]\nwhat = \"x\"\nrow = \"stone -> dirtt\"\n").find(place(lines + 3)), 0u);
  EXPECT_NE(error_of(kScene + "[[reaction]]\nwhat = \"x\"\nrow = \"stone -> dirt\"\n").find("kg become"),
            std::string::npos);
  EXPECT_NE(error_of(kScene + "[[reaction]]\nwhat = \"lava meets water\"\nrow = \"lava + water -> obsidian + steam\"\n")
                .find("already"),
            std::string::npos);
  // Other tables after it aren't its own.
  EXPECT_EQ(error_of(kScene + "[[reaction]]\nwhat = \"x\"\nrow = \"stone -> stone\"\n[simulation]\nseed = 4\n"), "");
  EXPECT_NE(error_of(kScene + "reaction = 3\n").find("reaction"), std::string::npos);
}

TEST_F(SceneMatter, AKnobOutOfItsRangeIsRefusedWithWhatIsAllowed) {
  EXPECT_EQ(error_of(kScene + "[simulation.knobs]\nheat_speed = \"1e30\"\n"),
            "[simulation.knobs]: knob heat_speed: 1e30 is outside [0, 1e+11]");
  std::string hot = kScene;
  hot.replace(hot.find("260"), 3, "1e9");
  EXPECT_NE(error_of(hot).find("must be in (0, 6000]"), std::string::npos);
}

TEST_F(SceneMatter, WhatIsBornAsWarmAsTheWorldIsStaysAsItIs) {
  const auto heat_after = [](double rest_k) {
    World world(world::standard_blocks());
    fill(world, {{0, 0, 0}, {15, 7, 15}}, block_named(world, "granite"));
    fill(world, {{5, 8, 5}, {5, 8, 5}}, block_named(world, "bedrock"));
    fill(world, {{4, 4, 4}, {6, 6, 6}}, block_named(world, "lava"));
    world.environment.temperature = world::Kelvin{rest_k};
    MatterOptions options;
    options.knobs.heat_speed = 100, options.knobs.heat_interval = 1;
    Matter matter(world, options);
    for (int i = 0; i < 10; ++i) matter.step();
    int64_t moved = 0;
    for (const LedgerRow& row : matter.ledger())
      if (row.is_heat) moved = row.in + row.out + std::abs(row.now);
    matter.flush();
    const world::IntLayer* heat = world.store.find_int_layer(world::Layer::heat);
    return std::pair{heat ? heat->active_voxels() : 0, moved};
  };
  EXPECT_GT(heat_after(288.15).first, 50u) << "lava warms the rock";
  EXPECT_EQ(heat_after(standard_reactions().born_k.at("lava")).first, 0u) << "all is as warm as lava";
}

/// What a scene of the program comes to after so many ticks.
std::pair<World, std::map<std::string, LedgerRow>> scene_after(const char* name, int ticks) {
  world::ImportReport report;
  World world = std::move(build_world(world::load_scene(name).value(), report).value());
  Matter matter(world, matter_options(world, world::Accuracy::usual).value());
  EXPECT_TRUE(matter.begin().ok());
  for (int i = 0; i < ticks; ++i) matter.step();
  std::map<std::string, LedgerRow> books;
  for (const LedgerRow& row : matter.ledger()) {
    EXPECT_TRUE(row.exact()) << row.substance;
    books[row.substance] = row;
  }
  return {std::move(world), std::move(books)};
}

TEST(ScenesSay, IceMeltsOnTheHotRodAndStaysOnTheOneOfGranite) {
  const auto [world, books] = scene_after("hot_rod", 1000);
  EXPECT_EQ(books.at("ice").start, 12 * kFullVoxel);
  EXPECT_EQ(books.at("ice").now, 6 * kFullVoxel);
  for (int x = -16; x <= -14; ++x) {
    EXPECT_NE(world.store.get({x, 1, -5}), block_named(world, "ice"));
    EXPECT_EQ(world.store.get({x, 1, 3}), block_named(world, "ice"));
  }
}

TEST(ScenesSay, WhatRunsStaysOnItsLand) {
  for (const auto& [name, ticks] :
       {std::pair("lava_meets_sea", 200), std::pair("avalanche", 320), std::pair("hot_rod", 1000)}) {
    world::ImportReport report;
    const world::VoxelBox land = build_world(world::load_scene(name).value(), report).value().store.bounds();
    const auto [world, books] = scene_after(name, ticks);
    const world::VoxelBox now = world.store.bounds();
    for (int axis = 0; axis < 3; axis += 2) {
      EXPECT_GE(now.min[axis], land.min[axis]) << name;
      EXPECT_LE(now.max[axis], land.max[axis]) << name;
    }
    EXPECT_GE(now.min.y, land.min.y) << name << ": nothing falls below it";
  }
}

}  // namespace
}  // namespace sim
