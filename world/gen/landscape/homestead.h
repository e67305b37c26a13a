/// A cabin with lamps, a garden and a fence around its yard; at most one every 256 m, on the valley's floor.
#pragma once

#include <optional>
#include <vector>

#include "world/gen/landscape/canvas.h"
#include "world/gen/landscape/columns.h"

namespace world::landscape {

struct Homestead {
  VoxelPos door;      // middle of the cabin's front, at the floor's height
  int quarter_turns;  // of the front, from +z towards +x

  /// The world position of a plan position: u along the front, v out of the door.
  VoxelPos at(int u, int y, int v) const {
    switch (quarter_turns) {
      case 0:
        return {door.x + u, y, door.z + v};
      case 1:
        return {door.x + v, y, door.z - u};
      case 2:
        return {door.x - u, y, door.z - v};
      default:
        return {door.x - v, y, door.z + u};
    }
  }
  struct PlanPosition {
    int64_t u, v;
  };
  PlanPosition plan(int32_t x, int32_t z) const;
  /// No trees within its yard.
  bool keeps_clear(int32_t x, int32_t z) const;
  /// Whether its cabin takes the ground away there.
  bool clears(VoxelPos p) const;
};

/// The homestead of a 256 m cell, a pure function of the relief.
std::optional<Homestead> homestead_of_cell(const Relief& relief, int32_t cell_x, int32_t cell_z);
/// Those that reach into a region or its margin, in the order of their cells.
std::vector<Homestead> homesteads_near(const Relief& relief, RegionPos region);
void draw_homestead(const Homestead& homestead, const Columns& columns, const Materials& materials, Canvas& canvas);

}  // namespace world::landscape
