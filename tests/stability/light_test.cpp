// Hard cases CL1, CL2, CL4 to CL6, CL8, CL9 and CL11 to CL13: light as a cellular automaton. CL3, CL7 and CL10 are
// tests/sim/light/flood_cases_test.cpp's.
#include <cmath>
#include <filesystem>
#include <vector>

#include <unistd.h>

#include <gtest/gtest.h>

#include "sim/light/flood.h"
#include "sim/light/flux.h"
#include "tests/sim/light/flux_support.h"
#include "world/base/jobs.h"
#include "world/base/random.h"
#include "world/formats/format.h"
#include "world/world.h"

namespace sim {
namespace {

using world::BlockId;
using world::EditBatch;
using world::kAir;
using world::LightModel;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

uint64_t bits(uint64_t seed, int64_t i, int64_t j = 0) { return world::random_bits(seed, i, j, 3); }

void fill(World& w, VoxelPos min, VoxelPos max, BlockId block) {
  EditBatch batch;
  batch.fill({min, max}, block);
  ASSERT_TRUE(w.store.apply(batch).ok());
}
BlockId named(const World& w, const char* name) { return *w.palette->find(name); }

uint64_t anew(const World& w, LightModel model) {
  FloodLight light(w.store, model);
  light.compute();
  return light.volume().content_hash();
}

/// An edit of a 32^3 box that straddles eight regions: lamps, solids, what dims, and air, as often.
void random_edit(World& w, uint64_t seed, int64_t i) {
  static const char* const kNames[] = {"lamp_warm", "lamp_blue", "stone", "stone", "water", "glass_red", "lantern"};
  VoxelPos v;
  for (int a = 0; a < 3; ++a) v[a] = static_cast<int32_t>(bits(seed, i, a) % 32) - 16;
  const uint64_t what = bits(seed, i, 3) % 14;
  fill(w, v, v, what < 7 ? named(w, kNames[what]) : kAir);
}

TEST(HardCaseCL1, LightAfterTwentyThousandEditsIsAllLightAnew) {
  for (const LightModel model : {LightModel::flood4, LightModel::flood_rgb}) {
    World w(world::standard_blocks());
    FloodLight light(w.store, model);
    const int edits = model == LightModel::flood4 ? 20000 : 5000;
    for (int i = 1; i <= edits; ++i) {
      random_edit(w, 1, i);
      light.update();
      if (i % 500 == 0) {
        ASSERT_EQ(light.volume().content_hash(), anew(w, model)) << i;
      }
    }
  }
}

/// Luanti 2823: a pit of lava across a border of chunks, here of leaves and of regions.
TEST(HardCaseCL2, NoLightStaysWhereLavaAtABorderWas) {
  for (const int32_t border : {48, 128, -128}) {
    World w(world::standard_blocks());
    const BlockId stone = named(w, "stone"), lava = named(w, "lava");
    fill(w, {-8, -8, border - 24}, {24, 24, border + 24}, stone);
    fill(w, {2, 2, border - 10}, {12, 12, border + 10}, kAir);
    fill(w, {4, 1, border - 1}, {5, 1, border}, lava);
    FloodLight light(w.store, LightModel::flood4);
    light.update();
    EXPECT_GT(light.volume().block().get({4, 2, border}), 0);
    fill(w, {4, 1, border - 1}, {5, 1, border}, stone);
    light.update();
    for (int x = -10; x < 26; ++x)
      for (int y = -10; y < 26; ++y)
        for (int z = border - 26; z < border + 26; ++z) ASSERT_EQ(light.volume().block().get({x, y, z}), 0);
  }
}

/// Light is derived, so a save can't hold half of it: what is loaded has the light of what was saved, with edits on the
/// way.
TEST(HardCaseCL4, ASavedAndLoadedWorldHasTheSameLight) {
  const auto path = std::filesystem::temp_directory_path() / ("loam_cl4_" + std::to_string(getpid()) + ".loam");
  World w(world::standard_blocks());
  FloodLight light(w.store, LightModel::flood_rgb);
  for (int i = 0; i < 300; ++i) random_edit(w, 2, i);
  // Some light is found, some isn't yet.
  light.update();
  for (int i = 300; i < 320; ++i) random_edit(w, 2, i);
  ASSERT_TRUE(world::write_world(w, path).ok());
  world::ImportReport read;
  auto loaded = world::read_world(path, {}, read);
  std::filesystem::remove(path);
  ASSERT_TRUE(loaded.ok()) << loaded.error().message;
  light.update();
  EXPECT_EQ(anew(*loaded, LightModel::flood_rgb), light.volume().content_hash());
}

TEST(HardCaseCL5, ALampInTheOpenReachesTheFourThousandCellsOfItsOctahedron) {
  World w(world::standard_blocks());
  fill(w, {-40, -60, -40}, {40, -60, 40}, named(w, "stone"));
  FloodLight light(w.store, LightModel::flood4);
  light.update();
  fill(w, {3, 5, -2}, {3, 5, -2}, named(w, "lantern"));
  const LightReport report = light.update();
  uint64_t lit = 0;
  for (int x = -20; x <= 26; ++x)
    for (int y = -20; y <= 30; ++y)
      for (int z = -26; z <= 20; ++z) lit += light.volume().block().get({x, y, z}) > 0;
  EXPECT_EQ(lit, 4089u);  // sum over r = 0 .. 14 of the octahedron's shells
  // Leaves that hold such cells: those within 14 voxels of the lamp, 5^3 at most; the sky has one more of them.
  EXPECT_LE(report.leaves_changed, 125u);
}

TEST(HardCaseCL6, AnyNumberOfThreadsFindsTheSameLight) {
  World w(world::standard_blocks());
  for (int i = 0; i < 3000; ++i) random_edit(w, 6, i);
  const uint64_t expected = anew(w, LightModel::flood_rgb);
  for (int threads = 1; threads <= 16; ++threads) {
    const world::ThreadLimit limit(threads);
    EXPECT_EQ(anew(w, LightModel::flood_rgb), expected) << threads;
  }
}

/// Levels count steps along axes: a diamond. Along ordinates light goes in lobes, which fill the sphere as they become
/// more: the error on dark walls around a lamp, against the lamp's view factors by rays, falls with the directions to
/// what mixing within voxels leaves, which is more along diagonals than along axes (0.28 here, measured 2026-11-26).
TEST(HardCaseCL8, LevelsAreDiamondsAndFluxBecomesRound) {
  World w(world::standard_blocks());
  fill(w, {0, 0, 0}, {0, 0, 0}, named(w, "lamp_white"));
  FloodLight light(w.store, LightModel::flood4);
  light.update();
  EXPECT_EQ(light.volume().block().get({10, 0, 0}), 5);
  EXPECT_EQ(light.volume().block().get({6, 6, 6}), 0);  // 10.4 voxels away, and dark

  World room(world::standard_blocks());
  const BlockId dark = *room.palette->add(matte("soot", 1e-6f, 1e-6f, 1e-6f));
  fill(room, {-13, -13, -13}, {13, 13, 13}, dark);
  fill(room, {-12, -12, -12}, {12, 12, 12}, kAir);
  fill(room, {0, 0, 0}, {0, 0, 0}, named(room, "lamp_white"));
  const VoxelBox box{{-12, -12, -12}, {12, 12, 12}};
  double before = 1e9;
  for (const int directions : {8, 32, 128, 512}) {
    Flux flux(room.store, box, night());
    const LampLight rays = lamps_on_surfaces(room.store, flux.grid(), 16);
    ASSERT_TRUE(flux.solve({directions, 1e-3f}).ok());
    double error = 0, count = 0;
    for (uint32_t i = 0; i < flux.grid().surfaces.size(); ++i) {
      if (flux.grid().surfaces[i].block != dark || !box.contains(flux.grid().surfaces[i].voxel)) continue;
      const double relative = flux.irradiance(i).r / rays.irradiance[i].r - 1;
      error += relative * relative, ++count;
    }
    error = std::sqrt(error / count);
    std::printf("%d directions: RMS error %.3f\n", directions, error);
    if (directions <= 128) {
      EXPECT_LT(error, before / 2);
    } else {
      EXPECT_NEAR(error, before, 0.1 * before);
    }
    before = error;
  }
  EXPECT_LT(before, 1.0 / 3);
}

TEST(HardCaseCL9, EmissionBeyondTheScaleIsFifteen) {
  for (const float watts : {2999.0f, 3000.0f, 1e5f, 1e30f}) {
    World w(world::standard_blocks());
    world::Block lamp;
    lamp.name = "glare", lamp.emission = {watts, watts, watts};
    fill(w, {0, 0, 0}, {0, 0, 0}, *w.palette->add(lamp));
    FloodLight light(w.store, LightModel::flood4);
    light.update();
    EXPECT_EQ(light.volume().block().get({0, 0, 0}), 15);
    EXPECT_EQ(light.volume().block().get({1, 0, 0}), 14);
  }
}

World shut_room(float albedo) {
  World w(world::standard_blocks());
  world::Block lamp = matte("bulb", albedo, albedo, albedo);
  lamp.emission = {60, 60, 60};
  fill(w, {-1, -1, -1}, {16, 16, 16}, *w.palette->add(matte("wall", albedo, albedo, albedo)));
  fill(w, {0, 0, 0}, {15, 15, 15}, kAir);
  fill(w, {4, 9, 5}, {4, 9, 5}, *w.palette->add(lamp));
  return w;
}

TEST(HardCaseCL11, TheResidualIsReachedInSweepsThatGrowWithItsLogarithm) {
  const World w = shut_room(0.8f);
  int before = 0;
  for (const float residual : {0.1f, 1e-2f, 1e-3f, 1e-4f}) {
    Flux flux(w.store, {{0, 0, 0}, {15, 15, 15}}, night());
    const auto report = flux.solve({32, residual});
    ASSERT_TRUE(report.ok());
    EXPECT_LE(report->residual, residual);
    EXPECT_GE(report->sweeps, before);
    // Conjugate gradients gain a factor of (root k - 1) / (root k + 1) a step at worst, k = (1 + rho) / (1 - rho) = 9:
    // a half. A tenfold residual takes 3.3 steps; one more for what surfaces that glow make of the first.
    if (before) {
      EXPECT_LE(report->sweeps, before + 5);
    }
    before = report->sweeps;
  }
}

/// Nearly nothing is lost: the light grows to a million times the lamp's, or the cap on sweeps ends it and says so.
TEST(HardCaseCL12, WithAlbedoOneTheEnergyIsBoundedAndTheCapIsSaid) {
  const World w = shut_room(1 - 1e-6f);
  Flux flux(w.store, {{0, 0, 0}, {15, 15, 15}}, night());
  FluxKnobs knobs{32, 1e-7f, 12};
  const auto report = flux.solve(knobs);
  ASSERT_TRUE(report.ok());
  EXPECT_LE(report->sweeps, 12);
  EXPECT_FALSE(report->converged);
  for (uint32_t i = 0; i < flux.grid().surfaces.size(); ++i) {
    const float e = flux.irradiance(i).r;
    ASSERT_TRUE(std::isfinite(e));
    // In the limit all walls have B = P / (area (1 - rho)).
    ASSERT_LE(e, 60 / 1e-6f);
  }
}

TEST(HardCaseCL13, AStormOfEditsLosesNone) {
  World w(world::standard_blocks());
  FloodLight light(w.store, LightModel::flood4);
  constexpr int kBatches = 500, kEditsABatch = 2000;  // a million edits
  for (int b = 0; b < kBatches; ++b) {
    EditBatch batch;
    for (int i = 0; i < kEditsABatch; ++i) {
      const uint64_t h = bits(13, b, i);
      const VoxelPos v{static_cast<int32_t>(h & 31) - 16, static_cast<int32_t>(h >> 5 & 31) - 16,
                       static_cast<int32_t>(h >> 10 & 31) - 16};
      const uint64_t what = h >> 20 & 7;
      batch.set(v, what == 0 ? named(w, "lamp_warm") : what < 4 ? named(w, "stone") : kAir);
    }
    ASSERT_TRUE(w.store.apply(batch).ok());
    if (b % 7 == 0) light.update();  // the light comes after as it can
  }
  light.update();
  EXPECT_EQ(light.volume().content_hash(), anew(w, LightModel::flood4));
  EXPECT_EQ(light.update().leaves_computed, 0u);
}

}  // namespace
}  // namespace sim
