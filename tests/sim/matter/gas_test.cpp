#include <gtest/gtest.h>

#include <algorithm>

#include "sim/matter/gas_kernel.h"
#include "sim/matter/thermal.h"
#include "tests/sim/matter/heat_support.h"

namespace sim {
namespace {

using world::BlockId;
using world::kAir;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

template <class Visit>
void for_each_in(const VoxelBox& box, Visit visit) {
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) visit(VoxelPos{x, y, z});
}
/// One voxel of a gas with so much of it.
void put_gas(World& world, VoxelPos v, const char* gas, int amount) {
  fill(world, {v, v}, block_named(world, gas));
  std::array<int32_t, world::kLeafVoxels> amounts{};
  world::LeafMask active;
  world::IntLayer& layer = world.store.make_int_layer(world::Layer::gas);
  layer.read_leaf(world::leaf_from_voxel(v), amounts, active);
  amounts[static_cast<size_t>(world::index_in_leaf(v))] = amount;
  active.set(world::index_in_leaf(v));
  layer.write_leaf(world::leaf_from_voxel(v), amounts, active);
}
int settle(Matter& matter, int most) {
  int ticks = 0;
  while (!matter.settled() && ticks < most) matter.step(), ++ticks;
  EXPECT_TRUE(matter.settled()) << "within " << most << " ticks";
  return ticks;
}

// ---- the kernel --------------------------------------------------------------------------------------------------

TEST(GasKernel, EqualsTheFlowsSpeltOutVoxelByVoxel) {
  for (const world::SimdLevel& level : world::simd_levels()) {
    const world::SimdChoice choice(level);
    for (uint64_t seed = 0; seed < 40; ++seed) {
      GasView view;
      const auto amount = [&](uint64_t stream, int i) {
        const uint64_t r = world::random_bits(seed, i, 0, 0, 0, stream);
        constexpr int kMost[4] = {30, 300, kFullVoxel, 65534};
        return static_cast<uint16_t>((r & 7) == 0   ? kNoGas
                                     : (r & 7) == 1 ? 0
                                                    : (r >> 8) % static_cast<uint64_t>(kMost[seed & 3]));
      };
      for (int i = 0; i < world::kLeafVoxels; ++i) view.own[i] = amount(0, i);
      for (int face = 0; face < 6; ++face)
        for (int i = 0; i < 64; ++i) view.beside[face][i] = amount(static_cast<uint64_t>(face) + 1, i);
      const GasNature nature = gas_nature(seed & 4 ? 0.6 : 1.9, 1.2, seed & 8 ? 0.3 : 0, 0.05);
      uint16_t next[world::kLeafVoxels];
      const GasFlow flow = flow_gas(view, nature, next);
      uint32_t lost = 0, reaches = 0;
      for (int i = 0; i < world::kLeafVoxels; ++i) {
        int expected = view.own[i];
        for (int face = 0; face < 6; ++face) {
          const VoxelPos v = world::offset_in_leaf(i) + world::face_step(face);
          const bool inside = world::leaf_from_voxel(v) == world::LeafPos{0, 0, 0};
          const int touching = face < 2 ? i & 63 : face < 4 ? (i >> 6) << 3 | (i & 7) : i >> 3;
          const int there = inside ? view.own[world::index_in_leaf(v)] : view.beside[face][touching];
          const int units = gas_flow(view.own[i], there, face, nature);
          ASSERT_EQ(units, -gas_flow(there, view.own[i], world::opposite_face(face), nature));
          expected -= units;
          if (units != 0 && !inside) reaches |= 1u << face;
        }
        if (nature.thins_of && expected < kThinGas) {
          const int goes = std::min(expected, (expected * nature.thins_of >> 16) + 1);
          expected -= goes;
          lost += static_cast<uint32_t>(goes);
        }
        ASSERT_EQ(next[i], expected) << level.name << " seed " << seed << " voxel " << i;
        ASSERT_GE(expected, 0);
      }
      EXPECT_EQ(flow.lost, lost);
      EXPECT_EQ(flow.reaches, reaches);
    }
  }
}

// CM5: nothing goes further than a voxel in a tick, and no voxel gives more than it holds, however light the gas is.
TEST(GasKernel, NoVoxelGivesMoreThanItHoldsAtAnyDensity) {
  for (const double density : {1e-6, 0.09, 1.1, 1.2, 2.0, 500.0}) {
    const GasNature nature = gas_nature(density, 1.2, 0, 0.05);
    for (const int amount : {1, 7, 30, kFullVoxel, 65534}) {
      int out = 0;
      for (int face = 0; face < 6; ++face) out += std::max(gas_flow(amount, 0, face, nature), 0);
      EXPECT_LE(out, amount) << density;
    }
  }
}

// ---- the rule ----------------------------------------------------------------------------------------------------

// CM1, and CM15: amounts far above a full voxel.
TEST(Gas, AmountsAreExactOverTwoThousandTicks) {
  World world = sealed_room({{-5, 0, -5}, {12, 14, 12}});
  put_gas(world, {3, 5, 3}, "methane", 65534);
  put_gas(world, {4, 5, 3}, "carbon_dioxide", 4080);
  put_gas(world, {-2, 9, 8}, "carbon_dioxide", 1);
  fill(world, {{6, 0, 6}, {12, 4, 12}}, block_named(world, "carbon_dioxide"));
  Matter matter(world, {});
  const int64_t methane = matter.amount(block_named(world, "methane")),
                carbon_dioxide = matter.amount(block_named(world, "carbon_dioxide"));
  EXPECT_EQ(methane, 65534);
  for (int i = 0; i < 2000; ++i) {
    matter.step();
    if (i % 100 != 0) continue;
    ASSERT_EQ(matter.amount(block_named(world, "methane")), methane) << i;
    ASSERT_EQ(matter.amount(block_named(world, "carbon_dioxide")), carbon_dioxide) << i;
  }
  for (const LedgerRow& row : matter.ledger()) EXPECT_TRUE(row.exact() && row.in == 0 && row.out == 0) << row.substance;
}

// CM7: it comes to rest. The bound is that of the kernel: six units from voxel to voxel.
TEST(Gas, ASealedRoomUnderPressureFillsEvenlyAndSleeps) {
  const VoxelBox room{{-4, -3, 2}, {7, 8, 12}};
  World world = sealed_room(room);
  int voxels = 0;
  for_each_in(room, [&](VoxelPos) { ++voxels; });
  int64_t all = 0;
  for (int x = -4; x <= 0; ++x)
    for (int y = -3; y <= 4; ++y)
      for (int z = 2; z <= 6; ++z) put_gas(world, {x, y, z}, "methane", 40000), all += 40000;
  Matter matter(world, {});
  const int ticks = settle(matter, 4000);
  int low = 65535, high = 0;
  for_each_in(room, [&](VoxelPos v) {
    const int here = matter.amount_at(v);
    low = std::min(low, here), high = std::max(high, here);
    for (int face = 1; face < 6; face += 2)
      if (const VoxelPos w = v + world::face_step(face); room.contains(w)) {
        EXPECT_LE(std::abs(here - matter.amount_at(w)), face == world::kFacePosY ? 7 : 6);
      }
  });
  EXPECT_EQ(matter.amount(block_named(world, "methane")), all);
  EXPECT_LE(high - low, 6 * (11 + 10) + 7 * 11) << "six units a voxel along x and z, seven along y";
  EXPECT_LT(high - low, all / voxels / 20) << "5 % of what a voxel holds";
  std::printf("a room of %d voxels is even after %d ticks: %d to %d units\n", voxels, ticks, low, high);
  const uint64_t hash = matter.state_hash();
  for (int i = 0; i < 20; ++i) EXPECT_EQ(matter.step().leaves_visited, 0u);
  EXPECT_EQ(matter.state_hash(), hash);
}

/// How much a layer of the room holds of what a full one does.
double fullness(const Matter& matter, const VoxelBox& room, int y) {
  double sum = 0, voxels = 0;
  for_each_in({{room.min.x, y, room.min.z}, {room.max.x, y, room.max.z}},
              [&](VoxelPos v) { sum += matter.amount_at(v), ++voxels; });
  return sum / voxels / kFullVoxel;
}

TEST(Gas, WhatIsHeavierThanAirPoolsAndWhatIsLighterGathersUnderTheCeiling) {
  const VoxelBox room{{-6, 0, -6}, {9, 15, 9}};
  for (const bool heavy : {true, false}) {
    World world = sealed_room(room);
    // A block in the middle: 5 of 16 layers.
    const char* gas = heavy ? "carbon_dioxide" : "methane";
    fill(world, {{-2, 4, -6}, {2, 11, 9}}, block_named(world, gas));
    fill(world, {{3, 4, -6}, {7, 11, 9}}, block_named(world, gas));
    Matter matter(world, {});
    settle(matter, 8000);
    const auto layer = [&](int k) { return fullness(matter, room, heavy ? k : 15 - k); };
    EXPECT_GT(layer(0), 0.95) << gas;
    EXPECT_GT(layer(2), 0.9) << gas;
    EXPECT_LT(layer(8), 0.05) << gas;
    EXPECT_LT(layer(15), 0.01) << gas;
    for (int k = 1; k < 16; ++k) EXPECT_LE(layer(k), layer(k - 1) + 7.0 / kFullVoxel) << gas << " layer " << k;
  }
}

TEST(Gas, TwoGasesOfOneRoomLieInOrderOfTheirDensities) {
  const VoxelBox room{{0, 0, 0}, {7, 15, 7}};
  World world = sealed_room(room);
  fill(world, {{0, 8, 0}, {7, 13, 7}}, block_named(world, "carbon_dioxide"));
  fill(world, {{0, 1, 0}, {7, 6, 7}}, block_named(world, "methane"));
  Matter matter(world, {});
  for (int i = 0; i < 3000; ++i) matter.step();
  double height[2] = {}, all[2] = {};
  matter.flush();
  for_each_in(room, [&](VoxelPos v) {
    const BlockId id = world.store.get(v);
    if (id == kAir) return;
    const size_t k = id == block_named(world, "methane");
    height[k] += matter.amount_at(v) * v.y, all[k] += matter.amount_at(v);
  });
  EXPECT_EQ(all[0], 384 * kFullVoxel);
  EXPECT_EQ(all[1], 384 * kFullVoxel);
  EXPECT_LT(height[0] / all[0] + 5, height[1] / all[1]);
}

// CM9: exactly, since nothing is drawn. The symmetries of a square keep gravity's direction; the plume's middle is at
// the corner of leaves, and its obstacle a square plate.
TEST(Gas, APlumeIsSymmetricUnderTheEightSymmetriesThatKeepGravity) {
  World world(world::standard_blocks());
  fill(world, {{-20, -1, -20}, {20, -1, 20}}, block_named(world, "granite"));
  fill(world, {{-3, 12, -3}, {3, 12, 3}}, block_named(world, "granite"));
  fill(world, {{-1, 0, -1}, {1, 3, 1}}, block_named(world, "smoke"));
  fill(world, {{-1, 4, -1}, {1, 6, 1}}, block_named(world, "steam"));
  Matter matter(world, {});
  for (int tick = 0; tick < 120; ++tick) {
    matter.step();
    if (tick % 30 != 29) continue;
    int differ = 0, held = 0;
    for_each_in({{0, 0, 0}, {30, 40, 30}}, [&](VoxelPos v) {
      const int here = matter.amount_at(v);
      held += here > 0;
      for (const VoxelPos w : {VoxelPos{-v.x, v.y, v.z},
                               {v.x, v.y, -v.z},
                               {-v.x, v.y, -v.z},
                               {v.z, v.y, v.x},
                               {-v.z, v.y, v.x},
                               {v.z, v.y, -v.x},
                               {-v.z, v.y, -v.x}})
        differ += matter.amount_at(w) != here;
    });
    EXPECT_EQ(differ, 0) << "after tick " << tick;
    EXPECT_GT(held, 100);
  }
}

// CM6: with a transfer of the whole difference two voxels would change places for ever.
TEST(Gas, TwoVoxelsComeToRestWithoutChangingPlacesForEver) {
  for (const bool upright : {false, true})
    for (const int amount : {5, 100, kFullVoxel, 60000}) {
      World world = sealed_room({{0, 0, 0}, {upright ? 0 : 1, upright ? 1 : 0, 0}});
      put_gas(world, {0, 0, 0}, "methane", amount);
      Matter matter(world, {});
      EXPECT_LE(settle(matter, 1000), amount == 5 && !upright ? 3 : 200) << amount;
      EXPECT_EQ(matter.amount(block_named(world, "methane")), amount);
    }
}

TEST(Gas, RoomsOfRandomContentComeToRest) {
  for (uint64_t seed = 0; seed < 6; ++seed) {
    const VoxelBox room{{-3, -2, -3}, {6, 9, 6}};
    World world = sealed_room(room);
    for_each_in(room, [&](VoxelPos v) {
      const uint64_t r = world::random_bits(seed, v.x, v.y, v.z);
      if ((r & 7) == 0) fill(world, {v, v}, block_named(world, "granite"));
      if ((r & 7) == 1) put_gas(world, v, "methane", 1 + static_cast<int>((r >> 8) % (seed % 2 ? 60000 : 3000)));
      if ((r & 15) == 2) put_gas(world, v, "carbon_dioxide", 1 + static_cast<int>((r >> 8) % 5000));
      if ((r & 15) == 3 && seed % 3 == 0) fill(world, {v, v}, block_named(world, "water"));
    });
    Matter matter(world, {.seed = seed});
    settle(matter, 20000);
  }
}

TEST(Gas, BubblesRiseThroughALiquidWithoutLossOfEither) {
  const VoxelBox shaft{{0, 0, 0}, {3, 25, 3}};
  World world = sealed_room(shaft);
  fill(world, {{0, 2, 0}, {3, 13, 3}}, block_named(world, "water"));
  fill(world, {{0, 0, 0}, {3, 1, 3}}, block_named(world, "carbon_dioxide"));
  fill(world, {{1, 6, 1}, {2, 7, 2}}, block_named(world, "methane"));
  Matter matter(world, {});
  std::map<BlockId, int64_t> before = matter.amounts();
  settle(matter, 4000);
  EXPECT_EQ(matter.amounts(), before);
  for_each_in(shaft, [&](VoxelPos v) {
    if (v.y <= 10) {
      EXPECT_EQ(world.store.get(v), block_named(world, "water")) << v.y;
    }
  });
}

TEST(Gas, ALiquidFallsThroughTheGasBesideIt) {
  // Water on a ledge and in a column, smoke all round.
  const VoxelBox room{{0, 0, 0}, {11, 11, 7}};
  World world = sealed_room(room);
  fill(world, room, block_named(world, "methane"));
  fill(world, {{0, 5, 0}, {3, 5, 7}}, block_named(world, "granite"));
  fill(world, {{0, 6, 0}, {3, 8, 7}}, block_named(world, "water"));
  Matter matter(world, {});
  const std::map<BlockId, int64_t> before = matter.amounts();
  settle(matter, 6000);
  EXPECT_EQ(matter.amounts(), before);
  int fallen = 0;
  for_each_in({{0, 0, 0}, {11, 4, 7}},
              [&](VoxelPos v) { fallen += world.store.get(v) == block_named(world, "water"); });
  EXPECT_GE(fallen, 48) << "of 96; what gas bears at its side stays on the ledge, in steps of a voxel";
}

TEST(Gas, SmokeInTheOpenIsGoneAfterAWhileAndEveryUnitIsBooked) {
  World world(world::standard_blocks());
  fill(world, {{-8, -1, -8}, {8, -1, 8}}, block_named(world, "granite"));
  fill(world, {{-1, 0, -1}, {1, 2, 1}}, block_named(world, "smoke"));
  Matter matter(world, {});
  const int ticks = settle(matter, 4000);
  const BlockId smoke = block_named(world, "smoke");
  EXPECT_EQ(matter.amount(smoke), 0);
  for (const LedgerRow& row : matter.ledger()) {
    EXPECT_TRUE(row.exact()) << row.substance;
    if (row.substance == "smoke") {
      EXPECT_EQ(row.out, 27 * kFullVoxel);
    }
  }
  EXPECT_EQ(world.store.find_int_layer(world::Layer::gas), nullptr);
  std::printf("27 m3 of smoke are gone after %d ticks\n", ticks);
}

/// Energy of all pages beyond air at rest, in units of heat.
int64_t energy(RuleAlone& rule, const World& world, const char* gas) {
  const ThermalTraits thermal(*world.palette, {});
  const BlockId id = block_named(world, gas);
  int64_t sum = rule.total();
  for (PageId p = 1; p < rule.cells().page_limit(); ++p)
    for (int i = 0; i < world::kLeafVoxels; ++i)
      if (const BlockId* ids = rule.cells().find_blocks(p); ids && ids[i] == id)
        sum += std::llround(static_cast<double>(thermal[id].born) * thermal.capacity(id, rule.cells().amount(p, i)));
  return sum;
}

TEST(Gas, HeatGoesAlongAndNoneIsLost) {
  for (const char* gas : {"methane", "smoke", "steam"}) {
    World world = sealed_room({{-6, 0, -6}, {9, 15, 9}});
    fill(world, {{-1, 0, -1}, {1, 2, 1}}, block_named(world, gas));
    RuleAlone rule(world, "gas");
    rule.set_heat({0, 1, 0}, 250'000'001);
    rule.set_heat({1, 1, 0}, -30'003);
    rule.set_heat({3, 5, 3}, 7'777'777);  // of air
    const int64_t before = energy(rule, world, gas);
    for (int i = 0; i < 200; ++i) {
      rule.step();
      ASSERT_EQ(energy(rule, world, gas), before) << gas << " after tick " << i;
    }
    EXPECT_GT(rule.heat({0, 8, 0}), 1000) << gas;
  }
}

World many_things() {
  World world = basin({{-20, 0, -20}, {27, 30, 27}});
  fill(world, {{-20, 0, -20}, {27, 4, 27}}, block_named(world, "water"));
  fill(world, {{-3, 1, -3}, {5, 3, 5}}, block_named(world, "methane"));
  fill(world, {{-15, 8, -15}, {-7, 16, -7}}, block_named(world, "smoke"));
  fill(world, {{7, 10, 7}, {14, 18, 14}}, block_named(world, "steam"));
  fill(world, {{-6, 20, 6}, {6, 26, 12}}, block_named(world, "carbon_dioxide"));
  fill(world, {{10, 20, -10}, {16, 27, -4}}, block_named(world, "sand"));
  return world;
}

TEST(Gas, TheStateIsTheSameForAnyThreadsAndInstructions) {
  expect_the_same_for_any_threads_and_instructions([] {
    World world = many_things();
    Matter matter(world, {.seed = 3});
    for (int i = 0; i < 40; ++i) matter.step();
    return matter.state_hash();
  });
}

// CM11.
TEST(Gas, SleepChangesNothing) {
  World a = many_things(), b = many_things();
  Matter asleep(a, {.seed = 5}), awake(b, {.seed = 5});
  for (int tick = 0; tick < 100; ++tick) {
    asleep.step();
    awake.wake_all();
    awake.step();
    if (tick % 10 != 9) continue;
    ASSERT_EQ(asleep.state_hash(), awake.state_hash()) << "after tick " << tick;
  }
}

}  // namespace
}  // namespace sim
