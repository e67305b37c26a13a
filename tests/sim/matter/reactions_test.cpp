#include "sim/matter/reactions.h"

#include <gtest/gtest.h>

#include <set>

#include "sim/matter/reaction_rows.h"
#include "tests/sim/matter/heat_support.h"
#include "world/base/jobs.h"

namespace sim {
namespace {

using world::BlockId;
using world::VoxelPos;
using world::World;

std::string error_of(const std::string& text) {
  const auto read = read_reactions(text, "test.toml");
  return read.ok() ? "" : read.error().message;
}

/// A closed box with its middle filled by a function of the place.
World boxed(int side, const std::function<const char*(VoxelPos)>& block) {
  World world(world::standard_blocks());
  fill(world, {{-1, -1, -1}, {side, side, side}}, block_named(world, "bedrock"));
  world::EditBatch batch;
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y)
      for (int z = 0; z < side; ++z) batch.set({x, y, z}, block_named(world, block({x, y, z})));
  CHECK(world.store.apply(batch).ok());
  return world;
}

uint64_t count(World& world, RuleAlone& rule, const char* block) {
  rule.cells().flush();
  const world::Census census = world.store.census();
  const auto found = census.find(block_named(world, block));
  return found == census.end() ? 0 : found->second;
}

// ---- the table ---------------------------------------------------------------------------------------------------

TEST(ReactionRows, AllAreOfKnownBlocksBalancedAndInRange) {
  const ReactionTable& table = standard_reactions();
  EXPECT_GE(table.rows.size(), 40u);
  for (const Reaction& row : table.rows) {
    const world::Status status = check_reaction(row, world::standard_blocks());
    EXPECT_TRUE(status.ok()) << (status.ok() ? "" : status.error().message);
    EXPECT_LE(row.chance, row.of) << row.what;
  }
  for (const auto& [name, kelvin] : table.born_k) EXPECT_TRUE(world::standard_blocks().find(name)) << name;
  for (const std::string& name : table.called_by) EXPECT_TRUE(world::standard_blocks().find(name)) << name;
  for (const auto& [name, fuel] : table.fuels) {
    const auto id = world::standard_blocks().find(name);
    ASSERT_TRUE(id) << name;
    EXPECT_TRUE(world::standard_blocks()[*id].ignition) << name << " burns, but never ignites";
    EXPECT_TRUE(world::standard_blocks().find(fuel.leaves)) << fuel.leaves;
  }
}

TEST(ReactionRows, GoingThereAndBackFreesNoEnergy) {
  // a -> c and c -> a of one voxel: what the one frees by mass, the other binds at the same temperature.
  const std::vector<Reaction>& rows = standard_reactions().rows;
  size_t pairs = 0;
  for (const Reaction& r : rows)
    for (const Reaction& s : rows) {
      if (!r.b.empty() || !s.b.empty() || r.a != s.c || r.c != s.a || r.heat_mj <= 0) continue;
      const auto mass = [&](const std::string& name) {
        return world::standard_blocks()[world::standard_blocks().find(name).value()].density.value;
      };
      ++pairs;
      EXPECT_EQ(r.at_k, s.at_k) << r.what << ", " << s.what;
      EXPECT_NEAR(r.heat_mj / mass(r.a), -s.heat_mj / mass(s.a), 1e-3 * r.heat_mj / mass(r.a))
          << r.what << ", " << s.what;
    }
  EXPECT_GE(pairs, 2u);
}

TEST(ReactionRows, WhatIsWrongIsSaidWithItsPlace) {
  EXPECT_EQ(error_of("[[reaction]]\nwhat = \"x\"\nrow = \"ice -> water\"\nrat = [1, 2]\n").substr(0, 13),
            "test.toml:4:1");
  EXPECT_NE(error_of("[[reaction]]\nwhat = \"x\"\nrow = \"ice -> water\"\nrat = [1, 2]\n").find("rate"),
            std::string::npos);
  EXPECT_NE(error_of("[[reaction]]\nwhat = \"x\"\nrow = \"ice + -> water\"\n").find("must be \"a -> c\""),
            std::string::npos);
  EXPECT_NE(error_of("[[reaction]]\nwhat = \"x\"\nrow = \"ice + sand -> water\"\n").find("must be \"a -> c\""),
            std::string::npos);
  EXPECT_NE(error_of("[[reaction]]\nwhat = \"x\"\nrow = \"ice -> water\"\nrate = [3, 2]\n").find("at most 1"),
            std::string::npos);
  EXPECT_NE(error_of("[[reaction]]\nwhat = \"x\"\nrow = \"ice -> water\"\nfrom_k = 7000\n").find("test.toml:4"),
            std::string::npos);
  EXPECT_NE(error_of("[[reaction]]\nrow = \"ice -> water\"\n").find("what"), std::string::npos);
  EXPECT_NE(error_of("[[reaction]]\nwhat = \"x\"\nrow = \"a -> b\"\n[[reaction]]\nwhat = \"x\"\nrow = \"a -> b\"\n")
                .find("already"),
            std::string::npos);
  EXPECT_EQ(error_of("[[reaction]]\nwhat = \"x\"\nrow = \"ice -> water\"\nwhere = \"above\"\n").substr(0, 11),
            "test.toml:4");
}

TEST(ReactionRows, ExtremeRatesTemperaturesAndHeatsAreRefusedWithWhatIsAllowed) {
  const auto refused = [](const char* key) {
    return error_of(std::string("[[reaction]]\nwhat = \"x\"\nrow = \"ice -> water\"\n") + key + "\n");
  };
  const auto expect = [&](const char* key, const char* range) {
    const std::string message = refused(key);
    EXPECT_EQ(message.find("test.toml:4:"), 0u) << key << ": " << message;
    EXPECT_NE(message.find(range), std::string::npos) << key << ": " << message;
  };
  for (const char* rate : {"rate = [0, 5]", "rate = [-1, 5]", "rate = [1, 1048577]", "rate = [1, 9223372036854775807]"})
    expect(rate, "in [1, 1048576]");
  for (const char* kelvin :
       {"from_k = 0", "from_k = -1", "from_k = 6000.1", "from_k = inf", "to_k = nan", "to_k = 1e300"})
    expect(kelvin, "in (0, 6000]");
  for (const char* heat : {"heat_mj = 5001", "heat_mj = -1e18", "heat_mj = -inf", "heat_mj = nan"})
    expect(heat, "in [-5000, 5000]");
  for (const char* amounts : {"amounts = [-1, 0]", "amounts = [65536, 4096]"}) expect(amounts, "in [0, 65535]");
  EXPECT_NE(error_of("born_k.ice = 1e9\n").find("in (0, 6000]"), std::string::npos);
  EXPECT_NE(
      error_of("[[fuel]]\nblocks = [\"oak_log\"]\nmj_per_kg = 201\nhours = 1\nleaves = \"ash\"\n").find("(0, 200]"),
      std::string::npos);
  EXPECT_EQ(refused("from_k = 6000"), "");
}

TEST(ReactionRows, UnbalancedRowsMustSayWhyAndBalancedOnesMustNot) {
  const auto checked = [](const char* text) {
    auto read = read_reactions(text, "test.toml");
    CHECK(read.ok());
    const world::Status status = check_reaction(read->rows.at(0), world::standard_blocks());
    return status.ok() ? std::string() : status.error().message;
  };
  EXPECT_NE(checked("[[reaction]]\nwhat = \"x\"\nrow = \"ice -> water\"\n").find("917 kg become 998 kg"),
            std::string::npos);
  EXPECT_EQ(checked("[[reaction]]\nwhat = \"x\"\nrow = \"ice -> water\"\namounts = [3764, 4096]\n"), "");
  EXPECT_NE(checked("[[reaction]]\nwhat = \"x\"\nrow = \"ice -> ice\"\nunbalanced = \"so\"\n").find("is balanced"),
            std::string::npos);
  EXPECT_NE(checked("[[reaction]]\nwhat = \"x\"\nrow = \"ice -> watr\"\n").find("nearest is 'water'"),
            std::string::npos);
}

// ---- the rule ----------------------------------------------------------------------------------------------------

TEST(Reactions, OfTooLittleFluidEnergyIsRightOnAverage) {
  // A third of a voxel of lava on water: by chance a whole voxel of rock with the heat of all of its mass, or none,
  // whose heat goes with it. Over many chances neither is lost.
  ReactionRows rows(world::standard_blocks(), {});
  const BlockId lava = world::standard_blocks().find("lava").value(),
                water = world::standard_blocks().find("water").value();
  for (const ReactionRow& row : rows.rows()) {
    if (row.a != lava || row.b != water || world::standard_blocks()[row.c].phase != world::Phase::solid) continue;
    const Cell a{.block = lava, .amount = kFullVoxel / 3, .heat = -100000000 / 3},
        b{.block = water, .amount = kFullVoxel, .heat = 0};
    double lost = 0, all = 0;
    int solid = 0;
    constexpr int kTimes = 20000;
    for (int i = 0; i < kTimes; ++i) {
      Cell c, d;
      lost += static_cast<double>(rows.react(row, a, b, world::random_bits(5, i, 0, 0), c, d));
      all += std::abs(static_cast<double>(rows.thermal().heat_at(lava, a.amount, row.at_k)) - a.heat);
      solid += c.block == row.c;
    }
    EXPECT_GT(solid, kTimes / 5);
    EXPECT_LT(solid, kTimes / 2);
    // Three standard errors of a chance of a third: 3 sqrt(2 / kTimes) = 3 %.
    EXPECT_LT(std::abs(lost), 0.03 * all);
    return;
  }
  FAIL() << "no row of lava and water that makes a solid";
}

TEST(Reactions, IceMeltsOnlyOnceItHoldsTheHeatOfMelting) {
  World world = boxed(8, [](VoxelPos) { return "ice"; });
  RuleAlone rule(world, "reactions");
  ThermalTraits thermal(*world.palette, {});
  const BlockId ice = block_named(world, "ice"), water = block_named(world, "water");
  const int64_t needed = thermal.heat_at(ice, kFullVoxel, 273.15) + std::llround(306.278e6 / kHeatUnitJ);
  rule.set_heat({1, 1, 1}, static_cast<int32_t>(needed - 1));
  rule.set_heat({5, 5, 5}, static_cast<int32_t>(needed + 1000));
  rule.step();
  EXPECT_EQ(rule.cells().block(rule.cells().find({0, 0, 0}), world::index_in_leaf({1, 1, 1})), ice);
  const Cell melted = rule.cells().cell(rule.cells().find({0, 0, 0}), world::index_in_leaf({5, 5, 5}));
  EXPECT_EQ(melted.block, water);
  EXPECT_EQ(melted.amount, 3764);
  // At the melting point, and what was more than needed is in it.
  EXPECT_EQ(melted.heat, thermal.heat_at(water, 3764, 273.15) + 1000);
}

TEST(Reactions, NoVoxelReactsTwiceInATick) {
  // Each voxel of lava has up to six of water beside it. What reacts goes in pairs.
  World world = boxed(24, [](VoxelPos v) { return world::random_bits(3, v.x, v.y, v.z) % 3 ? "water" : "lava"; });
  RuleAlone rule(world, "reactions");
  const auto all = [&] {
    return std::array<uint64_t, 4>{count(world, rule, "lava"), count(world, rule, "water"),
                                   count(world, rule, "obsidian"), count(world, rule, "steam")};
  };
  const auto before = all();
  const RuleReport report = rule.step();
  const auto after = all();
  const uint64_t lava = before[0] - after[0];
  EXPECT_GT(lava, 300u);
  EXPECT_EQ(before[1] - after[1], lava);
  EXPECT_EQ(after[2], lava);
  EXPECT_EQ(after[3], lava);
  EXPECT_EQ(report.voxels_changed, 2 * lava);
}

TEST(Reactions, APairsRateIsTheRowsRate) {
  // Pairs far from each other: lava over water, one in each 3^3; rate 1/4.
  World world = boxed(48, [](VoxelPos v) {
    if (v.x % 3 != 1 || v.z % 3 != 1) return "bedrock";
    return v.y % 3 == 1 ? "lava" : v.y % 3 == 2 ? "water" : "bedrock";
  });
  RuleAlone rule(world, "reactions");
  const auto pairs = static_cast<double>(count(world, rule, "lava"));
  rule.step();
  const auto reacted = static_cast<double>(count(world, rule, "obsidian"));
  EXPECT_NEAR(reacted / pairs, 0.25, 4 * std::sqrt(0.25 * 0.75 / pairs));
}

uint64_t reacted_hash(int threads, bool sweep, int flush_every) {
  const world::ThreadLimit limit(threads);
  World world = boxed(40, [](VoxelPos v) {
    constexpr const char* kNames[] = {"water", "lava", "ice",   "limestone", "acid",
                                      "air",   "fire", "steam", "snow",      "methane"};
    return kNames[world::random_bits(9, v.x >> 1, v.y >> 1, v.z >> 1) % 10];
  });
  MatterOptions options;
  options.seed = 44;
  RuleAlone rule(world, "reactions", options);
  for (int i = 0; i < 40; ++i) {
    if (i == 20) rule.cells().flush();  // an edit of a leaf is of what the store holds
    if (i == 20) fill(world, {{3, 3, 3}, {9, 9, 9}}, block_named(world, "water"));
    if (sweep) rule.wake({-1, -1, -1}, {4, 3, 4});
    rule.step();
    if (i % flush_every == 0) rule.cells().flush();
  }
  rule.cells().flush();
  return world::hash_combine(world.store.content_hash(), static_cast<uint64_t>(rule.total()));
}

TEST(Reactions, TheStateIsTheSameForAnyThreadsSleepAndFlushes) {
  const uint64_t expected = reacted_hash(1, false, 1000);
  for (const int threads : {2, 3, 8}) EXPECT_EQ(reacted_hash(threads, false, 1000), expected) << threads;
  EXPECT_EQ(reacted_hash(2, true, 1000), expected) << "all awake in each tick";
  EXPECT_EQ(reacted_hash(2, false, 3), expected) << "written back often";
}

TEST(Reactions, EnergyIsWhatItWasAndWhatRowsFree) {
  // Each acid that dissolves limestone frees 350 MJ; nothing else happens here.
  World world = boxed(8, [](VoxelPos v) { return v.y < 4 ? "limestone" : "acid"; });
  RuleAlone rule(world, "reactions");
  for (int i = 0; i < 4; ++i) rule.step();
  const uint64_t gas = count(world, rule, "carbon_dioxide");
  ASSERT_GT(gas, 0u);
  // Beyond their birth, at rest, all of these hold nothing.
  EXPECT_NEAR(static_cast<double>(rule.total()), static_cast<double>(gas) * 350e6 / kHeatUnitJ,
              1.0 * static_cast<double>(gas));
}

TEST(Reactions, ALoopOfRowsIsReportedByName) {
  MatterOptions options;
  auto read = read_reactions(
      "[[reaction]]\nwhat = \"forth\"\nrow = \"lava + gold_block -> lava + lead_block\"\nrate = [1, 2]\nunbalanced = "
      "\"a miracle\"\n"
      "[[reaction]]\nwhat = \"back\"\nrow = \"lava + lead_block -> lava + gold_block\"\nrate = [1, 2]\nunbalanced = "
      "\"a miracle\"\n",
      "scene.toml");
  ASSERT_TRUE(read.ok()) << read.error().message;
  options.reactions = read->rows;
  World world = boxed(8, [](VoxelPos v) { return v.y < 4 ? "gold_block" : "lava"; });
  RuleAlone rule(world, "reactions", options);
  std::string notes;
  for (int i = 0; i < 600; ++i)
    for (const std::string& note : rule.step().notes) notes += note;
  EXPECT_NE(notes.find("'forth'"), std::string::npos) << notes;
  EXPECT_NE(notes.find("'back'"), std::string::npos) << notes;
  EXPECT_EQ(notes.find("lava freezes"), std::string::npos) << notes;
}

TEST(Reactions, OfManyVoxelsOnlyThoseThatCanReactStayAwake) {
  World world = boxed(40, [](VoxelPos v) { return v.x < 20 ? "lava" : v.x > 22 ? "granite" : "obsidian"; });
  RuleAlone rule(world, "reactions");
  rule.step();
  rule.step();
  EXPECT_TRUE(rule.settled());
  fill(world, {{30, 30, 30}, {31, 30, 30}}, block_named(world, "acid"));
  fill(world, {{32, 30, 30}, {32, 30, 30}}, block_named(world, "limestone"));
  for (int i = 0; i < 200; ++i) rule.step();
  EXPECT_EQ(count(world, rule, "limestone"), 0u);
}

}  // namespace
}  // namespace sim
