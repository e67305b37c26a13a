#include "world/base/simd.h"

#include <hwy/highway.h>

namespace world {

namespace {
void choose(int64_t targets) {
  hwy::SetSupportedTargetsForTest(targets);  // 0: all that the processor has
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}
}  // namespace

std::vector<SimdLevel> simd_levels() {
  std::vector<SimdLevel> levels;
  for (int64_t target : hwy::SupportedAndGeneratedTargets()) levels.push_back({target, hwy::TargetName(target)});
  return levels;
}

SimdChoice::SimdChoice(const SimdLevel& level) { choose(level.target); }
SimdChoice::~SimdChoice() { choose(0); }

}  // namespace world
