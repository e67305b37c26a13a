// Each voxel by itself: filled with the chance `density`, by one of several blocks. The worst case for every shortcut.
#include "world/gen/generator.h"

#include <array>
#include <cmath>

namespace world {
namespace {

constexpr std::array<const char*, 4> kNames = {"stone", "dirt", "sand", "glass"};

class Random : public Generator {
 public:
  Random(uint64_t seed, double density, std::array<BlockId, 4> blocks)
      : seed_(seed), threshold_(static_cast<uint64_t>(std::llround(density * 0x1p32))), blocks_(blocks) {}

  void generate(RegionBuilder& region) const override {
    const LeafPos first = leaf_from_region(region.pos());
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const VoxelPos low = voxel_from_leaf(first + leaf_offset_in_region(i));
      const uint64_t leaf_bits = random_bits(seed_, low.x, low.y, low.z);
      BlockId values[kLeafVoxels];
      for (int v = 0; v < kLeafVoxels; ++v) {
        const uint64_t bits = mix64(leaf_bits + static_cast<uint64_t>(v));
        values[v] = (bits >> 32) < threshold_ ? blocks_[bits & 3] : kAir;
      }
      region.set_leaf(i, values);
    }
  }

 private:
  uint64_t seed_, threshold_;  // threshold_: density * 2^32
  std::array<BlockId, 4> blocks_;
};

}  // namespace

GeneratorInfo random_generator() {
  GeneratorInfo info{"random", "each voxel by itself, filled with the chance `density`", {{"density", 0.5}}, {}};
  info.make = [](uint64_t seed, const std::map<std::string, double>& parameters,
                 const BlockPalette& palette) -> Result<std::unique_ptr<Generator>> {
    std::array<BlockId, 4> blocks;
    for (size_t i = 0; i < blocks.size(); ++i) {
      TRY(blocks[i], needed_block(palette, kNames[i]));
    }
    const double density = parameters.at("density");
    if (!(density >= 0 && density <= 1)) return input_error("generator 'random': density must be in [0, 1]");
    return std::unique_ptr<Generator>(std::make_unique<Random>(seed, density, blocks));
  };
  return info;
}

}  // namespace world
