#include "world/base/jobs.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>

namespace world {

using oneapi::tbb::global_control;

int thread_count() {
  const auto allowed = global_control::active_value(global_control::max_allowed_parallelism);
  const int machine = oneapi::tbb::info::default_concurrency();
  return allowed < static_cast<size_t>(machine) ? static_cast<int>(allowed) : machine;
}

ThreadLimit::ThreadLimit(int threads) {
  if (threads > 0) control_ = new global_control(global_control::max_allowed_parallelism, static_cast<size_t>(threads));
}

ThreadLimit::~ThreadLimit() { delete static_cast<global_control*>(control_); }

void parallel_ranges(size_t count, size_t grain, const std::function<void(size_t, size_t)>& body) {
  oneapi::tbb::parallel_for(
      oneapi::tbb::blocked_range<size_t>(0, count, grain == 0 ? 1 : grain),
      [&](const auto& range) { body(range.begin(), range.end()); },
      oneapi::tbb::simple_partitioner());  // others leave pieces longer than the grain
}

void parallel_for(size_t count, const std::function<void(size_t)>& body) {
  oneapi::tbb::parallel_for(
      oneapi::tbb::blocked_range<size_t>(0, count, 1),
      [&](const auto& range) {
        for (size_t i = range.begin(); i != range.end(); ++i) body(i);
      },
      oneapi::tbb::simple_partitioner());
}

}  // namespace world
