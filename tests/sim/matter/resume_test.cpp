/// A world that is saved at some tick, loaded, and simulated on is the same as one that was never saved: every scene.
#include <gtest/gtest.h>

#include "tests/sim/matter/matter_support.h"
#include "tests/support.h"
#include "world/formats/format.h"
#include "world/scenes/scene.h"

namespace sim {
namespace {

using world::World;

MatterOptions options_of(const World& world, uint64_t tick) {
  MatterOptions options;
  options.seed = world.simulation.seed, options.tick = tick, options.effects = world.simulation.effects;
  for (const auto& [name, value] : world.simulation.knobs) CHECK(sim_knobs().set(options.knobs, name, value).ok());
  return options;
}
uint64_t hash_after(World& world, uint64_t from, int ticks, bool save) {
  Matter matter(world, options_of(world, from));
  const world::Status begun = matter.begin();
  EXPECT_TRUE(begun.ok()) << begun.error().message;
  for (int i = 0; i < ticks; ++i) matter.step();
  if (save) matter.save_state();
  return matter.state_hash();
}
World reloaded(const World& world) {
  const world::TemporaryFolder folder;
  CHECK(write_world(world, folder / "a.loam").ok());
  world::ImportReport report;
  return std::move(read_world(folder / "a.loam", {}, report).value());
}
World scene_world(const std::string& name) {
  world::ImportReport report;
  return std::move(build_world(world::load_scene(name).value(), report).value());
}

class Resume : public testing::TestWithParam<std::pair<const char*, int>> {};

TEST_P(Resume, GoesOnAsIfNeverSaved) {
  const auto [name, ticks] = GetParam();
  World straight = scene_world(name), first = scene_world(name);
  const uint64_t expected = hash_after(straight, 0, 2 * ticks, false);
  const uint64_t saved = hash_after(first, 0, ticks, true);
  World second = reloaded(first);
  EXPECT_EQ(hash_after(second, static_cast<uint64_t>(ticks), 0, false), saved) << "what was saved is what is loaded";
  EXPECT_EQ(hash_after(second, static_cast<uint64_t>(ticks), ticks, false), expected);
}

// Half of the ticks that each is run for.
INSTANTIATE_TEST_SUITE_P(Scenes, Resume,
                         testing::Values(std::pair{"dam", 60}, std::pair{"u_tube", 100}, std::pair{"hourglass", 150},
                                         std::pair{"avalanche", 30}, std::pair{"hot_rod", 60},
                                         std::pair{"burning_house", 900}, std::pair{"lava_meets_sea", 80},
                                         std::pair{"collapse", 1100}, std::pair{"rainstorm", 60},
                                         std::pair{"shapes", 3}, std::pair{"cave", 3}),
                         [](const auto& scene) { return scene.param.first; });

// The fire is out, and no block calls for heat any more; what it warmed cools on.
TEST(ResumeRules, WhatRanGoesOnAlthoughNothingCallsForItAnyMore) {
  constexpr int kBurntOut = 6000, kMore = 200;
  World straight = scene_world("burning_house"), first = scene_world("burning_house");
  const uint64_t expected = hash_after(straight, 0, kBurntOut + kMore, false);
  const uint64_t saved = hash_after(first, 0, kBurntOut, true);
  EXPECT_NE(saved, expected) << "something goes on";
  World second = reloaded(first);
  for (const auto& [id, count] : second.store.census()) EXPECT_NE((*second.palette)[id].name, "fire");
  for (const EffectReport& rule : called_rules(second))
    if (rule.name == "heat") {
      EXPECT_EQ(rule.why, "it ran when the world was saved");
    }
  EXPECT_EQ(hash_after(second, kBurntOut, kMore, false), expected);

  second.simulation.state["rules"] = "heat entropy";
  Matter matter(second, options_of(second, kBurntOut));
  const world::Status begun = matter.begin();
  ASSERT_FALSE(begun.ok());
  EXPECT_NE(begun.error().message.find("\"entropy\""), std::string::npos) << begun.error().message;
}

// Liquids with inertia: their velocities are saved too.
TEST(ResumeWaves, WavesGoOn) {
  const auto make = [](const char* scene) {
    World world = scene_world(scene);
    world.simulation.knobs["liquid_model"] = "waves";
    return world;
  };
  for (const auto& [scene, ticks] : {std::pair("dam", 25), std::pair("u_tube", 150)}) {
    World straight = make(scene), first = make(scene);
    const uint64_t expected = hash_after(straight, 0, 2 * ticks, false);
    const uint64_t saved = hash_after(first, 0, ticks, true);
    World second = reloaded(first);
    const auto then = static_cast<uint64_t>(ticks);
    EXPECT_EQ(hash_after(second, then, 0, false), saved) << scene << ": what was saved is what is loaded";
    EXPECT_EQ(hash_after(second, then, ticks, false), expected) << scene;
    World finite = scene_world(scene);
    EXPECT_NE(hash_after(finite, 0, 2 * ticks, false), expected) << scene << ": another model";
  }
  for (const char* text : {"1 2 3 0 5\n", "liquid watre\n", "liquid water\n1 2 3 0\n", "liquid water\n1 2 3 2 5\n",
                           "liquid water\n1 2 3 0 0\n", "liquid water\n1 2 3 0 5 6\n", "liquid water\nx\n",
                           "liquid water\nparts 65\n", "liquid water\nparts \n"}) {
    World damaged = make("dam");
    damaged.simulation.state["liquid"] = text;
    Matter matter(damaged, options_of(damaged, 1));
    EXPECT_FALSE(matter.begin().ok()) << text;
  }
}

// Saves of earlier versions don't say in how many parts the last tick was done: as many as the waves ask for, then.
TEST(ResumeWaves, VelocitiesWithoutTheNumberOfPartsGoOnToo) {
  World first = scene_world("dam");
  first.simulation.knobs["liquid_model"] = "waves";
  hash_after(first, 0, 25, true);
  World second = reloaded(first), third = reloaded(first);
  std::string& text = second.simulation.state["liquid"];
  const size_t at = text.find("parts ");
  ASSERT_NE(at, std::string::npos);
  ASSERT_GT(text.size() - at, 100u) << "there are waves";
  text.erase(at, text.find('\n', at) + 1 - at);
  const auto run = [](World& world) {
    Matter matter(world, options_of(world, 25));
    const world::Status begun = matter.begin();
    EXPECT_TRUE(begun.ok()) << begun.error().message;
    std::vector<int64_t> columns;
    for (int i = 0; i < 10; ++i) matter.step();
    for (const LedgerRow& row : matter.ledger()) EXPECT_TRUE(row.exact()) << row.substance;
    const world::VoxelBox box = world.store.bounds();
    for (int x = box.min.x; x <= box.max.x; ++x) {
      columns.push_back(0);
      for (int y = box.min.y; y <= box.max.y; ++y) columns.back() += matter.amount_at({x, y, 0});
    }
    return columns;
  };
  // Another number of parts moves the same waves: depths differ by less than a tenth of a voxel.
  const std::vector<int64_t> without = run(second), with = run(third);
  for (size_t n = 0; n < with.size(); ++n) EXPECT_NEAR(without[n], with[n], kFullVoxel / 10) << n;
}

TEST(ResumeSupport, PiecesInTheAirGoOnFalling) {
  const auto make = [] {
    World world(world::standard_blocks());
    fill(world, {{-16, -1, -16}, {24, -1, 24}}, block_named(world, "granite"));
    fill(world, {{0, 40, 0}, {9, 45, 9}}, block_named(world, "brick_red"));
    fill(world, {{4, 20, 4}, {5, 20, 5}}, block_named(world, "oak_planks"));
    world.simulation.effects = {"support"};
    return world;
  };
  const auto run = [](World& world, int save_at) {
    auto matter = std::make_unique<Matter>(world, options_of(world, 0));
    CHECK(matter->begin().ok());
    for (int tick = 0; tick < 3; ++tick) matter->step();
    matter->flush();
    fill(world, {{0, 45, 0}, {0, 45, 0}}, world::kAir);
    for (int tick = 3; tick < 70; ++tick) {
      if (tick == save_at) {
        matter->save_state();
        matter.reset();
        world = reloaded(world);
        matter = std::make_unique<Matter>(world, options_of(world, static_cast<uint64_t>(tick)));
        CHECK(matter->begin().ok());
      }
      matter->step();
    }
    return matter->state_hash();
  };
  World straight = make();
  const uint64_t expected = run(straight, -1);
  for (const int at : {5, 20, 37, 50, 69}) {
    World world = make();
    EXPECT_EQ(run(world, at), expected) << at;
  }
}

}  // namespace
}  // namespace sim
