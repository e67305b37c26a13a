/// Pressure through closed passages, of liquids with inertia: sim/matter/liquid_conduits.cpp.
#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/sim/matter/heat_support.h"
#include "tests/sim/matter/liquid_support.h"
#include "world/base/random.h"

namespace sim {
namespace {

using world::BlockId;
using world::kAir;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

/// Ticks until all is at rest; its amount never changes.
int ticks_to_rest(Matter& matter, BlockId liquid, int most) {
  const int64_t before = matter.amount(liquid);
  int ticks = 0;
  for (; ticks < most && !matter.settled(); ++ticks) {
    matter.step();
    EXPECT_EQ(matter.amount(liquid), before) << "after tick " << ticks;
    if (matter.amount(liquid) != before) break;
  }
  EXPECT_TRUE(matter.settled());
  for (const LedgerRow& row : matter.ledger()) EXPECT_TRUE(row.exact()) << row.substance;
  return ticks;
}

/// The lowest and the highest of the columns of several boxes.
std::pair<int, int> extremes(const Matter& matter, std::initializer_list<VoxelBox> boxes) {
  std::vector<int> all;
  for (const VoxelBox& box : boxes) {
    const std::vector<int> some = levels(matter, box);
    all.insert(all.end(), some.begin(), some.end());
  }
  const auto [low, high] = std::minmax_element(all.begin(), all.end());
  return {*low, *high};
}

// CM14 with inertia: level within one unit, the amount exact, and asleep.
TEST(LiquidConduits, BothArmsOfAUTubeStandLevelWithinOneUnit) {
  for (const int length : {12, 60, 110, 300}) {
    World world = u_tube(length);
    const BlockId water = block_named(world, "water");
    fill(world, {{0, 0, 1}, {2, 30, 3}}, water);
    fill(world, {{0, 0, 2}, {length, 0, 2}}, water);
    Matter matter(world, with_waves());
    const int ticks = ticks_to_rest(matter, water, 8000);
    const auto [low, high] = extremes(matter, {{{0, 0, 1}, {2, 40, 3}}, {{length, 0, 1}, {length + 2, 40, 3}}});
    EXPECT_LE(high - low, 1) << "length " << length;
    std::printf("u-tube of %d m: level after %d ticks, at %d units\n", length, ticks, low);
  }
}

// A pipe of one width swings as a rigid column does, T = 2 pi sqrt(L A_shaft / (2 g A_pipe)), where levels are off by
// little, so that what a jet loses is little too.
TEST(LiquidConduits, ALongPipeSwingsSlowly) {
  constexpr int kLength = 60;
  World world(world::standard_blocks());
  fill(world, {{-2, -2, -2}, {kLength + 2, 40, 2}}, block_named(world, "granite"));
  fill(world, {{0, 0, 0}, {0, 40, 0}}, kAir);
  fill(world, {{kLength, 0, 0}, {kLength, 40, 0}}, kAir);
  const BlockId water = block_named(world, "water");
  fill(world, {{0, 0, 0}, {kLength, 0, 0}}, water);
  fill(world, {{0, 0, 0}, {0, 13, 0}}, water);
  fill(world, {{kLength, 0, 0}, {kLength, 11, 0}}, water);
  Matter matter(world, with_waves());
  const auto difference = [&] {
    return levels(matter, {{0, 0, 0}, {0, 40, 0}})[0] - levels(matter, {{kLength, 0, 0}, {kLength, 40, 0}})[0];
  };
  ASSERT_EQ(difference(), 2 * kFullVoxel);
  // Level for the first time after a quarter of a swing.
  int ticks = 0;
  while (ticks < 400 && difference() > 0) matter.step(), ++ticks;
  const double quarter_s = std::acos(0.0) * std::sqrt((kLength - 1) / (2 * 9.81));
  EXPECT_NEAR(ticks * 0.05, quarter_s, 0.1 * quarter_s);
  std::printf("a pipe of %d m: level first after %.2f s, a rigid column without losses after %.2f s\n", kLength,
              ticks * 0.05, quarter_s);
}

// By Torricelli's law half of the first difference takes 6.5 s without losses, and 1.22 times that with a sharp edge
// and a jet that is lost.
TEST(LiquidConduits, AWideBasinFillsThroughANarrowMouthAtItsBottom) {
  World world = two_basins();
  const BlockId water = block_named(world, "water");
  Matter matter(world, with_waves());
  const int ticks = ticks_to_rest(matter, water, 8000);
  const auto [low, high] = extremes(matter, {{{0, 0, 0}, {7, 24, 7}}, {{16, 0, 0}, {23, 24, 7}}});
  EXPECT_NEAR(low, 8 * kFullVoxel, 1);
  EXPECT_NEAR(high, 8 * kFullVoxel, 1);
  std::printf("two basins of 8 x 8 m and a pipe of 2 x 2 m: at rest after %d ticks\n", ticks);
}

/// Three wells of different widths over one tunnel.
World three_wells() {
  World world(world::standard_blocks());
  fill(world, {{-3, -3, -3}, {43, 30, 9}}, block_named(world, "granite"));
  fill(world, {{0, 0, 0}, {5, 30, 5}}, kAir);
  fill(world, {{18, 0, 2}, {19, 30, 3}}, kAir);
  fill(world, {{36, 0, 0}, {38, 30, 5}}, kAir);
  fill(world, {{0, 0, 2}, {38, 1, 3}}, block_named(world, "water"));
  fill(world, {{0, 0, 0}, {5, 20, 5}}, block_named(world, "water"));
  return world;
}

TEST(LiquidConduits, ThreeWellsFindOneLevel) {
  World world = three_wells();
  const BlockId water = block_named(world, "water");
  Matter matter(world, with_waves());
  ticks_to_rest(matter, water, 8000);
  const auto [low, high] =
      extremes(matter, {{{0, 0, 0}, {5, 30, 5}}, {{18, 0, 2}, {19, 30, 3}}, {{36, 0, 0}, {38, 30, 5}}});
  EXPECT_LE(high - low, 1);
}

// Air isn't a substance: it gives way. A cave under the level fills to its roof, and what is left stands level.
TEST(LiquidConduits, ASealedCaveFillsToItsRoof) {
  World world(world::standard_blocks());
  fill(world, {{-3, -3, -3}, {33, 30, 9}}, block_named(world, "granite"));
  fill(world, {{0, 0, 0}, {5, 30, 5}}, kAir);
  fill(world, {{15, 0, 0}, {24, 3, 5}}, kAir);
  const BlockId water = block_named(world, "water");
  fill(world, {{6, 0, 2}, {14, 1, 3}}, kAir);
  fill(world, {{0, 0, 0}, {5, 25, 5}}, water);
  Matter matter(world, with_waves());
  ticks_to_rest(matter, water, 8000);
  const auto [low, high] = extremes(matter, {{{0, 0, 0}, {5, 30, 5}}});
  EXPECT_LE(high - low, 1);
  EXPECT_GT(low, 4 * kFullVoxel);
  for (const int level : levels(matter, {{15, 0, 0}, {24, 3, 5}})) EXPECT_EQ(level, 4 * kFullVoxel);
}

/// Two basins and a pipe that rises over the wall between them, from y = 1 to 14: its legs, its mouths, its bend.
constexpr VoxelBox kSiphon[] = {{{9, 1, 1}, {9, 13, 1}},
                                {{20, 1, 1}, {20, 13, 1}},
                                {{8, 1, 1}, {8, 1, 1}},
                                {{21, 1, 1}, {21, 1, 1}},
                                {{9, 14, 1}, {20, 14, 1}}};
World siphon(int level) {
  World world(world::standard_blocks());
  fill(world, {{-3, -3, -3}, {33, 20, 6}}, block_named(world, "granite"));
  fill(world, {{0, 0, 0}, {7, 20, 3}}, kAir);
  fill(world, {{22, 0, 0}, {29, 20, 3}}, kAir);
  const BlockId water = block_named(world, "water");
  for (const VoxelBox& box : kSiphon) fill(world, box, kAir);
  fill(world, {{0, 0, 0}, {7, level - 1, 3}}, water);
  return world;
}

TEST(LiquidConduits, ASiphonThatIsNotFullDoesNotRun) {
  World world = siphon(10);
  const BlockId water = block_named(world, "water");
  for (size_t n = 0; n < 4; ++n) fill(world, kSiphon[n], water);  // up to the bend, and not in it
  fill(world, {{22, 0, 0}, {29, 3, 3}}, water);
  Matter matter(world, with_waves());
  const int64_t left = 10 * 32 + 14, all = left + 4 * 32 + 14;
  ASSERT_EQ(matter.amount(water), all * kFullVoxel);
  ticks_to_rest(matter, water, 8000);
  int64_t there = 0;
  for (const int level : levels(matter, {{0, 0, 0}, {9, 20, 3}})) there += level;
  EXPECT_EQ(there, left * kFullVoxel);
  const auto [low, high] = extremes(matter, {{{0, 0, 0}, {7, 20, 3}}});
  EXPECT_LE(high - low, 1);
}

TEST(LiquidConduits, ASiphonThatIsFullRuns) {
  World world = siphon(10);
  const BlockId water = block_named(world, "water");
  for (const VoxelBox& box : kSiphon) fill(world, box, water);
  fill(world, {{22, 0, 0}, {29, 3, 3}}, water);
  Matter matter(world, with_waves());
  ticks_to_rest(matter, water, 8000);
  const auto [low, high] = extremes(matter, {{{0, 0, 0}, {7, 20, 3}}, {{22, 0, 0}, {29, 20, 3}}});
  EXPECT_LE(high - low, 1) << "both basins are level";
}

// A pipe from a basin ends in the air over another: full at first, and a channel when the basin has sunk to its roof.
TEST(LiquidConduits, APipeThatEndsInTheAirRunsDry) {
  World world(world::standard_blocks());
  fill(world, {{-3, -3, -3}, {33, 30, 6}}, block_named(world, "granite"));
  fill(world, {{0, 12, 0}, {7, 28, 3}}, kAir);
  fill(world, {{20, 0, 0}, {29, 28, 3}}, kAir);
  const BlockId water = block_named(world, "water");
  fill(world, {{8, 12, 1}, {19, 13, 2}}, water);
  fill(world, {{0, 12, 0}, {7, 24, 3}}, water);
  Matter matter(world, with_waves());
  const auto depth_m = [&] {
    int64_t left = 0;
    for (const int level : levels(matter, {{0, 12, 0}, {7, 28, 3}})) left += level;
    return static_cast<double>(left) / (32 * kFullVoxel);
  };
  const int64_t before = matter.amount(water);
  // By Torricelli's law from 11 m over the pipe's roof to 1, through 4 of 32 m^2, with the losses of both ends.
  const double seconds = 32.0 / 4 * std::sqrt(1.5) * (std::sqrt(2 * 11 / 9.81) - std::sqrt(2 / 9.81));
  int ticks = 0;
  for (; ticks < 1000 && depth_m() > 3; ++ticks) matter.step();
  EXPECT_NEAR(ticks * 0.05, seconds, 0.15 * seconds);
  std::printf("a basin of 13 m has 3 m after %.1f s, by Torricelli's law after %.1f s\n", ticks * 0.05, seconds);
  for (; ticks < 3000; ++ticks) matter.step();
  EXPECT_EQ(matter.amount(water), before);
  EXPECT_LT(depth_m(), 0.15);
}

/// How much a second runs off a basin of this depth through a channel of 12 x 1 m that ends in the air: it is critical
/// at its end, and from there upwards deeper by what the drag of liquid_waves.cpp takes (Ven Te Chow. Open-Channel
/// Hydraulics. 1959, chapter 9).
double discharge(double depth_m) {
  constexpr double kGravity = 9.81, kDrag = 0.002, kEddies = 1.0 / 40, kStep = 0.005;
  const auto basin_depth = [&](double q) {
    double h = std::cbrt(q * q / kGravity) * 1.001;
    for (double x = 0; x < 12; x += kStep) {
      const double u = q / h, froude2 = u * u / (kGravity * h);
      h += std::min(0.01, kStep * (kDrag * u * u / h + kEddies * u) / (kGravity * std::max(1 - froude2, 1e-4)));
    }
    return h + (q / h) * (q / h) / (2 * kGravity);
  };
  double low = 1e-9, high = 10;
  for (int n = 0; n < 50; ++n) {
    const double middle = std::sqrt(low * high);
    (basin_depth(middle) > depth_m ? high : low) = middle;
  }
  return low;
}

// A channel under a roof that isn't full empties the last of its basin as its drag and critical flow at its end allow:
// ever slower, the lower it stands.
TEST(LiquidConduits, TheLastOfABasinRunsOffAsItsChannelAllows) {
  World world(world::standard_blocks());
  fill(world, {{-3, -3, -3}, {33, 20, 6}}, block_named(world, "granite"));
  fill(world, {{0, 12, 0}, {7, 18, 3}}, kAir);
  fill(world, {{20, 0, 0}, {29, 18, 3}}, kAir);
  fill(world, {{8, 12, 1}, {19, 13, 2}}, kAir);
  fill(world, {{0, 12, 0}, {7, 12, 3}}, block_named(world, "water"));
  Matter matter(world, with_waves());
  const auto depth_m = [&] {
    int64_t left = 0;
    for (const int level : levels(matter, {{0, 12, 0}, {7, 18, 3}})) left += level;
    return static_cast<double>(left) / (32 * kFullVoxel);
  };
  int ticks = 0;
  double from = 0.4;
  while (ticks < 4000 && depth_m() > from) matter.step(), ++ticks;
  for (const auto& [to, most] :
       {std::pair(0.2, 1.2), std::pair(0.1, 1.35), std::pair(0.05, 1.35), std::pair(0.025, 1.6)}) {
    const int begun = ticks;
    while (ticks < 8000 && depth_m() > to) matter.step(), ++ticks;
    // An area of 32 m^2, through a channel of 2 m.
    double expected_s = 0;
    for (double depth = from; depth > to * 1.0001; depth *= std::pow(to / from, 0.05))
      expected_s += depth * (1 - std::pow(to / from, 0.05)) * 32 / (2 * discharge(depth * std::pow(to / from, 0.025)));
    const double ratio = (ticks - begun) * 0.05 / expected_s;
    std::printf("from %g m to %g m in %.1f s, by channel flow in %.1f s\n", from, to, (ticks - begun) * 0.05,
                expected_s);
    EXPECT_GT(ratio, 1 / most);
    EXPECT_LT(ratio, most);
    from = to;
  }
}

// CM10: threads, instructions.
TEST(LiquidConduits, TheStateIsTheSameForAnyThreadsAndInstructions) {
  expect_the_same_for_any_threads_and_instructions([] {
    World world = three_wells();
    Matter matter(world, with_waves(3));
    for (int i = 0; i < 100; ++i) matter.step();
    return matter.state_hash();
  });
}

// CM11: what sleeps would do nothing. Waking all in each tick changes no bit of the state, through edits at random.
TEST(LiquidConduits, SleepChangesNothing) {
  World world = three_wells(), woken_world = three_wells();
  Matter matter(world, with_waves(3)), woken(woken_world, with_waves(3));
  uint64_t slept = 0;
  for (int tick = 0; tick < 250 || (tick < 3000 && !matter.settled()); ++tick) {
    // In the tunnel, in the wells, at the roof.
    if (tick < 250 && tick % 7 == 0) {
      const auto draw = [&](int n, int below) {
        return static_cast<int>(world::random_bits(11, tick, n, 0) % static_cast<uint64_t>(below));
      };
      const VoxelPos v{draw(0, 39), draw(1, 8) < 5 ? draw(2, 2) : draw(2, 20), 2 + draw(3, 2)};
      const char* const names[] = {"air", "granite", "water", "air"};
      world::EditBatch batch;
      batch.fill({v, v + VoxelPos{draw(4, 2), draw(5, 2), 0}}, *world.palette->find(names[draw(6, 4)]));
      for (Matter* m : {&matter, &woken}) ASSERT_TRUE(m->edit(batch, {.tick = matter.tick(), .serial = 0}).ok());
    }
    woken.wake_all();
    slept += woken.awake_leaves() - std::min(matter.awake_leaves(), woken.awake_leaves());
    matter.step(), woken.step();
    ASSERT_EQ(matter.state_hash(), woken.state_hash()) << "after tick " << tick;
  }
  EXPECT_GT(slept, 1000u) << "leaves in ticks";
  EXPECT_TRUE(matter.settled());
  for (const LedgerRow& row : matter.ledger()) EXPECT_TRUE(row.exact()) << row.substance;
}

/// A voxel of the wells' world, seen under one of the eight symmetries that keep gravity.
VoxelPos turned(VoxelPos v, int symmetry) {
  if (symmetry & 1) v.x = -1 - v.x;
  if (symmetry & 2) v.z = -1 - v.z;
  if (symmetry & 4) std::swap(v.x, v.z);
  return v;
}

// No direction is favoured: only what can't be divided goes by the side, a unit at a time.
TEST(LiquidConduits, AllEightSymmetriesAgreeToSomeUnits) {
  const VoxelBox box{{-3, -3, -3}, {43, 30, 9}};
  const auto run = [&](int symmetry) {
    World plain = three_wells(), world(world::standard_blocks());
    world::EditBatch batch;
    for (int x = box.min.x; x <= box.max.x; ++x)
      for (int y = box.min.y; y <= box.max.y; ++y)
        for (int z = box.min.z; z <= box.max.z; ++z) {
          const VoxelPos v = turned({x, y, z}, symmetry);
          batch.fill({v, v}, plain.store.get({x, y, z}));
        }
    EXPECT_TRUE(world.store.apply(batch).ok());
    Matter matter(world, with_waves());
    for (int i = 0; i < 60; ++i) matter.step();
    std::vector<int> all;
    for (int x = 0; x <= 38; ++x)
      for (int z = 0; z <= 5; ++z) {
        int level = 0;
        for (int y = 0; y <= 30; ++y) level += matter.amount_at(turned({x, y, z}, symmetry));
        all.push_back(level);
      }
    return all;
  };
  const std::vector<int> first = run(0);
  EXPECT_NE(first[0], 21 * kFullVoxel) << "something has moved";
  for (int symmetry = 1; symmetry < 8; ++symmetry) {
    const std::vector<int> all = run(symmetry);
    int worst = 0;
    for (size_t n = 0; n < all.size(); ++n) worst = std::max(worst, std::abs(all[n] - first[n]));
    std::printf("symmetry %d: columns differ by %d units of %d\n", symmetry, worst, kFullVoxel);
    EXPECT_LE(worst, kFullVoxel / 100);
  }
}

// What flows through a conduit takes its heat along, to the unit.
TEST(LiquidConduits, HeatComesAlong) {
  World world = three_wells();
  RuleAlone alone(world, "liquid", with_waves());
  for (int x = 0; x <= 5; ++x)
    for (int y = 2; y <= 20; ++y)
      for (int z = 0; z <= 5; ++z) alone.set_heat({x, y, z}, 4'000'000);
  const int64_t before = alone.total();
  const auto heat_in = [&](const VoxelBox& box) {
    int64_t sum = 0;
    for (int x = box.min.x; x <= box.max.x; ++x)
      for (int y = box.min.y; y <= box.max.y; ++y)
        for (int z = box.min.z; z <= box.max.z; ++z) sum += alone.heat({x, y, z});
    return sum;
  };
  EXPECT_EQ(heat_in({{36, 0, 0}, {38, 30, 5}}), 0);
  for (int tick = 0; tick < 200; ++tick) {
    alone.step();
    ASSERT_EQ(alone.total(), before) << "after tick " << tick;
  }
  // What has come is about as hot as the first well: the tunnel's cold water came first.
  int64_t amount = 0;
  for (int x = 36; x <= 38; ++x)
    for (int y = 2; y <= 30; ++y)
      for (int z = 0; z <= 5; ++z) {
        const VoxelPos v{x, y, z};
        const Cell cell = alone.cells().cell(alone.cells().find(world::leaf_from_voxel(v)), world::index_in_leaf(v));
        amount += alone.cells().is_fluid(cell.block) ? cell.amount : 0;
      }
  const double per_voxel =
      static_cast<double>(heat_in({{36, 2, 0}, {38, 30, 5}})) / static_cast<double>(amount) * kFullVoxel;
  EXPECT_GT(per_voxel, 1'500'000);
  EXPECT_LT(per_voxel, 4'000'000);
}

}  // namespace
}  // namespace sim
