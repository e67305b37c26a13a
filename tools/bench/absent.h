/// loam bench absent: what an effect costs that a scene doesn't call for. The answer must be nothing.
///
/// How to add some: tools/bench/absent/<name>.cpp defines  void add_absent_<name>(std::vector<AbsentCase>&)  and adds a
/// case an effect; the folder is the registry. A case holds the same scene twice: `without`, where nothing of the
/// effect is there, and `with`, where it is there at zero strength, or is not there while the program has it. The first
/// is what the second may cost.
///
/// source  hard cases X1, X2, X5 and X6
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tools/bench/benchmark.h"
#include "tools/bench/report.h"

namespace tools {

/// What one run of a scene did.
struct AbsentRun {
  std::map<std::string, uint64_t> counters;            // passes, draws, rays, leaves, bytes, by name: never a time
  uint64_t passes = 0, leaves_visited = 0, bytes = 0;  // of the effect alone
  uint64_t hash = 0;                                   // of the picture's bits, or of the state
};

struct AbsentCase {
  std::string effect;
  std::string what;  // the two scenes, in one line
  struct Pair {
    std::function<Result<AbsentRun>()> without, with;
  };
  std::function<Result<Pair>(BenchContext&)> make;
};

struct AbsentRow {
  std::string effect, what;
  uint64_t passes = 0, leaves_visited = 0, bytes = 0;
  bool equal = false;                        // pictures or states, bit for bit, and all counters
  double time_ratio = 1, low = 1, high = 1;  // median of with/without in processor time, and 95 % of what it may be
  std::string fault;                         // what is not as it should be; empty: nothing
  bool no_device = false;                    // it could not be tried here
  bool met() const { return fault.empty() || no_device; }
};

/// The factor up to which a time ratio's interval may lie above 1: what paired runs can tell apart.
constexpr double kTimeSlack = 1.05;

/// Every case of the folder.
std::vector<AbsentCase> absent_cases();
/// Runs both scenes by turns, of some pairs made anew, at least three times each and up to `seconds` in all.
/// 0: once each, to compare what they make and do; the time is not looked at.
AbsentRow run_absent(const AbsentCase& the_case, BenchContext& context, double seconds);

std::string absent_text(const std::vector<AbsentRow>& rows);
/// {"machine", "commit", "rows": [{effect, passes, leaves_visited, bytes, equal, time_ratio, low, high, ...}]}
Json absent_json(const Machine& machine, const RunOptions& options, const std::vector<AbsentRow>& rows);

}  // namespace tools
