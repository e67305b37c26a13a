/// Which effects the content of a world calls for, from its census and palette alone. An effect that is not called for
/// runs nothing, allocates nothing and is compiled into no pipeline.
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

/// Every effect of the program, in a fixed order.
std::vector<EffectCall> called_effects(const World& world);

}  // namespace world
