/// The rule of block games: full voxels are sources for ever; what flows has a level, seven below a source or under
/// what falls, one less a step to the sides; it goes where nothing feeds it. Two sources beside one voxel make a third.
/// What is made and lost is booked. Internal to sim/matter.
/// source Minecraft Wiki: Fluid. (levels, the five ticks of water and the source between two)
#pragma once

#include "sim/matter/liquid_pages.h"

namespace sim {

inline constexpr uint64_t kGameTicks = 5;  // from one voxel to the next

struct GameLevelsReport {
  uint64_t leaves_visited = 0, voxels_changed = 0;
};
GameLevelsReport spread_game_levels(Cells& cells, LiquidPages& pages, std::span<const PageId> awake);

}  // namespace sim
