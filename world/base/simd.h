/// The SIMD instruction sets that run-time dispatch chooses among, and a way to force one of them, so that a test can
/// show that each gives the same result.
///
/// Code with SIMD is a .cpp file that includes <hwy/foreach_target.h> and calls HWY_DYNAMIC_DISPATCH(function); this
/// header and its callers need no Highway header. Nothing is compiled for the machine that builds.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace world {

struct SimdLevel {
  int64_t target = 0;  // Highway's bit
  std::string name;    // "AVX3", "AVX2", "SSE4", ..., "EMU128" for plain C++
};

/// What is compiled in and this processor runs, best first; never empty.
std::vector<SimdLevel> simd_levels();

/// Dispatches to one level for its lifetime. For tests and benchmarks; not while other threads dispatch. Doesn't nest.
class SimdChoice {
 public:
  explicit SimdChoice(const SimdLevel& level);
  ~SimdChoice();
  SimdChoice(const SimdChoice&) = delete;
  SimdChoice& operator=(const SimdChoice&) = delete;
};

}  // namespace world
