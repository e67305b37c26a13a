// Hard cases TM1 to TM7: time.
#include <cmath>

#include "sim/bodies/bodies.h"
#include "tests/sim/bodies/body_support.h"
#include "world/base/random.h"

namespace sim {
namespace {

using world::Vec3d;
using world::World;
using world::WorldPoint;

TEST(HardCaseTM1, TimeHasNoErrorAfterElevenDaysWhereAFloatHasStopped) {
  EXPECT_EQ(seconds_at(60'000'000), 1e6);
  EXPECT_EQ(seconds_at(60'000'001), 60'000'001 / 60.0);
  EXPECT_EQ(seconds_at(UINT64_C(1) << 60), std::ldexp(1.0, 60) / 60);
  // The control: what this replaces.
  float stopped = 524288;
  stopped += 1.0f / 60;
  EXPECT_EQ(stopped, 524288);
}

TEST(HardCaseTM2, AClockDoesNotDriftInSixtyMillionTicks) {
  Clock clock({}, 1000);
  double sum = 0;
  for (int second = 0; second < 1'000'000; ++second) {
    clock.advance(1'000'000'000);
    for (int i = 0; i < 60; ++i) sum += 1.0 / 60;
  }
  EXPECT_EQ(clock.tick(), 60'000'000u);
  EXPECT_EQ(clock.part(), 0);
  EXPECT_GT(std::abs(sum - 1e6), 1e-4);  // the control
}

/// A tick takes twice as long as it lasts, for 10 s, and then nothing.
TEST(HardCaseTM3, SlowTicksLagAndThenRecoverInAFrame) {
  constexpr int kMost = 5;
  constexpr int64_t kTick = 1'000'000'000 / 60, kCost = 2 * kTick, kDraw = 1'000'000;
  Clock clock({}, kMost);
  int64_t elapsed = kTick, now = 0;
  while (now < 10'000'000'000) {
    const int ticks = clock.advance(elapsed);
    EXPECT_LE(ticks, kMost);
    elapsed = ticks * kCost + kDraw;
    EXPECT_LE(elapsed, (kMost + 1) * kCost);
    now += elapsed;
  }
  EXPECT_GT(clock.dropped(), 200u);
  EXPECT_LT(clock.tick(), 320u);
  clock.advance(elapsed);
  const uint64_t dropped = clock.dropped();
  for (int frame = 0; frame < 60; ++frame) EXPECT_LE(clock.advance(kTick), 1);
  EXPECT_EQ(clock.dropped(), dropped);
}

TEST(HardCaseTM4, SleepAndClocksThatStepBackChangeNothing) {
  Clock clock;
  EXPECT_EQ(clock.advance(-5'000'000'000), 0);
  EXPECT_EQ(clock.part(), 0);
  EXPECT_EQ(clock.advance(3600'000'000'000), 5);
  EXPECT_EQ(clock.advance(INT64_MAX), 5);
  EXPECT_EQ(clock.advance(INT64_MIN), 0);
  EXPECT_EQ(clock.tick(), 10u);
}

TEST(HardCaseTM5, TheRateOfPicturesIsNoPartOfTheWorld) {
  std::vector<std::vector<uint64_t>> runs;
  for (const int rate : {30, 60, 144, 1000}) {
    World w(world::standard_blocks());
    add_floor(w);
    Bodies bodies(w.store);
    BodyDescription d = smooth_box(0, 3, 0);
    d.restitution = 0.7, d.friction = 0.3;
    const BodyId id = *bodies.add(d);
    Clock clock;
    std::vector<uint64_t> hashes;
    while (hashes.size() < 300)
      for (int n = clock.advance(1'000'000'000 / rate); n > 0; --n) {
        // Inputs are given by tick.
        if (bodies.ticks() % 50 == 10) bodies.set_velocity(id, {double(bodies.ticks() % 7), 4, -2});
        bodies.step({});
        hashes.push_back(bodies.content_hash());
      }
    hashes.resize(300);
    runs.push_back(std::move(hashes));
  }
  for (const auto& run : runs) EXPECT_EQ(run, runs[0]);
  EXPECT_NE(runs[0][0], runs[0][200]);
}

TEST(HardCaseTM6, NoPictureLiesBetweenTheEndsOfATeleport) {
  World w(world::standard_blocks());
  Bodies bodies(w.store);
  BodyDescription d = smooth_box(0, 0, 0);
  d.velocity = {6, 0, 0};
  const BodyId id = *bodies.add(d);
  BodySettings settings;
  settings.gravity = 0;
  bodies.step(settings);
  EXPECT_NEAR((drawn_at(*bodies.find(id), 0.5) - WorldPoint::from(-0.5, 0, -0.5)).x, 0.05, 1e-9);
  bodies.teleport(id, WorldPoint::from(1000, 0, 0));
  for (const double part : {0.0, 0.5, 0.999}) {
    EXPECT_EQ((drawn_at(*bodies.find(id), part) - WorldPoint::from(999.5, 0, -0.5)).x, 0) << part;
  }
  bodies.step(settings);
  EXPECT_NEAR((drawn_at(*bodies.find(id), 0) - WorldPoint::from(999.5, 0, -0.5)).x, 0, 1e-9);
}

TEST(HardCaseTM7, APhaseIsRightAfterAMillionSeconds) {
  // Waves of 1.7 s: tick * (1/60) / 1.7 periods, by hand in integers.
  const uint64_t tick = 60'000'000 + 17;
  const double expected = double(tick * 10 % 1020) / 1020;
  EXPECT_NEAR(phase_at(tick, {17, 10}), expected, 1e-15);
  EXPECT_NEAR(phase_at(tick, {17, 10}, 0.5), expected + 5.0 / 1020, 1e-15);
  for (uint64_t t = tick; t < tick + 2000; ++t) {
    const double phase = phase_at(t, {17, 10}, 0.999);
    EXPECT_GE(phase, 0);
    EXPECT_LT(phase, 1);
  }
  // The control: seconds in float.
  const float seconds = float(tick) / 60;
  EXPECT_GT(std::abs(std::fmod(seconds / 1.7f, 1.0f) - float(expected)), 1e-6f);
}

}  // namespace
}  // namespace sim
