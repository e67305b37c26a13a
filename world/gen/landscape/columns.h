/// The ground of the valley, column by column: height, steepness, what lies on top. No voxels here.
///
/// The land repeats a theme with ever new detail: valleys along z, one every 1024 m in x, each with a river, a lake
/// every 1024 m, meadows, woods, and mountains between it and the next. All water lies level, its top voxel at
/// y = kWaterTop, so that a new world is at rest.
///
/// Lengths are fixed point, 1/256 m (kMetre); shares are 1/4096 (kNoiseOne). No floats: the same on every machine.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "world/blocks/block.h"
#include "world/gen/noise.h"
#include "world/space/coords.h"

namespace world::landscape {

constexpr int32_t kMetre = 256;
constexpr int kWaterTop = 63;  // the highest voxel of lakes and rivers
constexpr int32_t kWaterLevel = (kWaterTop + 1) * kMetre;
constexpr int kHighestGround = 255;  // no ground at or above this y
constexpr int kMaxOverhang = 13;     // metres by which rock may stand out from its column's height

/// The blocks that the landscape is made of.
struct Materials {
  BlockId water, lava, sand, gravel, mud, clay, dirt, grass, dry_grass, forest_floor, podzol, scree, snow;
  BlockId coal_ore, iron_ore, copper_ore, tin_ore, silver_ore, gold_ore, diamond_ore, emerald_ore, ruby_ore, salt_rock,
      sulfur_ore, glowstone;
  BlockId oak_log, oak_leaves, birch_log, birch_leaves, pine_log, pine_needles, spruce_log, spruce_needles,
      maple_leaves, bush;
  BlockId reed, tall_grass, fern, flower_red, flower_yellow, flower_blue, flower_white;
  BlockId fence_oak, oak_planks, pine_planks, glass, roof_tile, brick_red, brick_stone, cobblestone, lamp_warm, lantern,
      path, farmland, wheat, pumpkin, hay;
  std::array<BlockId, 9> rocks;

  static Result<Materials> from(const BlockPalette& palette);
};

/// One column.
struct Ground {
  BlockId top = kAir, below = kAir;  // the uppermost voxel, and the soil under it
  uint8_t soil = 0;                  // voxels of soil, the top included; 0: bare rock
};

/// The columns of one region and a margin around it that features reach across.
struct Columns {
  static constexpr int kMargin = 8;
  static constexpr int kSide = kRegionSize + 2 * kMargin + 1;  // -8 .. 136, so that lattices of 4 m close
  int32_t x0 = 0, z0 = 0;                                      // the region's first column
  std::array<int32_t, kSide * kSide> height;                   // kMetre; ground fills y + 0.5 < height
  std::array<int32_t, kSide * kSide> overhang;                 // kMetre; 0 where the height says all
  std::array<int16_t, kSide * kSide> cave_top;                 // no caves at or above this y
  std::array<int16_t, kSide * kSide> wood;                     // share of ground under trees, kNoiseOne
  std::array<Ground, kSide * kSide> ground;                    // not in the outermost ring, which lacks neighbours
  std::array<int16_t, kRegionSize * kRegionSize> strata;       // added to y, gives the layer of rock

  /// x and z from -8 to 136, relative to the region.
  static constexpr int index(int x, int z) { return (x + kMargin) * kSide + z + kMargin; }
  /// The highest solid y of a column whose overhang is 0.
  int top(int x, int z) const { return (height[index(x, z)] - kMetre / 2 - 1) >> 8; }
};

/// The shape of the ground for one seed.
class Relief {
 public:
  Relief(uint64_t seed, int32_t mountains_m) : seed_(seed), mountains_m_(mountains_m) {}

  /// Fills the columns of a region.
  void columns(RegionPos region, const Materials& materials, Columns& out) const;
  /// The same height as columns() gives.
  int32_t height(int32_t x, int32_t z) const;
  uint64_t seed() const { return seed_; }

 private:
  static constexpr int kMaxRow = Columns::kSide;
  struct Row {
    std::array<int32_t, kMaxRow> height, rise, overhang;
  };
  void row(int32_t x, int32_t z, int count, Row& out) const;
  void carve_lake(int32_t x, int32_t z, int count, int32_t valley, int32_t lake, int32_t* height) const;
  int32_t valley_centre(int32_t valley, int32_t z) const;
  void cover(const Materials& materials, const std::array<int32_t, Columns::kSide * Columns::kSide>& rise,
             Columns& out) const;

  uint64_t seed_;
  int32_t mountains_m_;
};

}  // namespace world::landscape
