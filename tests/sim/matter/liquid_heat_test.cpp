/// What flows takes its heat along: sim/matter/liquid_heat.h.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string_view>

#include "tests/sim/matter/heat_support.h"

namespace sim {
namespace {

using world::VoxelBox;
using world::VoxelPos;
using world::World;

constexpr VoxelBox kInside{{-12, 0, -12}, {27, 23, 11}};
constexpr VoxelBox kBlob{{-12, 18, -4}, {-7, 23, 3}};

/// Stairs down from the left, and a pit at their foot that fills from a pipe under a wall: falls, flows and pressure.
World stairs() {
  World world = basin(kInside);
  const world::BlockId granite = block_named(world, "granite");
  for (int step = 0; step < 5; ++step) {
    const int x = -12 + step * 5;
    fill(world, {{x, 0, -12}, {x + 4, 15 - step * 3, 11}}, granite);
  }
  fill(world, {{19, 0, -12}, {19, 3, 11}}, granite);
  fill(world, {{19, 0, 0}, {19, 0, 1}}, world::kAir);
  return world;
}

MatterOptions with_model(LiquidModel model) {
  MatterOptions options;
  options.knobs.liquid_model = model;
  return options;
}

void warm(RuleAlone& alone, const VoxelBox& box, int32_t heat) {
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) alone.set_heat({x, y, z}, heat);
}

struct Sums {
  int64_t amount = 0, heat = 0;
  std::array<double, 3> mass_centre{}, heat_centre{};
  double worst = 0;  // of all voxels: heat beyond what the amount there should hold
};
/// With so much heat a unit of liquid.
Sums sums_of(const Cells& cells, double heat_a_unit) {
  Sums s;
  for (PageId p = 1; p < cells.page_limit(); ++p)
    for (int i = 0; i < world::kLeafVoxels; ++i) {
      const Cell cell = cells.cell(p, i);
      const int amount = cells.is_fluid(cell.block) ? cell.amount : 0;
      const VoxelPos v = world::voxel_from_leaf(cells.pos(p)) + world::offset_in_leaf(i);
      s.amount += amount, s.heat += cell.heat;
      for (int axis = 0; axis < 3; ++axis) {
        s.mass_centre[static_cast<size_t>(axis)] += static_cast<double>(amount) * v[axis];
        s.heat_centre[static_cast<size_t>(axis)] += static_cast<double>(cell.heat) * v[axis];
      }
      s.worst = std::max(s.worst, std::abs(cell.heat - amount * heat_a_unit));
    }
  for (double& c : s.mass_centre) c /= static_cast<double>(s.amount);
  for (double& c : s.heat_centre) c /= static_cast<double>(s.heat);
  return s;
}

class LiquidCarriesHeat : public testing::TestWithParam<LiquidModel> {};
INSTANTIATE_TEST_SUITE_P(Models, LiquidCarriesHeat, testing::Values(LiquidModel::finite, LiquidModel::waves),
                         [](const auto& at) { return at.param == LiquidModel::finite ? "finite" : "waves"; });

TEST_P(LiquidCarriesHeat, HotWaterPouredDownStairsStaysHotAndNothingElseDoes) {
  World world = stairs();
  fill(world, kBlob, block_named(world, "water"));
  RuleAlone alone(world, "liquid", with_model(GetParam()));
  constexpr int32_t kHeat = 40'000'000;  // of a full voxel: 190 K
  warm(alone, kBlob, kHeat);
  const double a_unit = static_cast<double>(kHeat) / kFullVoxel;
  const Sums before = sums_of(alone.cells(), a_unit);
  ASSERT_EQ(before.worst, 0);
  for (int tick = 0; tick < 600; ++tick) {
    alone.step();
    ASSERT_EQ(alone.total(), before.heat) << "after tick " << tick;
    if (tick % 20 != 19) continue;
    const Sums now = sums_of(alone.cells(), a_unit);
    ASSERT_EQ(now.amount, before.amount);
    // All of it is as hot as it was, wherever it is: to less than one unit of liquid holds.
    ASSERT_LT(now.worst, a_unit) << "after tick " << tick;
    for (size_t axis = 0; axis < 3; ++axis)
      ASSERT_NEAR(now.heat_centre[axis], now.mass_centre[axis], 0.001) << "after tick " << tick;
  }
  const Sums after = sums_of(alone.cells(), a_unit);
  EXPECT_GT(after.mass_centre[0], before.mass_centre[0] + 20) << "it has run down";
  EXPECT_LT(after.mass_centre[1], before.mass_centre[1] - 15);
}

TEST_P(LiquidCarriesHeat, HotAndColdMixAndKeepTheirHeatToTheUnit) {
  expect_the_same_for_any_threads_and_instructions([&] {
    World world = stairs();
    fill(world, kBlob, block_named(world, "water"));
    fill(world, {{20, 0, -12}, {27, 1, 11}}, block_named(world, "water"));
    RuleAlone alone(world, "liquid", with_model(GetParam()));
    int64_t sum = 0;
    for (int x = kBlob.min.x; x <= kBlob.max.x; ++x)
      for (int y = kBlob.min.y; y <= kBlob.max.y; ++y)
        for (int z = kBlob.min.z; z <= kBlob.max.z; ++z) {
          const auto heat = static_cast<int32_t>(world::random_bits(7, x, y, z) % 200'000'000) - 100'000'000;
          alone.set_heat({x, y, z}, heat);
          sum += heat;
        }
    uint64_t hash = 0;
    for (int tick = 0; tick < 160; ++tick) {
      alone.step();
      EXPECT_EQ(alone.total(), sum);
    }
    for (PageId p = 1; p < alone.cells().page_limit(); ++p)
      for (int i = 0; i < world::kLeafVoxels; ++i) {
        const VoxelPos v = world::voxel_from_leaf(alone.cells().pos(p)) + world::offset_in_leaf(i);
        const Cell cell = alone.cells().cell(p, i);
        hash += world::random_bits(static_cast<uint64_t>(int64_t{cell.heat}), v.x, v.y, v.z, cell.amount);
      }
    return hash;
  });
}

TEST_P(LiquidCarriesHeat, WhereNothingIsWarmThereIsNoHeat) {
  World world = stairs();
  fill(world, kBlob, block_named(world, "water"));
  RuleAlone alone(world, "liquid", with_model(GetParam()));
  for (int tick = 0; tick < 100; ++tick) alone.step();
  EXPECT_FALSE(alone.cells().met_heat());
}

TEST(LiquidHeat, LavaThatHasCooledRunsOnColdAndSleepsAsSoonAsAnyOther) {
  const auto ticks_to_rest = [](int32_t heat) {
    World world = basin({{0, 0, 0}, {11, 15, 11}});
    const VoxelBox pile{{0, 0, 0}, {5, 9, 5}};
    fill(world, pile, block_named(world, "lava"));
    RuleAlone alone(world, "liquid");
    if (heat != 0) warm(alone, pile, heat);
    const int64_t sum = alone.total();
    int ticks = 0;
    for (; ticks < 6000 && !alone.settled(); ++ticks) {
      alone.step();
      EXPECT_EQ(alone.total(), sum);
    }
    const double a_unit = static_cast<double>(heat) / kFullVoxel;
    EXPECT_LE(sums_of(alone.cells(), a_unit).worst, std::abs(a_unit));
    return ticks;
  };
  const int of_fresh = ticks_to_rest(0);
  EXPECT_LT(of_fresh, 6000);
  EXPECT_EQ(ticks_to_rest(-20'000'000), of_fresh) << "below what it is born with";
}

}  // namespace
}  // namespace sim
