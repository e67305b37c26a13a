/// What one thread holds while it finds the light of a window. Internal to sim/light.
#pragma once

#include <vector>

#include "sim/light/field_flood.h"
#include "sim/light/flood_window.h"

namespace sim {

struct FloodWorker {
  struct Slow {
    int x, row, loss;
    world::LeafMask open;
  };
  struct Source {
    int x, row, level;
    const world::LeafMask* voxels;
  };
  struct Fixed {
    int x, row;
    uint32_t levels;  // bit l: some voxel has it
    world::LightLeafView leaf;
  };
  /// Of the 27 regions that a window may meet.
  struct RegionOptics {
    world::RegionPos pos;
    bool met = false;                           // else the rest is of another window
    const world::LightRegion* light = nullptr;  // null: outside of the domain
    OpticsVolume::RegionOptics optics;
  };

  FloodWindow window;
  world::LeafPos origin;                 // of the leaf at (0, 0, 0) of the window, in its rim
  std::vector<uint32_t> reached, free;   // by row: found anew, by this job or another; by this one
  std::vector<uint32_t> want, full_sky;  // by row: may get light; all of it sunlit
  std::vector<uint64_t> sky;             // into the next leaf down, by x * size.z + z
  std::vector<Slow> slow;
  std::vector<Source> sources;
  std::vector<Fixed> fixed;
  world::RegionPos low_region;
  RegionOptics regions[27];
  uint64_t computed = 0;
  std::vector<world::LeafPos> changed;

  world::LeafPos leaf_at(int x, int y, int z) const { return origin + world::LeafPos{x, y, z}; }
  const RegionOptics& region_of(world::LeafPos l) const {
    const world::RegionPos o = world::region_from_leaf(l) - low_region;
    return regions[o.x * 9 + o.y * 3 + o.z];
  }
  /// Bits of the leaves with a neighbour in `rows`, of any row of the window.
  uint32_t beside(const std::vector<uint32_t>& rows, int y, int z) const {
    const size_t at = static_cast<size_t>(window.row(y, z)), ny = static_cast<size_t>(window.size[1]);
    uint32_t b = rows[at] << 1 | rows[at] >> 1;
    if (y > 0) b |= rows[at - 1];
    if (y + 1 < window.size[1]) b |= rows[at + 1];
    if (z > 0) b |= rows[at - ny];
    if (z + 1 < window.size[2]) b |= rows[at + ny];
    return b;
  }
};

}  // namespace sim
