// Bodies: forces, contacts, water, players, what is saved.
#include "sim/bodies/bodies.h"

#include <cmath>
#include <vector>

#include "sim/bodies/player.h"
#include "tests/sim/bodies/body_support.h"
#include "world/base/jobs.h"
#include "world/base/random.h"

namespace sim {
namespace {

using world::Vec3d;
using world::VoxelPos;
using world::World;
using world::WorldPoint;

TEST(Bodies, FallAsTheIntegratorSays) {
  World w(world::standard_blocks());
  Bodies bodies(w.store);
  const BodyId id = *bodies.add(smooth_box(0, 1000, 0));
  for (int i = 0; i < 120; ++i) bodies.step({});
  // Verlet is exact under constant forces; each tick rounds by 2^-33 of a voxel, and its velocity by as much a second.
  const double rounding = 120 * 0x1p-33 * (1 + 120 / 60.0);
  EXPECT_NEAR(low_corner(*bodies.find(id)).y, 1000 - 9.81 * 2, rounding);
  EXPECT_NEAR(from_fixed(bodies.find(id)->velocity).y, -9.81 * 2, 120 * 0x1p-33);
}

TEST(Bodies, DragEndsAtTheTerminalSpeed) {
  World w(world::standard_blocks());
  Bodies bodies(w.store);
  BodyDescription d = smooth_box(0, 100000, 0);
  d.drag_coefficient = 1, d.density = 20;
  const BodyId id = *bodies.add(d);
  for (int i = 0; i < 1200; ++i) bodies.step({});
  // m g = rho / 2 * c * A * v^2, with 1 m^2 and 20 kg.
  EXPECT_NEAR(from_fixed(bodies.find(id)->velocity).y, -std::sqrt(2 * 20 * 9.81 / kAirDensity), 1e-6);
}

TEST(Bodies, FloatWhereTheyDisplaceTheirWeight) {
  World w(world::standard_blocks());
  fill(w, {-8, -10, -8}, {8, -1, 8}, "water");
  const double water = (*w.palette)[*w.palette->find("water")].density.value;
  for (const Integrator integrator :
       {Integrator::symplectic_euler, Integrator::velocity_verlet, Integrator::runge_kutta_4}) {
    BodySettings settings;
    settings.integrator = integrator;
    Bodies bodies(w.store);
    BodyDescription d = smooth_box(0, 2, 0);
    d.drag_coefficient = 1, d.density = 600;
    const BodyId wood = *bodies.add(d);
    d.foot = WorldPoint::from(4, 2, 0), d.density = 2500;
    const BodyId stone = *bodies.add(d);
    for (int i = 0; i < 3000; ++i) bodies.step(settings);
    // It lies as deep as water of its weight, but for the rest of an oscillation that stayed below kCalmSpeed around
    // its turning point for kSleepTicks. Half of the water that it displaces moves with it.
    const double omega = std::sqrt(9.81 * water / (600 * 1.5));
    const double rest = kCalmSpeed / (omega * std::sin(omega * kSleepTicks / 60.0 / 2));
    EXPECT_NEAR(low_corner(*bodies.find(wood)).y, -600 / water, rest);
    EXPECT_EQ(bodies.find(wood)->state, BodyState::asleep);
    EXPECT_NEAR(bodies.find(wood)->submerged, 600 / water, rest);
    EXPECT_LT(low_corner(*bodies.find(stone)).y, -10);  // through the open bottom of the pool
  }
}

TEST(Bodies, BounceWithTheirRestitution) {
  World w(world::standard_blocks());
  add_floor(w);
  for (const double e : {0.5, 0.9, 1.0}) {
    Bodies bodies(w.store);
    BodyDescription d = smooth_box(0, 4, 0);
    d.restitution = e;
    const BodyId id = *bodies.add(d);
    double highest = 0;
    bool bounced = false;
    for (int i = 0; i < 120; ++i) {
      const double before = from_fixed(bodies.find(id)->velocity).y;
      bodies.step({});
      const double after = from_fixed(bodies.find(id)->velocity).y;
      if (before < 0 && after > 0) bounced = true;
      if (bounced) highest = std::max(highest, low_corner(*bodies.find(id)).y);
      if (bounced && after <= 0) break;
    }
    // Between two ticks it may be higher by what it falls in half of one.
    EXPECT_LE(highest, 4 * e * e + 1e-8) << e;
    EXPECT_NEAR(highest, 4 * e * e, 9.81 / 2 / 120 / 120 + 1e-8) << e;
  }
}

TEST(Bodies, FrictionStopsThemAfterCoulombsWay) {
  World w(world::standard_blocks());
  add_floor(w);
  Bodies bodies(w.store);
  BodyDescription d = smooth_box(0, 0, 0);
  d.friction = 0.5, d.velocity = {6, 0, 0};
  const BodyId id = *bodies.add(d);
  for (int i = 0; i < 300; ++i) bodies.step({});
  // v^2 / (2 mu g), within a tick at full speed.
  EXPECT_NEAR(low_corner(*bodies.find(id)).x + 0.5, 36 / (2 * 0.5 * 9.81), 6.0 / 60);
  EXPECT_EQ(bodies.find(id)->state, BodyState::asleep);
}

TEST(Bodies, ShareMomentumWhenTheyCollide) {
  World w(world::standard_blocks());
  BodySettings settings;
  settings.gravity = 0;
  for (const double e : {0.0, 1.0}) {
    Bodies bodies(w.store);
    BodyDescription d = smooth_box(0, 0, 0);
    d.velocity = {5, 0, 0}, d.restitution = e;
    const BodyId a = *bodies.add(d);
    d = smooth_box(3, 0, 0);
    d.density = 3000, d.restitution = e;
    const BodyId b = *bodies.add(d);
    for (int i = 0; i < 60; ++i) bodies.step(settings);
    const double va = from_fixed(bodies.find(a)->velocity).x, vb = from_fixed(bodies.find(b)->velocity).x;
    EXPECT_NEAR(1 * va + 3 * vb, 5, 1e-8) << e;
    EXPECT_NEAR(vb - va, 5 * e, 1e-8) << e;
  }
}

TEST(Bodies, WakeWhenWhatTheyLieOnGoes) {
  World w(world::standard_blocks());
  add_floor(w);
  Bodies bodies(w.store);
  const BodyId low = *bodies.add(smooth_box(0, 0, 0)), high = *bodies.add(smooth_box(0, 1, 0));
  for (int i = 0; i < 60; ++i) bodies.step({});
  ASSERT_EQ(bodies.find(high)->state, BodyState::asleep);
  EXPECT_EQ(bodies.step({}).awake, 0u);
  fill(w, {-2, -1, -2}, {2, -1, 2}, "air");
  for (int i = 0; i < 120; ++i) bodies.step({});
  EXPECT_EQ(low_corner(*bodies.find(low)).y, -1);
  EXPECT_EQ(low_corner(*bodies.find(high)).y, 0);
  bodies.remove(low);
  for (int i = 0; i < 120; ++i) bodies.step({});
  EXPECT_EQ(low_corner(*bodies.find(high)).y, -1);
}

TEST(Bodies, DescriptionsOutOfRangeAreRefused) {
  World w(world::standard_blocks());
  Bodies bodies(w.store);
  BodyDescription d;
  d.density = 0;
  EXPECT_FALSE(bodies.add(d).ok());
  d = {}, d.size.y = std::nan("");
  EXPECT_FALSE(bodies.add(d).ok());
  d = {}, d.foot.voxel.x = world::kWorldBorder;
  EXPECT_FALSE(bodies.add(d).ok());
  d = {}, d.restitution = 1.5;
  const auto refused = bodies.add(d);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("restitution"), std::string::npos);
}

TEST(Bodies, DamagedBytesAreRefusedAndChangeNothing) {
  World w(world::standard_blocks());
  Bodies bodies(w.store);
  bodies.add(smooth_box(0, 5, 0)).value();
  const std::string whole = bodies.bytes();
  const uint64_t hash = bodies.content_hash();
  for (size_t length = 0; length < whole.size(); ++length)
    EXPECT_FALSE(bodies.restore(whole.substr(0, length)).ok()) << length;
  // No flip may leave what the step can't bear.
  for (size_t i = 0; i < whole.size() * 8; ++i) {
    std::string damaged = whole;
    damaged[i / 8] = static_cast<char>(damaged[i / 8] ^ 1 << i % 8);
    Bodies others(w.store);
    if (others.restore(damaged).ok()) others.step({});
  }
  EXPECT_EQ(bodies.content_hash(), hash);
  EXPECT_TRUE(bodies.restore(whole).ok());
  EXPECT_EQ(bodies.content_hash(), hash);
}

/// 300 boxes thrown together over steps, a pond and each other, some of them asleep at first.
uint64_t hash_of_thrown(int threads, std::vector<BodyReport>* reports) {
  const world::ThreadLimit limit(threads);
  World w(world::standard_blocks());
  add_floor(w);
  for (int x = -16; x < 16; x += 4) fill(w, {x, 0, -16}, {x + 3, (x + 16) / 8, 15}, "stone");
  fill(w, {-8, 0, -24}, {8, 1, -17}, "water");
  Bodies bodies(w.store);
  const auto draw = [](int i, int j) { return world::uniform01_double(world::random_bits(9, i, j, 0)); };
  for (int i = 0; i < 300; ++i) {
    BodyDescription d;
    d.foot = WorldPoint::from(24 * draw(i, 0) - 12, 5 + 8 * draw(i, 1), 30 * draw(i, 2) - 20);
    d.size = Vec3d(0.25 + draw(i, 3), 0.25 + draw(i, 4), 0.5), d.restitution = 0.4, d.density = 300 + 2000 * draw(i, 5);
    d.velocity = {8 * draw(i, 6) - 4, 0, 8 * draw(i, 7) - 4};
    bodies.add(d).value();
  }
  uint64_t hash = 0;
  for (int tick = 0; tick < 240; ++tick) {
    // One of them isn't a number any more, one is gone; later all are thrown again, out of their sleep.
    if (tick == 30) bodies.set_velocity(17, Vec3d(std::nan(""))), bodies.remove(18);
    if (tick == 180)
      for (BodyId id = 1; id < 300; id += 3) bodies.set_velocity(id, {3 * draw(id, 8), 5, -3 * draw(id, 9)});
    const BodyReport report = bodies.step({});
    if (reports) reports->push_back(report);
    hash = world::hash_combine(hash, bodies.content_hash());
  }
  return hash;
}

TEST(Bodies, MoveTheSameInEachTickOnAnyNumberOfThreads) {
  std::vector<BodyReport> one;
  const uint64_t hash = hash_of_thrown(1, &one);
  uint64_t contacts = 0, slept = 0;
  for (const BodyReport& report : one) contacts += report.contacts, slept += report.bodies - report.awake;
  ASSERT_GT(contacts, 10'000u);
  ASSERT_GT(slept, 1000u);
  for (const int threads : {2, 3, 8}) {
    std::vector<BodyReport> reports;
    EXPECT_EQ(hash_of_thrown(threads, &reports), hash) << threads;
    for (size_t n = 0; n < one.size(); ++n) {
      EXPECT_EQ(reports[n].contacts, one[n].contacts) << n;
      EXPECT_EQ(reports[n].awake, one[n].awake) << n;
      EXPECT_EQ(reports[n].pushed, one[n].pushed) << n;
    }
  }
}

// ---- players ----

struct Walk {
  World w{world::standard_blocks()};
  std::optional<Bodies> bodies;
  std::optional<Player> player;
  void enter(double x, double y, double z) {
    bodies.emplace(w.store);
    player = *Player::enter(*bodies, WorldPoint::from(x, y, z));
  }
  void go(int ticks, PlayerInput input) {
    for (int i = 0; i < ticks; ++i) {
      player->control(*bodies, input, {});
      bodies->step({});
    }
  }
  const Body& body() { return *bodies->find(player->body()); }
  Vec3d foot() { return low_corner(body()) + Vec3d(kPlayerWidth / 2, 0, kPlayerWidth / 2); }
};

TEST(Player, WalksSprintsAndStops) {
  Walk walk;
  add_floor(walk.w);
  walk.enter(0.5, 0, 0.5);
  walk.go(60, {.east = 1});
  EXPECT_NEAR(from_fixed(walk.body().velocity).x, kWalkSpeed, 0.05);
  walk.go(60, {.east = 1, .sprint = true});
  EXPECT_NEAR(from_fixed(walk.body().velocity).x, kSprintSpeed, 0.05);
  walk.go(60, {});
  EXPECT_EQ(walk.body().state, BodyState::asleep);
  EXPECT_EQ(walk.foot().y, 0);
}

TEST(Player, JumpsOntoABlockAndNotOntoTwo) {
  for (const int height : {1, 2}) {
    Walk walk;
    add_floor(walk.w);
    fill(walk.w, {3, 0, -2}, {30, height - 1, 2}, "stone");
    walk.enter(0.5, 0, 0.5);
    walk.go(30, {.east = 1});
    walk.go(10, {.east = 1, .jump = true});
    walk.go(80, {.east = 1});
    EXPECT_EQ(walk.foot().y, height == 1 ? 1 : 0) << height;
  }
}

/// Slabs are steps of half a metre; a proxy's boxes are what is climbed.
TEST(Player, ClimbsStairsOf60CentimetresWithoutAJump) {
  Walk walk;
  add_floor(walk.w);
  for (const double step : {0.6, 0.61}) {
    walk.enter(0.5, 0, 0.5);
    // A stair of bodies that don't move: asleep from the start.
    BodyDescription d = smooth_box(2, 0, 0.5, {1, step, 2});
    d.density = 1e5;
    walk.bodies->add(d).value();
    d = smooth_box(3, 0, 0.5, {1, 2 * step, 2}), d.density = 1e5;
    walk.bodies->add(d).value();
    walk.go(50, {.east = 0.5});
    if (step == 0.6)
      EXPECT_NEAR(walk.foot().y, 1.2, 1e-8);
    else
      EXPECT_EQ(walk.foot().y, 0);
  }
}

TEST(Player, CrouchesUnderWhatItCantStandUnder) {
  Walk walk;
  add_floor(walk.w);
  // A ceiling 1.6 m up: lower than 1.8, higher than 1.5.
  walk.enter(0.5, 0, 0.5);
  walk.bodies
      ->add([] {
        BodyDescription d = smooth_box(5, 1.6, 0.5, {6, 0.4, 6});
        d.density = 1e5, d.friction = 1;  // so heavy that walking into it moves it by less than a centimetre
        return d;
      }())
      .value();
  // Posts hold it up.
  for (const double z : {-2.3, 3.3}) walk.bodies->add(smooth_box(5, 0, z, {6, 1.6, 0.2})).value();
  walk.go(40, {.east = 1});
  EXPECT_NEAR(walk.foot().x, 2 - kPlayerWidth / 2, 0.01);
  walk.go(120, {.east = 1, .crouch = true});
  EXPECT_GT(walk.foot().x, 3);
  EXPECT_LT(walk.foot().x, 7);
  walk.go(5, {});
  EXPECT_TRUE(walk.player->crouches());
  walk.go(300, {.east = 1});
  EXPECT_GT(walk.foot().x, 8);
  EXPECT_FALSE(walk.player->crouches());
}

// From a full voxel to one that holds half as much: sqrt(2 g 0.5 m), half of it where the other side is a wall.
TEST(BodyTerrain, LiquidFlowsFromWhereThereIsMore) {
  world::World w(world::standard_blocks());
  add_floor(w);
  fill(w, {-1, 0, 0}, {-1, 0, 0}, "stone");
  fill(w, {0, 0, -1}, {1, 0, -1}, "stone");
  fill(w, {0, 0, 1}, {1, 0, 1}, "stone");
  fill(w, {0, 0, 0}, {1, 0, 0}, "water");
  fill(w, {2, 0, 0}, {2, 0, 0}, "stone");
  std::array<int32_t, world::kLeafVoxels> amount{};
  world::LeafMask active;
  active.set(world::index_in_leaf({1, 0, 0}));
  amount[static_cast<size_t>(world::index_in_leaf({1, 0, 0}))] = 2048;
  w.store.make_int_layer(world::Layer::liquid).write_leaf({0, 0, 0}, amount, active);
  BodyTerrain terrain(w.store);
  terrain.refresh();
  const BodyBox in_first{fixed_from(world::Vec3d(0.25, 0.25, 0.25)), fixed_from(world::Vec3d(0.5, 0.5, 0.5))};
  const world::Vec3d half(std::sqrt(9.81) / 2, 0, 0);
  EXPECT_EQ(terrain.current(in_first), half);
  EXPECT_EQ(terrain.current(moved(in_first, fixed_from(world::Vec3d(1, -0.25, 0)))), half);
  EXPECT_EQ(terrain.current(moved(in_first, fixed_from(world::Vec3d(0, 2, 0)))), world::Vec3d(0, 0, 0));
}

TEST(Player, SwimsUpAndFloats) {
  Walk walk;
  fill(walk.w, {-8, -9, -8}, {8, -9, 8}, "stone");
  fill(walk.w, {-8, -8, -8}, {8, -1, 8}, "water");
  walk.enter(0.5, -7, 0.5);
  walk.go(60, {.jump = true});
  EXPECT_GT(walk.foot().y, -6);
  EXPECT_LT(from_fixed(walk.body().velocity).y, kSwimSpeed + 0.5);
  walk.go(1200, {});
  // Floats with its head out, just.
  EXPECT_NEAR(walk.body().submerged, kPlayerDensity / 998, 0.02);
  EXPECT_GT(walk.foot().y + kPlayerHeight, 0);
}

}  // namespace
}  // namespace sim
