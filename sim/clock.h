/// Time: a count of ticks of a fixed length, never a sum of floating-point seconds.
///
/// A clock turns the real time between two pictures into whole ticks and keeps the rest, so that the world is the same
/// at any rate of pictures. A picture between two ticks is drawn at part() of the way from the one to the other.
///
///   while (playing) {
///     for (int n = clock.advance(elapsed_ns); n > 0; --n) step(world);
///     draw(world, clock.part());
///   }
///
/// Where ticks take longer than they last, at most most_ticks a picture are asked for and the rest of the time is
/// dropped: simulated time lags, and no queue grows.
/// source Glenn Fiedler. Fix Your Timestep! 2004
#pragma once

#include <cstdint>

namespace sim {

/// Seconds a tick, as a fraction of whole numbers: 1/60 is exact.
struct TickLength {
  int32_t numerator = 1, denominator = 60;  // 1 .. 1000000
  double seconds() const { return static_cast<double>(numerator) / denominator; }
};

constexpr TickLength kMatterTick{1, 20};  // of the rules of matter, and of what lives among it

/// The time at which a tick begins, in s: rounded once, however many ticks there were.
double seconds_at(uint64_t tick, TickLength length = {});

/// Where in its period something is at a tick and a part of the next: in [0, 1). The period is a fraction of seconds.
/// error  2^-52 of a period at any tick, where the parts of the fraction are at most 1000000
double phase_at(uint64_t tick, TickLength period, double part = 0, TickLength length = {});

/// How many things of a steady rate come in a tick, so that over any ticks their sum is right within one: a function of
/// the tick, not of what came before. 0 <= per_tick < 2^31.
uint64_t due_in_tick(double per_tick, uint64_t tick);

class Clock {
 public:
  /// At speed 1, most_ticks >= 1 a call of advance(); at higher speeds in proportion more.
  explicit Clock(TickLength length = {}, int most_ticks = 5);

  /// Ticks to be simulated now, after so much real time. Time that runs backwards counts as none, and more than a
  /// second as a second: the machine slept.
  int advance(int64_t elapsed_ns);

  void set_paused(bool paused) { paused_ = paused; }
  bool paused() const { return paused_; }
  /// One tick while paused; call it in place of advance().
  int step_once();
  /// In eighths: 1 (an eighth of real time) to 512 (64 times); what lies outside is clamped.
  void set_speed(int eighths);
  int speed_eighths() const { return speed_eighths_; }

  uint64_t tick() const { return tick_; }  // asked for so far
  void set_tick(uint64_t tick);            // of a world that was loaded; part() is 0 then
  TickLength length() const { return length_; }
  /// How far real time is into the next tick: in [0, 1).
  double part() const;
  /// Whole ticks that were dropped because simulation could not keep up.
  uint64_t dropped() const { return dropped_; }

 private:
  // One tick is `cost` parts; a nanosecond at speed n/8 brings n * denominator of them.
  int64_t cost() const { return int64_t{8'000'000'000} * length_.numerator; }
  TickLength length_;
  int most_ticks_, speed_eighths_ = 8;
  bool paused_ = false;
  int64_t waiting_ = 0;  // parts, < cost()
  uint64_t tick_ = 0, dropped_ = 0;
};

}  // namespace sim
