/// Fills a region with ground, water, caves and ores; deep caves hold water, or lava. Most leaves are decided by
/// bounds, without a visit to a voxel:
///
///   above all ground of its 64 columns    air, or water up to the water level
///   below all soil                        one kind of rock, unless the cave lattice or the leaf's own dice say more
///   the rest                              voxel by voxel
///
/// Caves and overhangs come from noise on a lattice of 4 m, linear in between, so the least value of a leaf's 27
/// lattice points bounds all of its voxels.
#pragma once

#include <array>

#include "world/gen/landscape/canvas.h"
#include "world/gen/landscape/columns.h"

namespace world::landscape {

class Terrain {
 public:
  Terrain(const Relief& relief, const Materials& materials, bool caves, bool lava);

  void fill(const Columns& columns, Canvas& canvas) const;
  /// Whether a cave takes the voxel; x and z relative to the region of `columns`, within -6..133.
  bool is_cave(const Columns& columns, int x, int32_t y, int z) const;
  /// Whether fill() puts rock or soil there; x and z as for is_cave().
  bool is_ground(const Columns& columns, int x, int32_t y, int z) const;
  BlockId rock(int32_t y, int strata) const { return layers_[static_cast<size_t>((y + strata) & 255)]; }

 private:
  /// One value every 4 m of a region, z fastest.
  struct Lattice {
    static constexpr int kStep = 4, kSide = kRegionSize / kStep + 1;
    std::array<int32_t, kSide * kSide * kSide> value;
    static constexpr int index(int x, int y, int z) { return (x * kSide + y) * kSide + z; }
    const int32_t* row(int x, int y, int z) const { return &value[static_cast<size_t>(index(x, y, z))]; }
    int32_t* row(int x, int y, int z) { return &value[static_cast<size_t>(index(x, y, z))]; }
  };
  struct Scratch;

  void cave_row(int64_t x, int32_t y, int64_t z, int count, int32_t* out) const;
  bool make_caves(const Columns& columns, int32_t y0, Lattice& out) const;
  void overhang_row(int64_t x, int32_t y, int64_t z, int count, int32_t* out) const;
  void make_overhangs(const Columns& columns, int32_t y0, Lattice& out) const;
  void surface_leaf(const Columns& columns, const Lattice* overhangs, VoxelPos offset, int32_t y0,
                    Canvas::Leaf& out) const;
  void add_ore(VoxelPos leaf, bool beside_cave, Canvas::Leaf& out) const;
  void carve(const Lattice& caves, VoxelPos offset, int32_t y0, Canvas::Leaf& out) const;

  const Materials& materials_;
  uint64_t seed_;
  bool caves_;
  BlockId pool_;                     // what lies in deep caves
  std::array<BlockId, 256> layers_;  // rock by y
  std::vector<uint8_t> is_rock_;     // by block id
};

}  // namespace world::landscape
