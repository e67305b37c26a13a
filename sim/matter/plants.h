/// What each block is to growth (sim/matter/rules/growth.cpp), by its name.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "world/blocks/block.h"

namespace sim {

/// Bits; a block may be several.
namespace plant {
enum Bits : uint16_t {
  open = 1,    // air: things grow into it
  passes = 2,  // light comes through
  dirt = 4,    // grass spreads to it
  grass = 8,
  bears = 16,  // saplings, reeds and cacti stand on it
  farmland = 32,
  wheat = 64,
  water = 128,
  leaves = 256,
  log = 512,
  sapling = 1024,
  stalk = 2048,  // reed, cactus
};
}

/// A tree of this kind.
struct TreeKind {
  std::string_view sapling_name, log_name, leaves_name;
  int least_height = 4, heights = 3;  // logs: least_height .. least_height + heights - 1
  bool cone = false;                  // else a round crown
  world::BlockId sapling = 0, log = 0, leaves = 0;
};
/// A plant that grows a voxel upwards at a time.
struct StalkKind {
  std::string_view name;
  int height = 3;            // voxels, at most
  bool needs_water = false;  // beside what it stands on
  world::BlockId block = 0;
};

class PlantBlocks {
 public:
  /// Takes in blocks that the palette has gained.
  void follow(const world::BlockPalette& palette);
  uint16_t operator[](world::BlockId id) const { return bits_[id]; }
  const TreeKind* tree(world::BlockId sapling) const;
  const StalkKind* stalk(world::BlockId block) const;
  world::BlockId grass() const { return grass_; }
  world::BlockId wheat() const { return wheat_; }

 private:
  std::vector<uint16_t> bits_;
  std::vector<TreeKind> trees_;
  std::vector<StalkKind> stalks_;
  world::BlockId grass_ = world::kAir, wheat_ = world::kAir;
};

/// The same of one block alone.
uint16_t plant_bits(const world::Block& block);

}  // namespace sim
