#include <gtest/gtest.h>

#include <numeric>

#include "sim/matter/pieces.h"
#include "tests/sim/matter/matter_support.h"
#include "world/base/jobs.h"

namespace sim {
namespace {

using world::BlockId;
using world::kAir;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

MatterOptions support(int reach = 65536) {
  MatterOptions options;
  options.effects = {"support"};
  options.knobs.support_reach = reach;
  return options;
}
/// A floor of granite whose top is y = 0.
World floor_of_granite() {
  World world(world::standard_blocks());
  fill(world, {{-24, -4, -24}, {40, -1, 40}}, block_named(world, "granite"));
  return world;
}
int count_in(const World& world, const VoxelBox& box, const char* block) {
  world::StoreReader reader(world.store);
  const BlockId id = block_named(world, block);
  int count = 0;
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) count += reader.get({x, y, z}) == id;
  return count;
}
void expect_exact(Matter& matter) {
  for (const LedgerRow& row : matter.ledger()) ASSERT_TRUE(row.exact()) << row.substance << ", tick " << matter.tick();
}
void run_until_settled(Matter& matter, int most = 2000) {
  for (int i = 0; i < most; ++i) {
    matter.step();  // takes in edits
    expect_exact(matter);
    if (matter.settled()) break;
  }
  matter.flush();
  ASSERT_TRUE(matter.settled());
}
/// Ticks of rest: whatever is awake at the start of a world has been looked at.
void rest(Matter& matter) {
  for (int i = 0; i < 3; ++i) matter.step();
  matter.flush();
}

TEST(Support, ATableFallsByItsHeightWhenItsLastLegIsCut) {
  World world = floor_of_granite();
  fill(world, {{0, 5, 0}, {8, 5, 8}}, block_named(world, "oak_planks"));
  for (const VoxelPos foot : {VoxelPos{0, 0, 0}, {8, 0, 0}, {0, 0, 8}, {8, 0, 8}})
    fill(world, {foot, foot + VoxelPos{0, 4, 0}}, block_named(world, "oak_log"));
  Matter matter(world, support());
  rest(matter);
  for (const VoxelPos foot : {VoxelPos{0, 0, 0}, {8, 0, 0}, {0, 0, 8}}) {
    fill(world, {foot, foot + VoxelPos{0, 4, 0}}, kAir);
    rest(matter);
    EXPECT_EQ(count_in(world, {{0, 5, 0}, {8, 5, 8}}, "oak_planks"), 81);
  }
  fill(world, {{8, 0, 8}, {8, 4, 8}}, kAir);
  // g / 2 t^2 with 9.81 m/s^2 and 1/20 s, less than a voxel of it kept.
  for (int tick = 1; tick <= 40; ++tick) {
    matter.step();
    matter.flush();
    const int fallen = std::min(5, static_cast<int>(9.81 / 2 * tick * tick / 400));
    EXPECT_EQ(count_in(world, {{0, 5 - fallen, 0}, {8, 5 - fallen, 8}}, "oak_planks"), 81) << tick;
    expect_exact(matter);
  }
  EXPECT_TRUE(matter.settled());
}

TEST(Support, AnArchStandsAndABridgeCutInTheMiddleStaysOnBothSides) {
  World world = floor_of_granite();
  for (const int x : {0, 20}) fill(world, {{x, 0, 0}, {x + 1, 7, 2}}, block_named(world, "brick_red"));
  fill(world, {{0, 8, 0}, {21, 8, 2}}, block_named(world, "brick_red"));
  const int voxels = count_in(world, {{0, 0, 0}, {21, 8, 2}}, "brick_red");
  Matter matter(world, support());
  fill(world, {{10, 8, 0}, {10, 8, 0}}, kAir);
  run_until_settled(matter);
  EXPECT_EQ(count_in(world, {{0, 8, 0}, {21, 8, 2}}, "brick_red"), 65);
  fill(world, {{10, 8, 1}, {10, 8, 2}}, kAir);
  run_until_settled(matter);
  EXPECT_EQ(count_in(world, {{0, 0, 0}, {21, 8, 2}}, "brick_red"), voxels - 3);
  EXPECT_EQ(count_in(world, {{0, 8, 0}, {21, 8, 2}}, "brick_red"), 63);
  // A second cut: what is between the two comes down.
  fill(world, {{4, 8, 0}, {4, 8, 2}}, kAir);
  run_until_settled(matter);
  EXPECT_EQ(count_in(world, {{5, 0, 0}, {9, 0, 2}}, "brick_red"), 15);
  EXPECT_EQ(count_in(world, {{11, 8, 0}, {21, 8, 2}}, "brick_red"), 33);
}

TEST(Support, AnIslandWithinReachFallsWholeAndALargerOneStays) {
  for (const bool within : {true, false}) {
    World world = floor_of_granite();
    fill(world, {{0, 10, 0}, {9, 14, 9}}, block_named(world, "dirt"));
    Matter matter(world, support(within ? 499 : 498));
    rest(matter);
    EXPECT_EQ(count_in(world, {{0, 10, 0}, {9, 14, 9}}, "dirt"), 500) << "it floated before";
    fill(world, {{0, 14, 0}, {0, 14, 0}}, kAir);
    run_until_settled(matter);
    const int y = within ? 0 : 10;
    EXPECT_EQ(count_in(world, {{0, y, 0}, {9, y + 4, 9}}, "dirt"), 499);
  }
}

TEST(Support, WhatFloatedGoesOnFloatingBesideThingsThatMove) {
  World world = floor_of_granite();
  fill(world, {{0, 9, 0}, {3, 9, 3}}, block_named(world, "glass"));
  fill(world, {{4, 0, 0}, {8, 14, 6}}, block_named(world, "sand"));
  fill(world, {{-4, 4, 0}, {-1, 12, 4}}, block_named(world, "water"));
  Matter matter(world, support());
  for (int i = 0; i < 300; ++i) matter.step();
  matter.flush();
  EXPECT_EQ(count_in(world, {{0, 9, 0}, {3, 9, 3}}, "glass"), 16);
}

TEST(Support, WithoutBeingAskedForNothingFalls) {
  World world = floor_of_granite();
  fill(world, {{0, 0, 0}, {0, 5, 0}}, block_named(world, "oak_log"));
  fill(world, {{4, 0, 0}, {4, 0, 0}}, block_named(world, "sand"));
  Matter matter(world, {});
  fill(world, {{0, 0, 0}, {0, 0, 0}}, kAir);
  for (int i = 0; i < 60; ++i) matter.step();
  matter.flush();
  EXPECT_EQ(count_in(world, {{0, 1, 0}, {0, 5, 0}}, "oak_log"), 5);
  for (const EffectReport& effect : matter.effects())
    if (effect.name == "support") {
      EXPECT_FALSE(effect.called_for);
      EXPECT_EQ(effect.leaves_visited + effect.bytes, 0u);
    }
}

TEST(Support, SandBearsAHouseUntilItRunsOff) {
  World world = floor_of_granite();
  // A pit of sand with a plate on it; its wall is opened.
  fill(world, {{0, 0, 0}, {8, 3, 8}}, block_named(world, "granite"));
  fill(world, {{1, 0, 1}, {7, 3, 7}}, block_named(world, "sand"));
  fill(world, {{2, 4, 2}, {6, 5, 6}}, block_named(world, "brick_red"));
  Matter matter(world, support());
  rest(matter);
  fill(world, {{2, 5, 2}, {2, 5, 2}}, kAir);
  run_until_settled(matter);
  EXPECT_EQ(count_in(world, {{2, 4, 2}, {6, 5, 6}}, "brick_red"), 49) << "it stands on sand";
  fill(world, {{1, 0, 1}, {7, 3, 7}}, kAir);
  run_until_settled(matter);
  EXPECT_EQ(count_in(world, {{2, 0, 2}, {6, 1, 6}}, "brick_red"), 49);
}

TEST(Support, ACupDoesNotStandOnTheSandInIt) {
  World world = floor_of_granite();
  // A hanging box with sand inside: its lid lies on the sand, which lies on its bottom.
  fill(world, {{0, 6, 0}, {4, 10, 4}}, block_named(world, "granite"));
  fill(world, {{1, 7, 1}, {3, 9, 3}}, block_named(world, "sand"));
  fill(world, {{2, 11, 2}, {2, 20, 2}}, block_named(world, "oak_log"));
  Matter matter(world, support());
  rest(matter);
  fill(world, {{2, 12, 2}, {2, 12, 2}}, kAir);
  run_until_settled(matter);
  EXPECT_EQ(count_in(world, {{0, 0, 0}, {4, 4, 4}}, "granite"), 98);
  EXPECT_EQ(count_in(world, {{1, 1, 1}, {3, 3, 3}}, "sand"), 27);
  EXPECT_EQ(count_in(world, {{2, 5, 2}, {2, 30, 2}}, "oak_log"), 9);
}

TEST(Support, APieceGoesThroughWaterAndAllOfItIsStillThere) {
  World world = floor_of_granite();
  fill(world, {{0, 0, 0}, {12, 8, 12}}, block_named(world, "granite"));
  fill(world, {{1, 0, 1}, {11, 8, 11}}, kAir);
  fill(world, {{1, 0, 1}, {11, 3, 11}}, block_named(world, "water"));
  fill(world, {{4, 12, 4}, {8, 15, 8}}, block_named(world, "iron_block"));
  fill(world, {{6, 16, 6}, {6, 16, 6}}, block_named(world, "iron_block"));
  Matter matter(world, support());
  rest(matter);
  fill(world, {{6, 16, 6}, {6, 16, 6}}, kAir);
  const int64_t water = matter.amount(block_named(world, "water"));
  for (int i = 0; i < 600; ++i) {
    matter.step();
    ASSERT_EQ(matter.amount(block_named(world, "water")), water);
  }
  expect_exact(matter);
  matter.flush();
  EXPECT_EQ(count_in(world, {{4, 0, 4}, {8, 3, 8}}, "iron_block"), 100);
}

TEST(Support, PiecesThatMeetInTheAirBecomeOneAndThoseThatAreCutFallApart) {
  World world = floor_of_granite();
  // Two plates one above the other, the upper one let go first.
  fill(world, {{0, 30, 0}, {4, 30, 4}}, block_named(world, "oak_planks"));
  fill(world, {{0, 20, 0}, {4, 20, 4}}, block_named(world, "brick_red"));
  Matter matter(world, support());
  rest(matter);
  fill(world, {{0, 30, 0}, {0, 30, 0}}, kAir);
  for (int i = 0; i < 20; ++i) matter.step();
  matter.flush();
  fill(world, {{0, 20, 0}, {0, 20, 0}}, kAir);
  for (int i = 0; i < 18; ++i) matter.step();
  matter.flush();
  // They met: one lies on the other.
  int lower = 0;
  while (count_in(world, {{4, lower, 4}, {4, lower, 4}}, "brick_red") == 0) ++lower;
  EXPECT_EQ(count_in(world, {{0, lower, 0}, {4, lower + 1, 4}}, "oak_planks"), 24);
  ASSERT_GT(lower, 2);
  // Cut down to two columns that don't touch.
  fill(world, {{1, lower, 0}, {3, lower + 1, 4}}, kAir);
  run_until_settled(matter);
  EXPECT_EQ(count_in(world, {{0, 0, 0}, {4, 0, 4}}, "brick_red"), 9);
  EXPECT_EQ(count_in(world, {{0, 1, 0}, {4, 1, 4}}, "oak_planks"), 9);
}

TEST(Support, PropsThatBurnLetDownWhatTheyBear) {
  World world = floor_of_granite();
  fill(world, {{0, 4, 0}, {6, 9, 6}}, block_named(world, "brick_red"));
  for (const VoxelPos foot : {VoxelPos{0, 0, 0}, {6, 0, 0}, {0, 0, 6}, {6, 0, 6}})
    fill(world, {foot, foot + VoxelPos{0, 3, 0}}, block_named(world, "oak_log"));
  fill(world, {{1, 0, 1}, {5, 0, 5}}, block_named(world, "hay"));
  fill(world, {{3, 1, 3}, {3, 1, 3}}, block_named(world, "fire"));
  MatterOptions options = support();
  options.knobs.fire_model = FireModel::chance;
  Matter matter(world, options);
  for (int i = 0; i < 4000; ++i) matter.step();
  matter.flush();
  EXPECT_EQ(count_in(world, {{0, 0, 0}, {6, 9, 6}}, "brick_red"), 294);
  EXPECT_LT(count_in(world, {{0, 9, 0}, {6, 9, 6}}, "brick_red"), 49) << "it has come down";
  expect_exact(matter);
}

// ---- the search, against components found voxel by voxel ---------------------------------------------------------

/// Solids of a dense box that don't stand, by union and find.
class DenseStructures {
 public:
  DenseStructures(const World& world, const VoxelBox& box) : box_(box) {
    world::StoreReader reader(world.store);
    const VoxelPos n = box.max - box.min + VoxelPos{1, 1, 1};
    size_ = n;
    const MatterTraits traits(*world.palette);
    for (int x = box.min.x; x <= box.max.x; ++x)
      for (int y = box.min.y; y <= box.max.y; ++y)
        for (int z = box.min.z; z <= box.max.z; ++z) content_.push_back(traits[reader.get({x, y, z})].content);
    parent_.resize(content_.size());
    std::iota(parent_.begin(), parent_.end(), size_t{0});
    each([&](VoxelPos v) {
      for (const VoxelPos step : {VoxelPos{1, 0, 0}, {0, 1, 0}, {0, 0, 1}})
        if (is(v, Content::closed) && is(v + step, Content::closed)) parent_[root(index(v))] = root(index(v + step));
    });
  }
  /// Roots of those that stand.
  std::vector<uint8_t> standing(size_t reach, int ground_y) {
    std::vector<size_t> voxels(content_.size());
    std::vector<uint8_t> stands(content_.size());
    each([&](VoxelPos v) {
      if (!is(v, Content::closed)) return;
      const size_t r = root(index(v));
      stands[r] |= ++voxels[r] > reach || v.y <= ground_y;
    });
    for (bool changed = true; changed;) {
      changed = false;
      each([&](VoxelPos v) {
        if (!is(v, Content::closed) || stands[root(index(v))]) return;
        VoxelPos down = v - VoxelPos{0, 1, 0};
        if (!is(down, Content::grain)) return;
        while (is(down, Content::grain) && down.y > ground_y) --down.y;
        const bool borne = is(down, Content::grain) || (is(down, Content::closed) && stands[root(index(down))]);
        if (borne) stands[root(index(v))] = changed = true;
      });
    }
    return stands;
  }
  template <class Visit>
  void each(Visit visit) {
    for (int x = box_.min.x; x <= box_.max.x; ++x)
      for (int y = box_.min.y; y <= box_.max.y; ++y)
        for (int z = box_.min.z; z <= box_.max.z; ++z) visit(VoxelPos{x, y, z});
  }
  bool is(VoxelPos v, Content content) const { return box_.contains(v) && content_[index(v)] == content; }
  size_t root(size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  size_t index(VoxelPos v) const {
    const VoxelPos d = v - box_.min;
    return static_cast<size_t>((d.x * size_.y + d.y) * size_.z + d.z);
  }

 private:
  VoxelBox box_;
  VoxelPos size_;
  std::vector<Content> content_;
  std::vector<size_t> parent_;
};

World random_world(const VoxelBox& box, uint64_t seed, float solid, float grain) {
  World world(world::standard_blocks());
  world::EditBatch batch;
  const BlockId stone = block_named(world, "granite"), sand = block_named(world, "sand");
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const float r = world::uniform01(world::random_bits(seed, x, y, z));
        if (r < solid + grain) batch.set({x, y, z}, r < solid ? stone : sand);
      }
  CHECK(world.store.apply(batch).ok());
  return world;
}

TEST(Support, TheFloodFindsWhatUnionAndFindDoes) {
  const VoxelBox box{{-11, -5, -9}, {18, 20, 16}};
  size_t fallen_all = 0, standing_all = 0;
  for (const auto& [of_solid, grain] : {std::pair{0.25f, 0.0f}, {0.32f, 0.1f}, {0.2f, 0.4f}, {0.6f, 0.1f}})
    for (uint64_t seed = 1; seed <= 6; ++seed)
      for (const uint64_t reach : {20, 300, 100000}) {
        const float solid = of_solid;
        World world = random_world(box, seed, solid, grain);
        const int ground = -4;
        const MatterTraits traits(*world.palette);
        Structures structures;
        structures.build(world.store, traits, ground);
        VoxelSet all;
        for (const world::LeafPos& l : world.store.mixed_leaves())
          if (!structures.standing(l).is_none()) all.push_back({l, structures.standing(l)});
        const Structures::Search search = structures.find_fallen(all, reach, [&](VoxelPos v) {
          const Content c = traits[world.store.get(v)].content;
          return c == Content::grain ? Below::grain : c == Content::closed ? Below::solid : Below::open;
        });
        std::map<VoxelPos, size_t> fallen;
        for (size_t n = 0; n < search.fallen.size(); ++n)
          for (const LeafPart& part : search.fallen[n])
            world::for_each_voxel(
                part.mask, [&](int i) { fallen[world::voxel_from_leaf(part.leaf) + world::offset_in_leaf(i)] = n; });
        DenseStructures dense(world, box);
        const std::vector<uint8_t> stands = dense.standing(reach, ground);
        std::map<size_t, size_t> structure_of;
        dense.each([&](VoxelPos v) {
          if (!dense.is(v, Content::closed)) return;
          const size_t root = dense.root(dense.index(v));
          ASSERT_EQ(fallen.count(v), stands[root] ? 0u : 1u) << seed << ' ' << reach << ' ' << solid;
          if (stands[root]) return void(++standing_all);
          ++fallen_all;
          ASSERT_EQ(structure_of.try_emplace(root, fallen[v]).first->second, fallen[v]) << "another structure";
        });
        EXPECT_EQ(structure_of.size(), search.fallen.size());
      }
  EXPECT_GT(fallen_all, 10000u);
  EXPECT_GT(standing_all, 10000u);
}

/// A grove of crossing beams on posts, all of it standing.
World scaffold() {
  World world = floor_of_granite();
  const BlockId log = block_named(world, "oak_log"), plank = block_named(world, "oak_planks");
  for (int x = 0; x <= 30; x += 6)
    for (int z = 0; z <= 30; z += 6) fill(world, {{x, 0, z}, {x, 20, z}}, log);
  for (int y = 4; y <= 20; y += 4)
    for (int at = 0; at <= 30; at += 6) {
      fill(world, {{0, y, at}, {30, y, at}}, plank);
      fill(world, {{at, y, 0}, {at, y, 30}}, plank);
    }
  return world;
}

TEST(Support, AfterTenThousandCutsNothingHangsAndNothingIsLost) {
  World world = scaffold();
  Matter matter(world, support());
  rest(matter);
  uint64_t cuts = 0;
  for (int tick = 0; cuts < 10'000; ++tick) {
    matter.flush();
    world::EditBatch batch;
    for (int k = 0; k < 20; ++k, ++cuts) {
      const uint64_t r = world::random_bits(5, tick, k, 0);
      batch.set({static_cast<int>(r % 31), static_cast<int>((r >> 8) % 21), static_cast<int>((r >> 16) % 31)}, kAir);
    }
    CHECK(world.store.apply(batch).ok());
    matter.step();
    if (tick % 16 == 0) expect_exact(matter);
  }
  run_until_settled(matter);
  matter.flush();
  const VoxelBox box{{-24, -4, -24}, {40, 40, 40}};
  DenseStructures dense(world, box);
  const std::vector<uint8_t> stands = dense.standing(1 << 20, -4);
  size_t solids = 0;
  dense.each([&](VoxelPos v) {
    if (!dense.is(v, Content::closed)) return;
    EXPECT_TRUE(stands[dense.root(dense.index(v))]) << v.x << ' ' << v.y << ' ' << v.z;
    solids += v.y >= 0;
  });
  EXPECT_GT(solids, 500u);
}

TEST(Support, TheStateIsTheSameForAnyThreadsSleepAndFlushes) {
  std::vector<uint64_t> hashes;
  for (const int threads : {1, 2, 3, 8, -2, -3}) {
    const world::ThreadLimit limit(std::abs(threads));
    World world = scaffold();
    fill(world, {{0, 21, 0}, {30, 24, 30}}, block_named(world, "sand"));
    fill(world, {{8, 0, 8}, {22, 3, 22}}, block_named(world, "water"));
    Matter matter(world, support());
    rest(matter);
    for (int tick = 0; tick < 120; ++tick) {
      if (tick % 4 == 0) {
        matter.flush();
        const uint64_t r = world::random_bits(9, tick, 0, 0);
        const int x = static_cast<int>(r % 25), y = static_cast<int>((r >> 8) % 18),
                  z = static_cast<int>((r >> 16) % 25);
        fill(world, {{x, y, z}, {x + 6, y + 2, z + 6}}, kAir);
      }
      if (threads == -2) matter.wake_all();
      if (threads == -3) matter.flush();
      matter.step();
    }
    hashes.push_back(matter.state_hash());
  }
  for (const uint64_t hash : hashes) EXPECT_EQ(hash, hashes[0]);
}

/// A tower of 24 x 40 x 24 voxels with sand in its rooms falls through oil into water.
uint64_t hash_of_tower(int threads) {
  const world::ThreadLimit limit(threads);
  World world = floor_of_granite();
  fill(world, {{-4, 0, -4}, {36, 9, 36}}, block_named(world, "granite"));
  fill(world, {{-3, 0, -3}, {35, 9, 35}}, block_named(world, "water"));
  fill(world, {{3, 20, 5}, {26, 59, 28}}, block_named(world, "brick_red"));
  for (int y = 22; y < 58; y += 6) {
    fill(world, {{5, y, 7}, {24, y + 3, 26}}, kAir);
    fill(world, {{8, y, 10}, {12, y + 1, 14}}, block_named(world, y % 4 == 0 ? "sand" : "oil"));
  }
  Matter matter(world, support());
  rest(matter);
  fill(world, {{3, 59, 5}, {3, 59, 5}}, kAir);
  uint64_t hash = 0;
  for (int tick = 0; tick < 60; ++tick) {
    matter.step();
    hash = world::hash_combine(hash, matter.state_hash());
  }
  expect_exact(matter);
  return hash;
}

TEST(Support, ATowerFallsTheSameOnAnyNumberOfThreads) {
  const uint64_t hash = hash_of_tower(1);
  for (const int threads : {2, 3, 8}) EXPECT_EQ(hash_of_tower(threads), hash) << threads;
}

TEST(Support, APieceFallsTheSameWhereverLeavesBegin) {
  std::vector<std::vector<int>> heights;
  for (const VoxelPos at : {VoxelPos{0, 20, 0}, {5, 23, 3}, {-7, 27, -2}}) {
    World world = floor_of_granite();
    fill(world, {at, at + VoxelPos{9, 9, 9}}, block_named(world, "granite"));
    fill(world, {at + VoxelPos{1, 1, 1}, at + VoxelPos{8, 8, 8}}, kAir);
    Matter matter(world, support());
    rest(matter);
    fill(world, {at, at}, kAir);
    std::vector<int>& fallen = heights.emplace_back();
    for (int tick = 0; tick < 36; ++tick) {
      matter.step();
      matter.flush();
      int y = at.y + 9;
      while (world.store.get(at + VoxelPos{4, 0, 4} + VoxelPos{0, y - at.y, 0}) == kAir) --y;
      fallen.push_back(at.y + 9 - y);
      EXPECT_EQ(count_in(world, {{at.x, y - 9, at.z}, at + VoxelPos{9, y - at.y, 9}}, "granite"), 487);
    }
  }
  EXPECT_EQ(heights[0], heights[1]);
  EXPECT_EQ(heights[0], heights[2]);
}

}  // namespace
}  // namespace sim
