// Every other cube of `cell_m` voxels is stone: the most faces that a world can have, at cell_m = 1.
#include "world/gen/generator.h"

namespace world {
namespace {

class Checkerboard : public Generator {
 public:
  Checkerboard(int32_t cell, BlockId block) : cell_(cell), block_(block) {}

  void generate(RegionBuilder& region) const override {
    const LeafPos first = leaf_from_region(region.pos());
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const VoxelPos low = voxel_from_leaf(first + leaf_offset_in_region(i));
      BlockId values[kLeafVoxels];
      for (int v = 0; v < kLeafVoxels; ++v) {
        const VoxelPos p = low + offset_in_leaf(v);
        values[v] = ((cell(p.x) ^ cell(p.y) ^ cell(p.z)) & 1) ? kAir : block_;
      }
      region.set_leaf(i, values);
    }
  }

 private:
  int32_t cell(int32_t c) const { return c >= 0 ? c / cell_ : -((-c - 1) / cell_) - 1; }
  int32_t cell_;
  BlockId block_;
};

}  // namespace

GeneratorInfo checkerboard_generator() {
  GeneratorInfo info{"checkerboard", "every other cube is stone", {{"cell_m", 1}}, {}};
  info.make = [](uint64_t, const std::map<std::string, double>& parameters,
                 const BlockPalette& palette) -> Result<std::unique_ptr<Generator>> {
    TRY(const BlockId stone, needed_block(palette, "stone"));
    const double cell = parameters.at("cell_m");
    if (!(cell >= 1 && cell <= 1024)) return input_error("generator 'checkerboard': cell_m must be in [1, 1024]");
    return std::unique_ptr<Generator>(std::make_unique<Checkerboard>(static_cast<int32_t>(cell), stone));
  };
  return info;
}

}  // namespace world
