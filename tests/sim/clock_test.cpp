// The clock: whole ticks, and the rest kept.
#include "sim/clock.h"

#include <gtest/gtest.h>

namespace sim {
namespace {

TEST(Clock, KeepsTheRestOfEachFrame) {
  Clock clock;
  int ticks = 0;
  for (int frame = 0; frame < 144; ++frame) ticks += clock.advance(1'000'000'000 / 144);
  // 144 frames of 6944444 ns are 64 ns short of a second.
  EXPECT_EQ(ticks, 59);
  EXPECT_GT(clock.part(), 0.999);
  EXPECT_LT(clock.part(), 1.0);
  EXPECT_EQ(clock.advance(64), 1);
  EXPECT_EQ(clock.part(), 0);
}

TEST(Clock, SpeedsRunFromAnEighthTo64) {
  for (const int eighths : {1, 2, 8, 16, 512}) {
    Clock clock;
    clock.set_speed(eighths);
    int ticks = 0;
    for (int frame = 0; frame < 60 * 8; ++frame) ticks += clock.advance(frame % 3 == 0 ? 16666668 : 16666666);
    EXPECT_EQ(ticks, 60 * eighths) << eighths;
    EXPECT_EQ(clock.dropped(), 0u) << eighths;
  }
  Clock clock;
  clock.set_speed(0);
  EXPECT_EQ(clock.speed_eighths(), 1);
  clock.set_speed(1000);
  EXPECT_EQ(clock.speed_eighths(), 512);
}

TEST(Clock, PausesAndGoesOnTickByTick) {
  Clock clock;
  EXPECT_EQ(clock.advance(50'000'000), 3);
  clock.set_paused(true);
  EXPECT_EQ(clock.advance(500'000'000), 0);
  EXPECT_EQ(clock.step_once(), 1);
  EXPECT_EQ(clock.tick(), 4u);
  EXPECT_EQ(clock.part(), 0);
  clock.set_paused(false);
  EXPECT_EQ(clock.step_once(), 0);
  EXPECT_EQ(clock.advance(16'666'667), 1);
}

TEST(Clock, OtherLengthsOfATickAreFractionsToo) {
  Clock clock({1001, 30000}, 100);
  int ticks = 0;
  for (int second = 0; second < 1001; ++second) ticks += clock.advance(1'000'000'000);
  EXPECT_EQ(ticks, 30000 - 0);
  EXPECT_EQ(clock.part(), 0);
}

}  // namespace
}  // namespace sim
