/// Processor time, which other programs don't stretch much.
#pragma once

#include <ctime>

namespace tools {

/// Of CLOCK_PROCESS_CPUTIME_ID: all threads of this process; of CLOCK_THREAD_CPUTIME_ID: the calling one.
inline double cpu_seconds(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace tools
