#include "tools/bench/flight.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <thread>

#include <unistd.h>

namespace tools {

size_t resident_bytes() {
  size_t all = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return resident * static_cast<size_t>(::sysconf(_SC_PAGESIZE));
}

FlightReport fly(world::Streamer& streamer, const FlightPlan& plan) {
  using Clock = std::chrono::steady_clock;
  FlightReport report;
  const auto at = [&](double t) {
    return world::VoxelPos{plan.from.x + static_cast<int32_t>(std::lround(plan.heading_x * plan.speed_mps * t)),
                           plan.from.y,
                           plan.from.z + static_cast<int32_t>(std::lround(plan.heading_z * plan.speed_mps * t))};
  };
  // Begin with what lies around the start.
  world::VoxelPos viewer = at(0);
  streamer.settle({&viewer, 1}, 0);
  report.resident_bytes_start = report.most_resident_bytes = resident_bytes();
  report.least_held_radius_m = INFINITY;
  const auto frame = std::chrono::duration<double>(1 / plan.frames_per_s);
  const auto frames = static_cast<int64_t>(plan.seconds * plan.frames_per_s);
  double sum = 0;
  for (int64_t n = 1; n <= frames; ++n) {
    const auto start = Clock::now();
    const double now_s = static_cast<double>(n) / plan.frames_per_s;
    viewer = at(now_s);
    const world::StreamingReport& now = streamer.update({&viewer, 1}, now_s);
    const double stall_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
    report.longest_stall_ms = std::max(report.longest_stall_ms, stall_ms);
    sum += stall_ms;
    report.most_bytes = std::max(report.most_bytes, now.bytes);
    if (now_s > 1) report.least_held_radius_m = std::min(report.least_held_radius_m, now.held_radius_m);
    if (n % 64 == 0) report.most_resident_bytes = std::max(report.most_resident_bytes, resident_bytes());
    if (now.waiting == 0) continue;
    std::this_thread::sleep_until(start + std::chrono::duration_cast<Clock::duration>(frame));
    ++report.frames_waited;
  }
  report.mean_stall_ms = sum / static_cast<double>(frames);
  report.resident_bytes_end = resident_bytes();
  report.streaming = streamer.report();
  return report;
}

}  // namespace tools
