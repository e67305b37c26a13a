// Hard cases P1 to P18: bodies and particles. Bounds are those of the catalogue unless a comment says more; most are
// exact here, because bodies are integers.
#include <algorithm>
#include <cmath>

#include "sim/bodies/particles.h"
#include "sim/bodies/player.h"
#include "sim/bodies/sweep.h"
#include "tests/sim/bodies/body_support.h"
#include "world/base/random.h"

namespace sim {
namespace {

using world::Vec3d;
using world::VoxelPos;
using world::World;
using world::WorldPoint;

constexpr int32_t kFar = (1 << 30) - 8192;
const VoxelPos kPlaces[] = {{0, 0, 0}, {10'000'000, 0, -10'000'000}, {kFar, kFar / 8 * 7, -kFar}};

WorldPoint at(VoxelPos origin, double x, double y, double z) {
  WorldPoint p = WorldPoint::from(x, y, z);
  p.voxel = p.voxel + origin;
  return p;
}
BodyDescription smooth_at(VoxelPos origin, double x, double y, double z, Vec3d size = {1, 1, 1}) {
  BodyDescription d = smooth_box(0, 0, 0, size);
  d.foot = at(origin, x, y, z);
  return d;
}

/// 1e-4 m above the ground a body is above it, at any distance, and what comes down to it never passes.
TEST(HardCaseP1, WhatIsAboveTheGroundIsNeverFoundUnderneath) {
  for (const int32_t height : {0, 100, 1000, 10'000, 1'000'000, kFar}) {
    World w(world::standard_blocks());
    const VoxelPos origin{kFar, height, -kFar};
    add_floor(w, origin);
    BodyTerrain terrain(w.store);
    terrain.refresh();
    const int64_t ground = int64_t{height} * kFixedOne;
    BodyBox box{fixed_from(at(origin, 0.2, 1e-4, 0.2)), {kFixedOne, kFixedOne, kFixedOne}};
    ASSERT_GT(box.min.y, ground);
    EXPECT_FALSE(terrain.overlaps(box));
    for (int i = 0; i < 1000; ++i) {
      BodyBox start = box;
      FixedVec3 d;
      for (int a = 0; a < 3; ++a) {
        const auto draw = [&](uint64_t stream) {
          return 2 * world::uniform01_double(world::random_bits(1, i, a, 0, 0, stream)) - 1;
        };
        start.min[a] += a == 1 ? fixed_from(0.5 + 0.5 * draw(0)) : fixed_from(10 * draw(0));
        d[a] = a == 1 ? -fixed_from(1 + draw(1)) : fixed_from(10 * draw(1));
      }
      const SweepHit hit = sweep(start, d, terrain);
      EXPECT_GE(moved(start, hit.part_of(d)).min.y, ground);
      if (d.y < ground - start.min.y) {
        EXPECT_EQ(moved(start, hit.part_of(d)).min.y, ground);
      }
    }
  }
}

TEST(HardCaseP2, AFaceStaysWhereItIsForAMillionTicks) {
  World w(world::standard_blocks());
  const VoxelPos origin = kPlaces[2];
  add_floor(w, origin);
  Bodies bodies(w.store);
  const BodyId id = *bodies.add(smooth_at(origin, 0.3, 0, 0.7, {0.6, 1.8, 0.6}));
  const BodyBox before = bodies.find(id)->box;
  for (int i = 0; i < 1'000'000; ++i) {
    // Kept awake: asleep nothing would be shown.
    if (i % 16 == 0) bodies.set_velocity(id, {0, -1e-3, 0});
    bodies.step({});
    ASSERT_EQ(bodies.find(id)->box, before);
  }
}

TEST(HardCaseP3, SavingAndLoadingAThousandTimesMovesNothing) {
  World w(world::standard_blocks());
  const VoxelPos origin = kPlaces[2];
  add_floor(w, origin);
  fill(w, origin + VoxelPos{-1, 0, -1}, origin + VoxelPos{-1, 2, 3}, "stone");
  fill(w, origin + VoxelPos{-1, 0, -1}, origin + VoxelPos{3, 2, -1}, "stone");
  Bodies bodies(w.store);
  // Thrown into a corner, so that it touches three faces.
  BodyDescription d = smooth_at(origin, 1.23, 0.4, 1.37, {0.6, 1.8, 0.6});
  d.velocity = {-9, 0, -7};
  const BodyId id = *bodies.add(d);
  for (int i = 0; i < 20; ++i) bodies.step({});
  const Body before = *bodies.find(id);
  ASSERT_EQ(before.box.min, fixed_from(at(origin, 0, 0, 0)));
  const uint64_t hash = bodies.content_hash();
  for (int i = 0; i < 1000; ++i) {
    Bodies loaded(w.store);
    ASSERT_TRUE(loaded.restore(bodies.bytes()).ok());
    ASSERT_TRUE(bodies.restore(loaded.bytes()).ok());
  }
  EXPECT_EQ(bodies.content_hash(), hash);
  EXPECT_EQ(bodies.find(id)->box, before.box);
  bodies.step({});
  EXPECT_EQ(bodies.find(id)->box, before.box);
}

TEST(HardCaseP4, NothingTunnelsThroughAWallOfAMetre) {
  World w(world::standard_blocks());
  fill(w, {200, -20, -20}, {200, 20, 20}, "stone");
  BodySettings settings;
  settings.gravity = 0;
  for (const double speed : {10.0, 74.0, 76.0, 100.0, 1e3, 3333.3, 1e4}) {
    Bodies bodies(w.store);
    BodyDescription d = smooth_box(0, 0, 0, {0.25, 0.25, 0.25});
    d.velocity = {speed, 0, 0};
    const BodyId id = *bodies.add(d);
    const int ticks = static_cast<int>(200 / speed * 60) + 3;
    for (int i = 0; i < ticks; ++i) bodies.step(settings);
    EXPECT_EQ(bodies.find(id)->box.max(0), 200 * kFixedOne) << speed;
    EXPECT_EQ(bodies.find(id)->velocity, FixedVec3{}) << speed;
    // The time of impact, as a fraction of integers.
    BodyTerrain terrain(w.store);
    terrain.refresh();
    const BodyBox box{{190 * kFixedOne + 12345, 0, 0}, {kFixedOne / 4, kFixedOne / 4, kFixedOne / 4}};
    const FixedVec3 way{fixed_from(std::max(speed / 60, 11.0)), 77, -1234};
    const SweepHit hit = sweep(box, way, terrain);
    EXPECT_NEAR(hit.time(), double(200 * kFixedOne - box.max(0)) / double(way.x), 1e-15) << speed;
  }
}

TEST(HardCaseP5, NothingSticksOnEdgesInsideAFloor) {
  for (const VoxelPos origin : kPlaces)
    for (int i = 0; i < kIntegrators; ++i) {
      World w(world::standard_blocks());
      add_floor(w, origin);
      Bodies bodies(w.store);
      BodyDescription d = smooth_at(origin, -55, 0, 0.37);
      d.velocity = {10, 0, 0.01};
      const BodyId id = *bodies.add(d);
      BodySettings settings;
      settings.integrator = Integrator(i);
      for (int t = 0; t < 600; ++t) {
        bodies.step(settings);
        ASSERT_EQ(bodies.find(id)->box.min.y, int64_t{origin.y} * kFixedOne);
        ASSERT_EQ(bodies.find(id)->velocity.x, 10 * kFixedOne);
      }
      // 600 parts of a sixth of a metre, each rounded by 2^-33 m at most.
      EXPECT_NEAR(low_corner(*bodies.find(id), origin).x, -55.5 + 100, 600 * 0x1p-33 + 1e-13);
    }
}

TEST(HardCaseP6, ACornerMetExactlyIsDecidedTheSameEachTimeAndGivesNoEnergy) {
  for (const VoxelPos origin : kPlaces)
    for (const double e : {0.0, 1.0}) {
      World w(world::standard_blocks());
      fill(w, origin + VoxelPos{4, 0, 4}, origin + VoxelPos{4, 3, 4}, "stone");
      BodySettings settings;
      settings.gravity = 0;
      Bodies bodies(w.store);
      BodyDescription d = smooth_at(origin, 0.5, 0, 0.5);
      d.velocity = {6, 0, 6}, d.restitution = e;
      const BodyId id = *bodies.add(d);
      for (int t = 0; t < 120; ++t) bodies.step(settings);
      // x is crossed before z: z stops or turns, x goes on.
      const FixedVec3 v = bodies.find(id)->velocity;
      EXPECT_EQ(v.x, 6 * kFixedOne);
      EXPECT_EQ(v.z, e == 0 ? 0 : -6 * kFixedOne);
    }
}

TEST(HardCaseP7, ABoxAtRestSleepsWithin120TicksAndStaysBitForBit) {
  for (const VoxelPos origin : kPlaces)
    for (int i = 0; i < kIntegrators; ++i) {
      World w(world::standard_blocks());
      add_floor(w, origin);
      Bodies bodies(w.store);
      BodyDescription d = smooth_at(origin, 0.1, 1, 0.2);
      d.restitution = 0.5, d.friction = 0.5;
      const BodyId id = *bodies.add(d);
      BodySettings settings;
      settings.integrator = Integrator(i);
      int slept = 0;
      while (bodies.find(id)->state != BodyState::asleep && ++slept < 1000) bodies.step(settings);
      EXPECT_LE(slept, 120) << i;
      const uint64_t box = static_cast<uint64_t>(bodies.find(id)->box.min.y);
      for (int t = 0; t < 100'000; ++t) bodies.step(settings);
      EXPECT_EQ(static_cast<uint64_t>(bodies.find(id)->box.min.y), box);
      EXPECT_EQ(bodies.find(id)->box.min.y, int64_t{origin.y} * kFixedOne);
    }
}

/// Ticks until all sleep, and where each lies then, from the origin.
std::pair<int, std::vector<FixedVec3>> settle(Bodies& bodies, VoxelPos origin) {
  int ticks = 0;
  const auto awake = [](const Body& b) { return b.state != BodyState::asleep; };
  while (std::any_of(bodies.all().begin(), bodies.all().end(), awake) && ++ticks < 2000) bodies.step({});
  std::vector<FixedVec3> places;
  for (const Body& b : bodies.all()) places.push_back(b.box.min - fixed_from(WorldPoint{origin, Vec3d(0)}));
  return {ticks, places};
}

TEST(HardCaseP8, StacksAndPyramidsSettleTheSameEverywhere) {
  std::vector<std::pair<int, std::vector<FixedVec3>>> stacks, pyramids;
  for (const VoxelPos origin : kPlaces) {
    World w(world::standard_blocks());
    add_floor(w, origin);
    Bodies stack(w.store), pyramid(w.store);
    for (int i = 0; i < 10; ++i) {
      BodyDescription d = smooth_at(origin, 0.03 * (i % 3), 1.3 * i + 0.1, 0);
      d.friction = 0.6, d.restitution = 0.1;
      ASSERT_TRUE(stack.add(d).ok());
    }
    for (int row = 0; row < 9; ++row)
      for (int i = 0; i < 9 - row; ++i) {
        BodyDescription d = smooth_at(origin, 1.1 * i + 0.55 * row, 1.2 * row + 0.05, 10.5);
        d.friction = 0.6;
        ASSERT_TRUE(pyramid.add(d).ok());
      }
    stacks.push_back(settle(stack, origin));
    pyramids.push_back(settle(pyramid, origin));
  }
  EXPECT_LT(stacks[0].first, 2000);
  EXPECT_LT(pyramids[0].first, 2000);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(stacks[0].second[static_cast<size_t>(i)].y, i * kFixedOne);
  size_t body = 0;
  for (int row = 0; row < 9; ++row)
    for (int i = 0; i < 9 - row; ++i) EXPECT_EQ(pyramids[0].second[body++].y, row * kFixedOne);
  for (size_t i = 1; i < stacks.size(); ++i) {
    EXPECT_EQ(stacks[i], stacks[0]);
    EXPECT_EQ(pyramids[i], pyramids[0]);
  }
}

/// Bounds: an explicit step multiplies the energy by 1 + (w dt)^2; the others as the catalogue has them.
TEST(HardCaseP9, TheEnergyOfAnOscillatorDriftsAsEachMethodMust) {
  constexpr double dt = 1.0 / 60;
  constexpr int kSteps = 60000;
  const auto energy = [](const Motion<double>& m) { return (m.position * m.position + m.velocity * m.velocity) / 2; };
  for (int i = 0; i < kIntegrators; ++i) {
    Motion<double> m{1, 0};
    double worst = 0;
    for (int n = 0; n < kSteps; ++n) {
      m = integrate(Integrator(i), m, dt, [](double x, double) { return -x; });
      worst = std::max(worst, std::abs(energy(m) / 0.5 - 1));
    }
    switch (Integrator(i)) {
      case Integrator::explicit_euler:
        EXPECT_NEAR(std::log(energy(m) / 0.5), kSteps * std::log1p(dt * dt), 1e-9);
        break;
      case Integrator::symplectic_euler:
        EXPECT_LE(worst, dt);
        break;
      case Integrator::velocity_verlet:
        EXPECT_LE(worst, dt * dt);
        break;
      case Integrator::runge_kutta_4:
        EXPECT_LE(worst, kSteps * std::pow(dt, 6) / 72 * 1.01);
        break;
    }
  }
}

TEST(HardCaseP10, AProjectileErrsAsPredicted) {
  constexpr double g = 9.81, v = 20, t = 2;
  for (const int rate : {60, 240}) {
    const double dt = 1.0 / rate;
    const auto end = [&](Integrator integrator) {
      Motion<double> m{0, v};
      for (int i = 0; i < rate * 2; ++i) m = integrate(integrator, m, dt, [](double, double) { return -g; });
      return m.position - (v * t - g * t * t / 2);
    };
    EXPECT_NEAR(end(Integrator::symplectic_euler), -g * t * dt / 2, 1e-12);
    EXPECT_NEAR(end(Integrator::explicit_euler), g * t * dt / 2, 1e-12);
    EXPECT_NEAR(end(Integrator::velocity_verlet), 0, 1e-12);
    EXPECT_NEAR(end(Integrator::runge_kutta_4), 0, 1e-12);
    // A body is that, rounded each tick to 2^-33 m and 2^-33 m/s.
    World w(world::standard_blocks());
    Bodies bodies(w.store);
    BodyDescription d = smooth_box(0, 0, 0);
    d.velocity = {0, v, 0};
    const BodyId id = *bodies.add(d);
    BodySettings settings;
    settings.integrator = Integrator::symplectic_euler, settings.tick = {1, rate};
    for (int i = 0; i < rate * 2; ++i) bodies.step(settings);
    EXPECT_NEAR(low_corner(*bodies.find(id)).y, v * t - g * t * t / 2 - g * t * dt / 2, rate * 2 * 0x1p-33 * (1 + t));
  }
}

TEST(HardCaseP11, AStiffSpringIsBoundedBelowTwoAndSubstepsKeepItThere) {
  const auto furthest = [](double w_dt, int parts) {
    Motion<double> m{1, 0};
    double most = 0;
    for (int i = 0; i < 2000 * parts; ++i) {
      m = integrate(Integrator::symplectic_euler, m, 1.0 / parts, [&](double x, double) { return -w_dt * w_dt * x; });
      most = std::max(most, std::abs(m.position));
    }
    return most;
  };
  // The conserved x^2 + v^2 / w^2 - dt x v bounds x by 1 / sqrt(1 - (w dt / 2)^2).
  EXPECT_LE(furthest(1.9, 1), 1 / std::sqrt(1 - 0.95 * 0.95) + 1e-9);
  EXPECT_GE(furthest(2.1, 1), 1e100);
  for (const double w_dt : {1.9, 2.0, 2.1, 50.0}) {
    const int parts = stable_substeps(w_dt, 1, 1);
    EXPECT_LE(w_dt / parts, 1);
    EXPECT_LE(furthest(w_dt, parts), 1 / std::sqrt(1 - 0.25) + 1e-9);
  }
  // Something light thrown into water: its drag would break any of these methods at a part a tick.
  World w(world::standard_blocks());
  fill(w, {-8, -10, -8}, {8, -1, 8}, "water");
  for (int i = 0; i < kIntegrators; ++i) {
    Bodies bodies(w.store);
    BodyDescription d = smooth_box(0, 0.5, 0, {0.2, 0.2, 0.2});
    d.density = 20, d.drag_coefficient = 1, d.velocity = {0, -60, 0};
    const BodyId id = *bodies.add(d);
    BodySettings settings;
    settings.integrator = Integrator(i);
    double fastest = 0;
    for (int t = 0; t < 600; ++t) {
      bodies.step(settings);
      if (t > 1) fastest = std::max(fastest, std::abs(from_fixed(bodies.find(id)->velocity).y));
    }
    EXPECT_LT(fastest, 60) << i;
    // explicit_euler goes on feeding what bobs, which the surface bounds: it hops by less than its own height.
    const double bound = Integrator(i) == Integrator::explicit_euler ? 0.2 : 0.01;
    EXPECT_NEAR(low_corner(*bodies.find(id)).y, -0.2 * 20 / 998, bound) << i;
  }
}

TEST(HardCaseP12, WhatStartsInAWallComesOutSlowlyOrIsStuck) {
  World w(world::standard_blocks());
  fill(w, {-10, -10, -10}, {10, -1, 10}, "stone");
  Bodies bodies(w.store);
  const BodyId deep = *bodies.add(smooth_box(0, -6, 0));
  const BodyId sunk = *bodies.add(smooth_box(4, -0.4, 0));
  const BodyId stuck = *bodies.add(smooth_box(0.5, -5.5, 6, {0.5, 0.5, 0.5}));
  BodyDescription thrown = smooth_box(-10.3, -5, 0);
  thrown.velocity = {3, 1, 2};
  const BodyId side = *bodies.add(thrown);
  for (int t = 0; t < 100; ++t) {
    std::vector<FixedVec3> before;
    for (const Body& b : bodies.all()) before.push_back(b.box.min);
    const BodyReport report = bodies.step({});
    if (t == 0) {
      EXPECT_EQ(report.stuck, 2u);
      EXPECT_EQ(report.pushed, 2u);
    }
    for (size_t i = 0; i < before.size() && t == 0; ++i)
      for (int a = 0; a < 3; ++a) EXPECT_LE(std::abs(bodies.all()[i].box.min[a] - before[i][a]), kFixedOne);
  }
  EXPECT_EQ(bodies.find(deep)->state, BodyState::stuck);
  EXPECT_EQ(bodies.find(stuck)->state, BodyState::stuck);
  EXPECT_EQ(bodies.find(stuck)->velocity, FixedVec3{});
  EXPECT_EQ(bodies.find(sunk)->box.min.y, 0);
  // Pushed out to the side, it fell from there.
  EXPECT_LE(bodies.find(side)->box.max(0), -10 * kFixedOne);
}

TEST(HardCaseP13, AVoxelThatAppearsInABodyIsAWallThatItStartsIn) {
  World w(world::standard_blocks());
  add_floor(w);
  Bodies bodies(w.store);
  const BodyId id = *bodies.add(smooth_box(0.5, 0, 0.5, {0.6, 1.8, 0.6}));
  for (int t = 0; t < 60; ++t) bodies.step({});
  ASSERT_EQ(bodies.find(id)->state, BodyState::asleep);
  fill(w, {0, 0, 0}, {0, 0, 0}, "stone");
  for (int t = 0; t < 60; ++t) bodies.step({});
  BodyTerrain terrain(w.store);
  terrain.refresh();
  EXPECT_FALSE(terrain.overlaps(bodies.find(id)->box));
  // Buried whole, it is stuck; dug out, it is free again.
  fill(w, {-4, 0, -4}, {4, 4, 4}, "stone");
  for (int t = 0; t < 60; ++t) bodies.step({});
  EXPECT_EQ(bodies.find(id)->state, BodyState::stuck);
  fill(w, {-4, 0, -4}, {4, 4, 4}, "air");
  for (int t = 0; t < 120; ++t) bodies.step({});
  EXPECT_EQ(bodies.find(id)->state, BodyState::asleep);
  EXPECT_EQ(bodies.find(id)->box.min.y, 0);
}

TEST(HardCaseP14, BodiesWaitForTerrainThatIsNotLoaded) {
  World w(world::standard_blocks());
  // The ground goes on in a region that isn't there.
  fill(w, {100, -1, 0}, {127, -1, 20}, "stone");
  Bodies bodies(w.store);
  bodies.set_unloaded({1, 0, 0}, true), bodies.set_unloaded({1, -1, 0}, true);
  BodyDescription d = smooth_box(120, 0, 10);
  d.velocity = {5, 0, 0};
  const BodyId id = *bodies.add(d);
  uint64_t frozen = 0;
  for (int t = 0; t < 600; ++t) {
    frozen += bodies.step({}).frozen;
    ASSERT_EQ(bodies.find(id)->box.min.y, 0);
  }
  EXPECT_GT(frozen, 400u);
  EXPECT_LE(bodies.find(id)->box.max(0), 128 * kFixedOne);
  fill(w, {128, -1, 0}, {160, -1, 20}, "stone");
  bodies.set_unloaded({1, 0, 0}, false), bodies.set_unloaded({1, -1, 0}, false);
  for (int t = 0; t < 60; ++t) bodies.step({});
  EXPECT_EQ(bodies.find(id)->velocity.x, 5 * kFixedOne);
  EXPECT_EQ(bodies.find(id)->box.min.y, 0);
  EXPECT_GT(low_corner(*bodies.find(id)).x, 130);
}

/// Bodies don't turn: what turns beside them is a phase, a whole number of ticks by a fraction of a period, of which a
/// million turns lose nothing.
TEST(HardCaseP15, AMillionTurnsLoseNothing) {
  for (uint64_t n = 0; n <= 1'000'000; n += 9973) {
    const double turn = phase_at(n * 7, {7 * 13, 60 * 13});
    const double angle = 2 * 3.14159265358979323846 * turn;
    EXPECT_NEAR(turn, double(n * 7 % 7) / 7, 1e-15);
    EXPECT_NEAR(std::cos(angle) * std::cos(angle) + std::sin(angle) * std::sin(angle), 1, 1e-6);
  }
  EXPECT_EQ(phase_at(1'000'000 * 7 + 3, {7, 60}), 3.0 / 7);
}

TEST(HardCaseP16, ABodyThatIsNotANumberTouchesNoOther) {
  const auto run = [](int what) {
    World w(world::standard_blocks());
    add_floor(w);
    Bodies bodies(w.store);
    std::vector<BodyId> ids;
    for (int i = 0; i < 8; ++i) ids.push_back(*bodies.add(smooth_box(0.2 * i, 1.5 * i, 0)));
    const BodyId odd = *bodies.add(smooth_box(20, 5, 20));
    const double nan = std::nan("");
    if (what == 1) bodies.set_velocity(odd, {0, nan, 0});
    if (what == 2) bodies.set_drive(odd, {INFINITY, 0, 0});
    if (what == 3) bodies.set_velocity(ids[7], {1, 0, 0});  // the control: a change that must show
    if (what == 0) bodies.set_velocity(odd, {nan, nan, nan});
    uint64_t quarantined = 0;
    for (int t = 0; t < 200; ++t) quarantined = bodies.step({}).quarantined;
    EXPECT_EQ(quarantined, what == 3 ? 0u : 1u);
    uint64_t hash = 0;
    for (const BodyId id : ids)
      for (int a = 0; a < 3; ++a)
        hash = world::hash_combine(hash,
                                   static_cast<uint64_t>(bodies.find(id)->box.min[a] ^ bodies.find(id)->velocity[a]));
    return hash;
  };
  const uint64_t expected = run(0);
  EXPECT_EQ(run(1), expected);
  EXPECT_EQ(run(2), expected);
  EXPECT_NE(run(3), expected);
}

TEST(HardCaseP17, AtTheLimitTheOldestOfTheLeastPriorityGoAndNothingIsAllocated) {
  World w(world::standard_blocks());
  const auto kinds = particle_kinds();
  const int rain = *find_particle_kind(kinds, "rain"), splash = *find_particle_kind(kinds, "splash"),
            spark = *find_particle_kind(kinds, "spark");
  constexpr size_t kLimit = 10000;
  Particles particles(w.store, kinds, kLimit, 1);
  const ParticleSettings settings;
  const size_t bytes = particles.bytes();
  particles.spawn_in(splash, {{0, 0, 0}, {9, 9, 9}}, 4000, Vec3d(0), 0, settings);
  particles.spawn_in(rain, {{0, 50, 0}, {9, 90, 9}}, 6000, Vec3d(0), 0, settings);
  EXPECT_EQ(particles.size(), kLimit);
  const auto first = [&](int kind) { return particles.block(particles.blocks(kind)[0]).at[0][0]; };
  const int32_t first_rain = first(rain);
  // One too many: a splash goes; then all of them; then the oldest rain.
  EXPECT_TRUE(particles.spawn(rain, WorldPoint::from(0, 50, 0), Vec3d(0), settings));
  EXPECT_EQ(particles.size(splash), 3999u);
  particles.spawn_in(spark, {{0, 0, 0}, {9, 9, 9}}, 3999, Vec3d(0), 0, settings);
  EXPECT_EQ(particles.size(splash), 0u);
  EXPECT_EQ(first(rain), first_rain);
  EXPECT_TRUE(particles.spawn(spark, WorldPoint::from(0, 0, 0), Vec3d(0), settings));
  EXPECT_EQ(particles.size(rain), 6000u);
  EXPECT_NE(first(rain), first_rain);
  // Nothing is below a splash.
  EXPECT_FALSE(particles.spawn(splash, WorldPoint::from(0, 0, 0), Vec3d(0), settings));
  EXPECT_EQ(particles.size(), kLimit);
  const ParticleReport report = particles.step(settings);
  EXPECT_EQ(report.dropped, 4001u);
  EXPECT_EQ(report.refused, 1u);
  for (int t = 0; t < 300; ++t) {
    particles.spawn_in(spark, {{0, 0, 0}, {9, 9, 9}}, 500, Vec3d(0), 3, settings);
    particles.step(settings);
    ASSERT_LE(particles.size(), kLimit);
    ASSERT_EQ(particles.bytes(), bytes);
  }
}

TEST(HardCaseP18, BodiesInOnePlaceSettleByTheirIdsAlone) {
  // The same bodies, come to be in two ways: in order, and with others between that are gone again.
  const auto run = [](bool holes, VoxelPos origin) {
    World w(world::standard_blocks());
    add_floor(w, origin);
    Bodies bodies(w.store);
    for (int i = 0; i < 12; ++i) EXPECT_TRUE(bodies.add(smooth_at(origin, 0.5, 0.25 * (i % 3), 0.5)).ok());
    if (holes) {
      // Through bytes and back: another order of memory.
      Bodies copy(w.store);
      EXPECT_TRUE(copy.restore(bodies.bytes()).ok());
      EXPECT_TRUE(bodies.restore(copy.bytes()).ok());
    }
    const auto settled = settle(bodies, origin);
    for (const Body& a : bodies.all())
      for (const Body& b : bodies.all()) EXPECT_FALSE(a.id < b.id && overlap(a.box, b.box)) << a.id << " in " << b.id;
    return settled;
  };
  const auto expected = run(false, kPlaces[0]);
  EXPECT_LT(expected.first, 2000);
  // The first of them had its place, and keeps it.
  EXPECT_EQ(expected.second[0], (FixedVec3{0, 0, 0}));
  EXPECT_EQ(run(true, kPlaces[0]), expected);
  EXPECT_EQ(run(false, kPlaces[2]), expected);
}

}  // namespace
}  // namespace sim
