/// The hour in a world that is played: it goes on with the ticks of matter. So it stands still while the world is
/// paused, runs as fast as the world does, and goes back where ticks are taken back.
#pragma once

#include <cstdint>
#include <optional>

namespace tools {

constexpr double kSunStepH = 0.01;  // 0.15 degrees of the sun's way: shadows move by steps of 3 mm a metre of height

class DayClock {
 public:
  /// The hour to show, from 0 to 24, where it is another than `shown`. A day takes `minutes` of the world's time; 0:
  /// the sun stands still. Where `shown` isn't what this gave last, somebody set it: the clock goes on from there.
  /// Below 0 the world has a sun of its own, and no hours.
  std::optional<float> advance(float shown, uint64_t tick, double minutes);

 private:
  float given_ = -1;
  double from_hours_ = 0, minutes_ = 0;
  uint64_t from_tick_ = 0;
};

}  // namespace tools
