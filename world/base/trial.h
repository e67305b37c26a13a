/// Tries something dangerous in a child process first: reading a damaged file with a library that trusts it.
#pragma once

#include <cstdint>
#include <functional>

#include "world/base/errors.h"

namespace world {

struct TrialLimits {
  uint64_t memory_bytes = uint64_t{2} << 30;  // beyond what the program has now
  unsigned cpu_seconds = 5;
};

/// Runs `body` in a copy of this process, with limits, its output discarded and its changes lost. Returns what it
/// returned, or an error where it crashed, hung, or ran out of memory; the messages name no file. `body` runs on one
/// thread and must not use the thread pool, because other threads don't exist in the copy.
Status try_in_child(const TrialLimits& limits, const std::function<Status()>& body);

}  // namespace world
