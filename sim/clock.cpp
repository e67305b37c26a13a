#include "sim/clock.h"

#include <algorithm>
#include <cmath>

#include "world/base/errors.h"

namespace sim {

namespace {

constexpr int64_t kLongestFrame = 1'000'000'000;  // ns

void check_length(TickLength length) {
  CHECK_LE(1, length.numerator);
  CHECK_LE(1, length.denominator);
  CHECK_LE(length.numerator, 1000000);
  CHECK_LE(length.denominator, 1000000);
}

}  // namespace

double seconds_at(uint64_t tick, TickLength length) {
  const unsigned __int128 parts = static_cast<unsigned __int128>(tick) * static_cast<uint32_t>(length.numerator);
  // One division of two exact numbers while the product has 53 bits; then whole seconds alone have as many.
  if (parts >> 53 == 0) return static_cast<double>(static_cast<uint64_t>(parts)) / length.denominator;
  return static_cast<double>(parts / static_cast<uint32_t>(length.denominator));
}

double phase_at(uint64_t tick, TickLength period, double part, TickLength length) {
  // Periods so far are tick * a / b.
  const uint64_t a = uint64_t(length.numerator) * uint64_t(period.denominator);
  const uint64_t b = uint64_t(length.denominator) * uint64_t(period.numerator);
  const uint64_t rest = static_cast<uint64_t>(static_cast<unsigned __int128>(tick) * a % b);
  const double periods = (static_cast<double>(rest) + part * static_cast<double>(a % b)) / static_cast<double>(b) +
                         part * static_cast<double>(a / b);
  const double phase = periods - static_cast<double>(static_cast<int64_t>(periods));
  return phase < 1 ? phase : 0;
}

uint64_t due_in_tick(double per_tick, uint64_t tick) {
  // In 2^-32: the rate is rounded once, and sums are whole numbers.
  const auto rate = static_cast<unsigned __int128>(std::llround(per_tick * 0x1p32));
  const auto until = [&](uint64_t t) { return static_cast<uint64_t>(rate * t >> 32); };
  return until(tick + 1) - until(tick);
}

Clock::Clock(TickLength length, int most_ticks) : length_(length), most_ticks_(most_ticks) {
  check_length(length);
  CHECK_LE(1, most_ticks);
}

int Clock::advance(int64_t elapsed_ns) {
  if (paused_) return 0;
  // At most 10^9 * 512 * 10^6 and a tick.
  waiting_ += std::clamp<int64_t>(elapsed_ns, 0, kLongestFrame) * speed_eighths_ * length_.denominator;
  const int64_t due = waiting_ / cost();
  waiting_ %= cost();
  const int64_t most = std::max<int64_t>(most_ticks_, (int64_t{most_ticks_} * speed_eighths_ + 7) / 8);
  const int64_t ticks = std::min(due, most);
  dropped_ += static_cast<uint64_t>(due - ticks);
  tick_ += static_cast<uint64_t>(ticks);
  return static_cast<int>(ticks);
}

int Clock::step_once() {
  if (!paused_) return 0;
  ++tick_;
  waiting_ = 0;
  return 1;
}

void Clock::set_speed(int eighths) { speed_eighths_ = std::clamp(eighths, 1, 512); }

void Clock::set_tick(uint64_t tick) { tick_ = tick, waiting_ = 0; }

double Clock::part() const { return static_cast<double>(waiting_) / static_cast<double>(cost()); }

}  // namespace sim
