// Particles: the same bits from every path, thread count and place; what hits and what is dropped.
#include "sim/bodies/particles.h"

#include <cmath>

#include "tests/sim/bodies/body_support.h"
#include "world/base/jobs.h"
#include "world/base/random.h"
#include "world/base/simd.h"

namespace sim {
namespace {

using world::Vec3d;
using world::VoxelPos;
using world::World;
using world::WorldPoint;

int kind(const char* name) { return *find_particle_kind(particle_kinds(), name); }

/// Hills of stone with pits of water, from 0 to 63.
void add_hills(World& w, VoxelPos origin = {0, 0, 0}) {
  for (int i = 0; i < 60; ++i) {
    const auto draw = [&](int j, int range) { return int32_t(world::random_bits(7, i, j, 0) % uint64_t(range)); };
    const VoxelPos v = origin + VoxelPos{draw(0, 60), 0, draw(1, 60)};
    fill(w, v, v + VoxelPos{draw(2, 6), draw(3, 12), draw(4, 6)}, i % 5 == 0 ? "water" : "stone");
  }
  fill(w, origin + VoxelPos{0, -2, 0}, origin + VoxelPos{63, -1, 63}, "stone");
}

/// All kinds at once, spawned over the hills, for some ticks.
uint64_t weather(VoxelPos origin, bool plain, int ticks = 150, ParticleReport* sum = nullptr) {
  World w(world::standard_blocks());
  add_hills(w, origin);
  Particles particles(w.store, particle_kinds(), 60000, 3);
  particles.set_origin(origin);
  ParticleSettings settings;
  settings.plain = plain;
  settings.wind = {3, 0, -1};
  for (int t = 0; t < ticks; ++t) {
    for (size_t k = 0; k < particle_kinds().size(); ++k)
      particles.spawn_in(int(k), {origin + VoxelPos{2, 13, 2}, origin + VoxelPos{60, 20, 60}}, 60, {0, -5, 0}, 8,
                         settings);
    const ParticleReport report = particles.step(settings);
    if (sum) sum->born += report.born, sum->ended += report.ended, sum->dropped += report.dropped;
  }
  return particles.content_hash();
}

TEST(Particles, EveryPathEverySimdLevelAndThreadCountGiveTheSameBits) {
  ParticleReport sum;
  const uint64_t expected = weather({0, 0, 0}, true, 150, &sum);
  EXPECT_GT(sum.born, 1000u);
  EXPECT_GT(sum.ended, 1000u);
  EXPECT_EQ(weather({0, 0, 0}, false), expected);
  for (const world::SimdLevel& level : world::simd_levels()) {
    const world::SimdChoice choice(level);
    EXPECT_EQ(weather({0, 0, 0}, false), expected) << level.name;
  }
  for (const int threads : {1, 2, 3, 8}) {
    const world::ThreadLimit limit(threads);
    EXPECT_EQ(weather({0, 0, 0}, false), expected) << threads;
  }
}

TEST(Particles, AreTheSameAtTheWorldsBorder) {
  const uint64_t expected = weather({0, 0, 0}, false);
  for (const int32_t far : {1 << 20, (1 << 30) - 8192, -((1 << 30) - 8192)})
    EXPECT_EQ(weather({far, far / 4 * 3, -far}, false), expected) << far;
}

TEST(Particles, MovingTheOriginByWholeVoxelsChangesNothing) {
  const auto run = [](bool moves) {
    World w(world::standard_blocks());
    add_hills(w);
    Particles particles(w.store, particle_kinds(), 5000, 1);
    ParticleSettings settings;
    particles.spawn_in(kind("spark"), {{10, 13, 10}, {50, 14, 50}}, 3000, Vec3d(0), 5, settings);
    for (int t = 0; t < 60; ++t) {
      if (moves) particles.set_origin({t * 7, -t, t % 5});
      particles.step(settings);
    }
    particles.set_origin({0, 0, 0});
    return particles.content_hash();
  };
  EXPECT_EQ(run(true), run(false));
}

TEST(Particles, RainFallsAtItsTerminalSpeedAndSplashesOnWater) {
  World w(world::standard_blocks());
  fill(w, {-20, -1, -20}, {20, -1, 20}, "water");
  Particles particles(w.store, particle_kinds(), 1000, 1);
  const ParticleSettings settings;
  ASSERT_TRUE(particles.spawn(kind("rain"), WorldPoint::from(0.5, 90, 0.5), Vec3d(0), settings));
  uint64_t born = 0;
  double speed = 0;
  for (int t = 0; t < 1200 && born == 0; ++t) {
    if (particles.size(kind("rain")) == 1) speed = particles.block(particles.blocks(kind("rain"))[0]).velocity[1][0];
    born += particles.step(settings).born;
  }
  EXPECT_NEAR(speed, -6.5, 0.01);
  EXPECT_EQ(born, 3u);
  EXPECT_EQ(particles.size(kind("splash")), 3u);
}

TEST(Particles, NeverEndInSolidVoxelsNorPassBetweenTwoThatShareAnEdge) {
  World w(world::standard_blocks());
  // A closed shell of voxels that touch only along edges, on its diagonal sides.
  for (int x = -8; x <= 8; ++x)
    for (int z = -8; z <= 8; ++z)
      if (std::abs(x) + std::abs(z) == 8) fill(w, {x, -8, z}, {x, 8, z}, "stone");
  fill(w, {-8, -9, -8}, {8, -9, 8}, "stone"), fill(w, {-8, 9, -8}, {8, 9, 8}, "stone");
  Particles particles(w.store, particle_kinds(), 20000, 1);
  ParticleSettings settings;
  settings.gravity = 0;
  particles.spawn_in(kind("spark"), {{-2, -2, -2}, {2, 2, 2}}, 20000, Vec3d(0), 400, settings);
  const world::MaskVolume& solid = w.store.masks(world::MaskKind::solid);
  for (int t = 0; t < 100; ++t) {
    particles.step(settings);
    for (const uint32_t b : particles.blocks(kind("spark"))) {
      const ParticleBlock& block = particles.block(b);
      for (int i = 0; i < block.count; ++i) {
        const VoxelPos v{block.at[0][i] >> 16, block.at[1][i] >> 16, block.at[2][i] >> 16};
        ASSERT_LT(std::abs(v.x) + std::abs(v.z), 8);
        ASSERT_FALSE(solid.test(v));
      }
    }
  }
  EXPECT_GT(particles.size(), 1000u);
}

TEST(Particles, FollowEditsOfTheTerrain) {
  World w(world::standard_blocks());
  add_floor(w);
  Particles particles(w.store, particle_kinds(), 100, 1);
  const ParticleSettings settings;
  particles.step(settings);
  particles.spawn(kind("spark"), WorldPoint::from(0.5, 0.05, 0.5), Vec3d(0), settings);
  for (int t = 0; t < 15; ++t) particles.step(settings);
  ASSERT_EQ(particles.size(), 1u);
  EXPECT_GE(particles.block(particles.blocks(kind("spark"))[0]).at[1][0], 0);
  fill(w, {-64, -3, -64}, {63, -1, 63}, "air");
  for (int t = 0; t < 14; ++t) particles.step(settings);
  EXPECT_LT(particles.block(particles.blocks(kind("spark"))[0]).at[1][0], 0);
}

TEST(Particles, EachIntegratorMovesThemAsItMovesAPoint) {
  World w(world::standard_blocks());
  for (int i = 0; i < kIntegrators; ++i) {
    Particles particles(w.store, particle_kinds(), 10, 1);
    ParticleSettings settings;
    settings.integrator = Integrator(i);
    particles.spawn(kind("rain"), WorldPoint::from(0, 0, 0), {10, 20, 0}, settings);
    Motion<Vec3d> m{Vec3d(0), {10, 20, 0}};
    const double drag = particle_kinds()[size_t(kind("rain"))].drag_per_s;
    for (int t = 0; t < 120; ++t) {
      particles.step(settings);
      m = integrate(settings.integrator, m, 1.0 / 60, [&](Vec3d, Vec3d v) { return Vec3d(0, -9.81, 0) - drag * v; });
    }
    const ParticleBlock& block = particles.block(particles.blocks(kind("rain"))[0]);
    // Each tick rounds the place to 2^-17 m, and the speed to 2^-24 of itself.
    for (int a = 0; a < 3; ++a)
      EXPECT_NEAR(block.at[a][0] / 65536.0, m.position[a], 120 * (0x1p-17 + 20.0 / 60 * 0x1p-20));
  }
}

TEST(ParticleKinds, ErrorsNameTheLineAndTheKey) {
  const auto bad = [](const char* text) {
    const auto read = read_particle_kinds(text, "x.toml");
    return read.ok() ? std::string() : read.error().message;
  };
  EXPECT_NE(bad("[a]\nwhat = \"\"\nlifetime_s = [2, 1]\n").find("x.toml:3"), std::string::npos);
  EXPECT_NE(bad("[a]\nwhat = \"\"\nlifetime_s = [1, 2]\nspawns = \"b\"\n").find("no kind of particles 'b'"),
            std::string::npos);
  EXPECT_NE(bad("[a]\nwhat = \"\"\nlifetime_s = [1, 2]\non_hit = \"slide\"\nspawns = \"a\"\n").find("die by a hit"),
            std::string::npos);
  EXPECT_NE(bad("[a]\nwhat = \"\"\nlifetime_s = [1, 2]\ngravty = 1\n").find("gravity"), std::string::npos);
  EXPECT_EQ(bad("[a]\nwhat = \"\"\nlifetime_s = [1, 2]\n"), "");
}

}  // namespace
}  // namespace sim
