/// Which effects a world calls for: by its content, from its census and palette alone, or because it asks. An effect
/// that is not called for runs nothing, allocates nothing and is compiled into no pipeline.
#pragma once

#include <string>
#include <vector>

#include "world/world.h"

namespace world {

struct EffectCall {
  std::string name;
  bool called_for = false;
  std::string why;  // the block or setting that calls for it, or what is absent
};

/// Every effect of the program, in a fixed order; then those that the world asks for by other names.
std::vector<EffectCall> called_effects(const World& world);

}  // namespace world
