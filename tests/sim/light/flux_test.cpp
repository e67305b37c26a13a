#include "sim/light/flux.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/sim/light/flux_support.h"
#include "world/base/jobs.h"
#include "world/base/simd.h"
#include "world/world.h"

namespace sim {
namespace {

using world::BlockId;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

constexpr double kPi = 3.14159265358979323846;

void fill(World& w, VoxelPos min, VoxelPos max, BlockId block) {
  world::EditBatch batch;
  batch.fill({min, max}, block);
  ASSERT_TRUE(w.store.apply(batch).ok());
}

/// A room of `size` clear voxels from `at` on, with walls one voxel thick.
void room(World& w, VoxelPos at, VoxelPos size, BlockId wall) {
  fill(w, at + VoxelPos{-1, -1, -1}, at + size, wall);
  fill(w, at, at + size + VoxelPos{-1, -1, -1}, world::kAir);
}

FluxReport solve(Flux& flux, const FluxKnobs& knobs) {
  auto report = flux.solve(knobs);
  EXPECT_TRUE(report.ok());
  return *report;
}

void expect_books(const FluxReport& report, double tolerance) {
  for (int b = 0; b < 3; ++b) {
    const FluxBooks& k = report.books;
    EXPECT_NEAR(k.absorbed[b] + k.escaped[b] + k.stored[b], k.emitted[b], tolerance * k.emitted[b]) << b;
  }
}

/// Every wall emits M and reflects rho: B = M / (1 - rho) everywhere, whatever the shape. The bound: a residual of 1e-5
/// of the sum, spread over few surfaces, and float sums along 40 voxels (5 roundings each, u = 6e-8).
TEST(Flux, WhiteFurnaceStaysAtOne) {
  for (const int directions : {6, 8, 32, 72}) {
    World w;
    world::Block furnace = matte("furnace", 0.5f, 0.8f, 0.95f);
    furnace.emission = {6 * 0.5f, 6 * 0.2f, 6 * 0.05f};  // 1 W/m^2 after all reflections
    const BlockId wall = *w.palette->add(furnace);
    room(w, {-5, 3, 2}, {13, 9, 17}, wall);
    fill(w, {0, 3, 6}, {2, 7, 9}, wall);
    Flux flux(w.store, {{-5, 3, 2}, {7, 11, 18}}, night());
    const FluxReport report = solve(flux, {directions, 1e-5f});
    EXPECT_TRUE(report.converged);
    for (uint32_t i = 0; i < flux.grid().surfaces.size(); ++i) {
      const world::Irradiance3 e = flux.irradiance(i);
      // Surfaces outside the room see the dark sky beside one another.
      if (!VoxelBox{{-5, 3, 2}, {7, 11, 18}}.contains(flux.grid().surfaces[i].voxel)) continue;
      EXPECT_NEAR(e.r, 1, 2e-4);
      EXPECT_NEAR(e.g, 1, 2e-4);
      EXPECT_NEAR(e.b, 1, 5e-4);
    }
    expect_books(report, 1e-5);
  }
}

/// Nothing but air and a floor: the floor's irradiance is that of the sky, pi L, for any set of directions.
TEST(Flux, AFloorUnderAnEvenSkyGetsPiTimesItsRadiance) {
  for (const int directions : {6, 8, 32, 128}) {
    World w;
    const BlockId stone = *w.palette->add(matte("slate", 0.3f, 0.3f, 0.3f));
    fill(w, {0, 0, 0}, {31, 0, 31}, stone);
    world::Environment e = night();
    e.sky_zenith = e.sky_horizon = e.sky_ground = {1, 2, 3};
    Flux flux(w.store, {{0, 0, 0}, {31, 15, 31}}, e);
    const FluxReport report = solve(flux, {directions, 1e-4f});
    const uint32_t top = flux.grid().surface({16, 1, 16}, world::kFaceNegY);
    ASSERT_NE(top, UINT32_MAX);
    EXPECT_NEAR(flux.irradiance(top).r, kPi, 1e-5);
    EXPECT_NEAR(flux.irradiance(top).b, 3 * kPi, 3e-5);
    expect_books(report, 1e-5);
  }
}

/// Light through a slab of h voxels of a medium, straight along an axis, is Beer and Lambert's.
TEST(Flux, AlongAnAxisAMediumDimsAsItsExponential) {
  World w;
  const BlockId stone = *w.palette->add(matte("slate", 0.3f, 0.3f, 0.3f));
  world::Block ink = matte("ink", 0.1f, 0.1f, 0.1f);
  ink.opaque = false;
  ink.absorption = {0.5f, 0.01f, 4.0f};
  const BlockId medium = *w.palette->add(ink);
  fill(w, {0, 0, 0}, {15, 0, 15}, stone);
  fill(w, {0, 1, 0}, {15, 5, 15}, medium);
  world::Environment e = night();
  e.sky_zenith = e.sky_horizon = {1, 1, 1};
  Flux flux(w.store, {{0, 0, 0}, {15, 15, 15}}, e);
  const FluxReport report = solve(flux, {6, 1e-4f});
  const uint32_t bottom = flux.grid().surface({8, 1, 8}, world::kFaceNegY);
  EXPECT_NEAR(flux.irradiance(bottom).r, kPi * std::exp(-2.5), 1e-5);
  EXPECT_NEAR(flux.irradiance(bottom).g, kPi * std::exp(-0.05), 1e-5);
  EXPECT_NEAR(flux.irradiance(bottom).b, kPi * std::exp(-20.0), 1e-5);
  expect_books(report, 1e-5);
}

/// A glowing medium's power ends on the walls around it, in it, and nowhere else.
TEST(Flux, WhatAMediumEmitsIsAbsorbedOrEscapes) {
  World w;
  const BlockId wall = *w.palette->add(matte("plaster", 0.6f, 0.6f, 0.6f));
  world::Block glow = matte("glow", 0.1f, 0.1f, 0.1f);
  glow.opaque = false;
  glow.absorption = {0.2f, 0.4f, 0.8f};
  glow.emission = {10, 20, 30};
  const BlockId medium = *w.palette->add(glow);
  room(w, {1, 1, 1}, {14, 14, 14}, wall);
  fill(w, {6, 6, 6}, {9, 9, 9}, medium);
  Flux flux(w.store, {{1, 1, 1}, {14, 14, 14}}, night());
  const FluxReport report = solve(flux, {32, 1e-4f});
  EXPECT_NEAR(report.books.emitted[0], 64 * 10, 1e-3);
  EXPECT_NEAR(report.books.escaped[0], 0, 1e-9);  // the room is shut; outside of it all is dark
  expect_books(report, 1e-5);
}

/// A lamp of one voxel in the open: what passes a sphere around it is its power, so the mean irradiance that faces it
/// falls as 1/r^2. Measured on the open sides of boxes of growing size by what escapes, and on the walls of dark rooms:
/// the mean over a cube's walls of side 2r is P / (24 r^2).
TEST(Flux, ALampsLightThinsWithTheSquareOfTheDistance) {
  for (const int directions : {8, 32, 72, 128}) {
    for (const int radius : {4, 8, 16}) {
      World w;
      const BlockId wall = *w.palette->add(matte("soot", 1e-6f, 1e-6f, 1e-6f));
      world::Block lamp = matte("bulb", 0.5f, 0.5f, 0.5f);
      lamp.emission = {60, 60, 60};
      const BlockId bulb = *w.palette->add(lamp);
      const int side = 2 * radius + 1;
      room(w, {0, 0, 0}, {side, side, side}, wall);
      fill(w, {radius, radius, radius}, {radius, radius, radius}, bulb);
      Flux flux(w.store, {{0, 0, 0}, {side - 1, side - 1, side - 1}}, night());
      solve(flux, {directions, 1e-4f});
      double sum = 0;
      uint64_t count = 0;
      for (uint32_t i = 0; i < flux.grid().surfaces.size(); ++i) {
        const Surface& s = flux.grid().surfaces[i];
        if (s.block != wall || !VoxelBox{{0, 0, 0}, {side - 1, side - 1, side - 1}}.contains(s.voxel)) continue;
        sum += flux.irradiance(i).r, ++count;
      }
      EXPECT_EQ(count, uint64_t{6} * side * side);
      EXPECT_NEAR(sum / count * 6 * side * side, 60, 60 * 1e-4);
    }
  }
}

/// Mirror a scene and its light is mirrored; the same voxels in the same order but for sums of a different order.
TEST(Flux, AMirroredSceneHasMirroredLight) {
  const auto build = [](World& w, bool flip, int axis) {
    const BlockId wall = *w.palette->add(matte("plaster", 0.7f, 0.5f, 0.3f));
    world::Block lamp = matte("bulb", 0.5f, 0.5f, 0.5f);
    lamp.emission = {60, 40, 20};
    const BlockId bulb = *w.palette->add(lamp);
    room(w, {0, 0, 0}, {16, 16, 16}, wall);
    const auto image = [&](VoxelPos v) {
      if (flip) v[axis] = 15 - v[axis];
      return v;
    };
    const VoxelPos p = image({3, 12, 5}), a = image({8, 0, 4}), b = image({10, 9, 6});
    fill(w, p, p, bulb);
    VoxelBox pillar;
    pillar.include(a), pillar.include(b);
    fill(w, pillar.min, pillar.max, wall);
  };
  for (int axis = 0; axis < 3; ++axis) {
    World plain, mirrored;
    build(plain, false, axis), build(mirrored, true, axis);
    Flux one(plain.store, {{0, 0, 0}, {15, 15, 15}}, night()),
        other(mirrored.store, {{0, 0, 0}, {15, 15, 15}}, night());
    solve(one, {32, 1e-5f}), solve(other, {32, 1e-5f});
    double worst = 0, most = 0;
    for (uint32_t i = 0; i < one.grid().surfaces.size(); ++i) {
      Surface s = one.grid().surfaces[i];
      s.voxel[axis] = 15 - s.voxel[axis];
      if (world::face_axis(s.face) == axis) s.face = world::opposite_face(s.face);
      const uint32_t j = other.grid().surface(s.voxel, s.face);
      ASSERT_NE(j, UINT32_MAX);
      worst = std::max(worst, std::abs(double(one.irradiance(i).r) - other.irradiance(j).r));
      most = std::max(most, double(one.irradiance(i).r));
    }
    EXPECT_LT(worst, 1e-5 * most) << axis;
  }
}

/// Two rooms and a door: light that isn't in one is in the other, and less of it the smaller the door.
TEST(Flux, TwoConnectedRoomsShareTheirLight) {
  double before = 0;
  for (const int door : {0, 1, 2, 4}) {
    World w;
    const BlockId wall = *w.palette->add(matte("plaster", 0.8f, 0.8f, 0.8f));
    world::Block lamp = matte("bulb", 0.5f, 0.5f, 0.5f);
    lamp.emission = {60, 60, 60};
    const BlockId bulb = *w.palette->add(lamp);
    room(w, {0, 0, 0}, {10, 8, 10}, wall);
    room(w, {11, 0, 0}, {10, 8, 10}, wall);
    if (door) fill(w, {10, 0, 4}, {10, door, 4 + door}, world::kAir);
    fill(w, {2, 6, 2}, {2, 6, 2}, bulb);
    Flux flux(w.store, {{0, 0, 0}, {20, 7, 9}}, night());
    const FluxReport report = solve(flux, {32, 1e-4f});
    expect_books(report, 1e-5);
    const uint32_t far_floor = flux.grid().surface({17, 0, 5}, world::kFaceNegY);
    const double there = flux.irradiance(far_floor).r;
    if (door == 0) {
      EXPECT_EQ(there, 0);
    } else {
      EXPECT_GT(there, before);
    }
    before = there;
  }
}

World cave() {
  World w;
  const BlockId wall = *w.palette->add(matte("plaster", 0.7f, 0.5f, 0.3f));
  world::Block lamp = matte("bulb", 0.5f, 0.5f, 0.5f);
  lamp.emission = {60, 40, 20};
  const BlockId bulb = *w.palette->add(lamp);
  world::Block pane = matte("pane", 0.1f, 0.1f, 0.1f);
  pane.opaque = false;
  pane.absorption = {0.1f, 1, 3};
  const BlockId glass = *w.palette->add(pane);
  room(w, {-9, -3, 4}, {27, 20, 22}, wall);
  fill(w, {-2, 17, 9}, {4, 17, 14}, glass);
  fill(w, {0, -3, 8}, {2, 10, 12}, wall);
  fill(w, {12, 3, 20}, {12, 3, 20}, bulb);
  return w;
}

TEST(Flux, TheResultHasTheSameBitsForAnyThreadCountAndSimdLevel) {
  const World w = cave();
  const VoxelBox box{{-9, -3, 4}, {17, 16, 25}};
  const world::Environment day;
  for (const int directions : {6, 8, 32, 72}) {
    Flux expected(w.store, box, day);
    const FluxReport report = solve(expected, {directions, 1e-3f});
    expect_books(report, 1e-5);
    const auto compare = [&] {
      Flux other(w.store, box, day);
      EXPECT_EQ(solve(other, {directions, 1e-3f}).sweeps, report.sweeps);
      ASSERT_EQ(other.grid().surfaces.size(), expected.grid().surfaces.size());
      for (uint32_t i = 0; i < other.grid().surfaces.size(); ++i) {
        ASSERT_EQ(other.irradiance(i), expected.irradiance(i)) << i;
        ASSERT_EQ(other.radiosity(i), expected.radiosity(i)) << i;
      }
    };
    for (const int threads : {1, 2, 3, 8}) {
      const world::ThreadLimit limit(threads);
      compare();
    }
    for (const world::SimdLevel& level : world::simd_levels()) {
      const world::SimdChoice choice(level);
      compare();
    }
  }
}

TEST(Flux, WhereNothingChangedNothingIsSwept) {
  const World w = cave();
  const VoxelBox box{{-9, -3, 4}, {17, 16, 25}};
  Flux flux(w.store, box, night());
  const int first = solve(flux, {32, 1e-3f}).sweeps;
  EXPECT_GT(first, 2);
  EXPECT_EQ(solve(flux, {32, 1e-3f}).sweeps, 0);
  EXPECT_EQ(solve(flux, {32, 1e-2f}).sweeps, 0);
  // After an edit elsewhere the old answer is a good start.
  Flux again(w.store, box, night());
  again.continue_from(flux);
  EXPECT_LT(solve(again, {32, 1e-3f}).sweeps, first);
}

/// Conjugate gradients need the square root of the bounces that repeated reflection needs.
TEST(Flux, ResidualsAreReached) {
  const World w = cave();
  Flux flux(w.store, {{-9, -3, 4}, {17, 16, 25}}, night());
  int before = 0;
  for (const float residual : {0.1f, 0.01f, 1e-3f, 1e-4f}) {
    Flux fresh(w.store, {{-9, -3, 4}, {17, 16, 25}}, night());
    const FluxReport report = solve(fresh, {32, residual});
    EXPECT_LE(report.residual, residual);
    EXPECT_TRUE(report.converged);
    EXPECT_GE(report.sweeps, before);
    EXPECT_LT(report.sweeps, 30);
    before = report.sweeps;
  }
}

TEST(Flux, BadKnobsAreUsageErrors) {
  const World w = cave();
  Flux flux(w.store, {{0, 0, 5}, {7, 7, 12}}, night());
  EXPECT_FALSE(flux.solve({31, 0.01f}).ok());
  EXPECT_FALSE(flux.solve({32, 0}).ok());
  EXPECT_FALSE(flux.solve({32, std::nanf("")}).ok());
}

/// Under the middle of a square lamp of side 2a at height c: E = pi L F, with the view factor of four rectangles a x a
/// that meet over the point.
double under_square(double a, double c) {
  const double x = a / c, root = std::sqrt(1 + x * x);
  return kPi * 4 / (2 * kPi) * 2 * x / root * std::atan(x / root);
}

/// The midpoint rule with n points a side misses the integral by a part of the order of (a / (n c))^2.
TEST(Lamps, ASquareOfGlowingBlocksLightsWhatIsBelowByItsViewFactor) {
  for (const int side : {1, 3, 7})
    for (const int height : {4, 9}) {
      World w;
      const BlockId floor = *w.palette->add(matte("slate", 0.3f, 0.3f, 0.3f));
      world::Block lamp = matte("bulb", 0.5f, 0.5f, 0.5f);
      lamp.emission = {static_cast<float>(6 * kPi), 0, static_cast<float>(12 * kPi)};  // L = 1, 0, 2
      const BlockId bulb = *w.palette->add(lamp);
      fill(w, {-20, -1, -20}, {20, -1, 20}, floor);
      const int half = side / 2;
      fill(w, {-half, height, -half}, {half, height, half}, bulb);
      const FluxGrid grid = make_flux_grid(w.store, {{-20, -1, -20}, {20, height + 2, 20}});
      const LampLight light = lamps_on_surfaces(w.store, grid, 16);
      EXPECT_EQ(light.lamps, 6u) << "a rectangle a side of the plate";
      EXPECT_EQ(light.glowing.size(), static_cast<size_t>(2 * side * side + 4 * side));
      const uint32_t below = grid.surface({0, 0, 0}, world::kFaceNegY);
      const double expected = under_square(side / 2.0, height), bound = std::pow(side / 4.0 / height, 2);
      EXPECT_NEAR(light.irradiance[below].r, expected, bound * expected);
      EXPECT_NEAR(light.irradiance[below].b, 2 * expected, bound * 2 * expected);
      EXPECT_EQ(light.irradiance[below].g, 0);
    }
}

TEST(Lamps, AWallHidesThem) {
  World w;
  const BlockId wall = *w.palette->add(matte("slate", 0.3f, 0.3f, 0.3f));
  world::Block lamp = matte("bulb", 0.5f, 0.5f, 0.5f);
  lamp.emission = {60, 60, 60};
  fill(w, {0, -1, 0}, {31, -1, 7}, wall);
  fill(w, {15, 0, 0}, {15, 7, 7}, wall);
  fill(w, {4, 3, 3}, {4, 3, 3}, *w.palette->add(lamp));
  const FluxGrid grid = make_flux_grid(w.store, {{0, -1, 0}, {31, 15, 7}});
  const LampLight light = lamps_on_surfaces(w.store, grid, 4);
  EXPECT_GT(light.irradiance[grid.surface({10, 0, 3}, world::kFaceNegY)].r, 0);
  EXPECT_EQ(light.irradiance[grid.surface({20, 0, 3}, world::kFaceNegY)].r, 0);
}

/// The books hold with light that comes by rays; and the picture that lamps make by rays is that of many directions.
TEST(Flux, LampsByRaysKeepTheBooksAndAgreeWithManyDirections) {
  const World w = cave();
  const VoxelBox box{{-9, -3, 4}, {17, 16, 25}};
  Flux rays(w.store, box, night()), directions(w.store, box, night());
  rays.set_direct({}, lamps_on_surfaces(w.store, rays.grid(), 16));
  const FluxReport by_rays = solve(rays, {512, 1e-4f}), by_directions = solve(directions, {512, 1e-4f});
  expect_books(by_rays, 1e-5);
  expect_books(by_directions, 1e-5);
  // What the lamp sends by rays arrives all but for the midpoint rule next to it.
  EXPECT_NEAR(by_rays.books.emitted[0], by_directions.books.emitted[0], 0.02 * by_directions.books.emitted[0]);
  double difference = 0, sum = 0;
  for (uint32_t i = 0; i < rays.grid().surfaces.size(); ++i) {
    difference += std::abs(double(rays.irradiance(i).r) - directions.irradiance(i).r);
    sum += directions.irradiance(i).r;
  }
  // 512 lobes are wide at the walls of this room: a tenth is what is left of them.
  EXPECT_LT(difference, 0.15 * sum);
}

}  // namespace
}  // namespace sim
