#include "tools/play/day_clock.h"

#include <cmath>

#include "sim/clock.h"

namespace tools {

std::optional<float> DayClock::advance(float shown, uint64_t tick, double minutes) {
  if (!(shown >= 0) || !(minutes > 0)) {
    given_ = -1;
    return std::nullopt;
  }
  if (shown != given_ || minutes != minutes_)
    given_ = shown, from_hours_ = double{shown}, from_tick_ = tick, minutes_ = minutes;
  const double ticks = static_cast<double>(static_cast<int64_t>(tick - from_tick_));
  const double hours = from_hours_ + 24 * ticks * sim::kMatterTick.seconds() / (60 * minutes);
  double step = kSunStepH * std::floor(hours / kSunStepH + 1e-6);
  step -= 24 * std::floor(step / 24);
  // Less than a step since it was set.
  if (std::abs(hours - from_hours_) < kSunStepH) return std::nullopt;
  const float next = static_cast<float>(step);
  if (next == given_) return std::nullopt;
  given_ = next;
  return next;
}

}  // namespace tools
