// Level ground: stone, soil and turf up to a height; under a chosen depth of water where asked for.
#include "world/gen/generator.h"

#include <algorithm>
#include <cmath>

namespace world {
namespace {

class Flat : public Generator {
 public:
  Flat(int64_t ground, int64_t water_top, BlockId stone, BlockId dirt, BlockId grass, BlockId water, BlockId glass)
      : ground_(ground),
        water_top_(water_top),
        stone_(stone),
        dirt_(dirt),
        grass_(grass),
        water_(water),
        glass_(glass) {}

  void generate(RegionBuilder& region) const override {
    for (int ly = 0; ly < kRegionLeaves; ++ly) {
      const int64_t y0 = int64_t{voxel_from_region(region.pos()).y} + ly * kLeafSize;
      BlockId rows[kLeafSize], values[kLeafVoxels];
      for (int y = 0; y < kLeafSize; ++y) rows[y] = at(y0 + y);
      for (int v = 0; v < kLeafVoxels; ++v) values[v] = rows[v >> 3 & 7];
      const bool uniform = std::all_of(rows, rows + kLeafSize, [&](BlockId b) { return b == rows[0]; });
      if (uniform && rows[0] == kAir) continue;
      for (int lx = 0; lx < kRegionLeaves; ++lx)
        for (int lz = 0; lz < kRegionLeaves; ++lz) {
          const int leaf = index_in_region({lx, ly, lz});
          if (uniform)
            region.set_uniform(leaf, rows[0]);
          else
            region.set_leaf(leaf, values);
        }
    }
  }
  BlockId at_side(BlockId block) const override { return block == water_ ? glass_ : block; }

 private:
  BlockId at(int64_t y) const {
    if (y >= ground_) return y < water_top_ ? water_ : kAir;
    return y == ground_ - 1 && water_top_ <= ground_ ? grass_ : y >= ground_ - 4 ? dirt_ : stone_;
  }
  int64_t ground_, water_top_;
  BlockId stone_, dirt_, grass_, water_, glass_;
};

}  // namespace

GeneratorInfo flat_generator() {
  GeneratorInfo info{"flat", "level ground of stone, soil and turf", {{"ground_m", 16}, {"water_depth_m", 0}}, {}};
  info.make = [](uint64_t, const std::map<std::string, double>& parameters,
                 const BlockPalette& palette) -> Result<std::unique_ptr<Generator>> {
    TRY(const BlockId stone, needed_block(palette, "stone"));
    TRY(const BlockId dirt, needed_block(palette, "dirt"));
    TRY(const BlockId grass, needed_block(palette, "grass"));
    TRY(const BlockId water, needed_block(palette, "water"));
    TRY(const BlockId glass, needed_block(palette, "glass"));
    const double ground = parameters.at("ground_m"), depth = parameters.at("water_depth_m");
    if (!(std::abs(ground) <= kWorldBorder)) return input_error("generator 'flat': ground_m must lie within the world");
    if (!(depth >= 0 && depth <= kWorldBorder))
      return input_error("generator 'flat': water_depth_m must be at least 0 and lie within the world");
    const int64_t top = static_cast<int64_t>(std::floor(ground));
    return std::unique_ptr<Generator>(
        std::make_unique<Flat>(top, top + static_cast<int64_t>(std::floor(depth)), stone, dirt, grass, water, glass));
  };
  return info;
}

}  // namespace world
