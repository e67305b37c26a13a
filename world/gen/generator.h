/// Worlds as functions of (seed, region): any region made alone equals the same region of the whole.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "world/base/errors.h"
#include "world/blocks/block.h"
#include "world/space/coords.h"
#include "world/store/store.h"

namespace world {

/// One run of one generator: its parameters bound, its blocks looked up. Const calls run on any thread.
class Generator {
 public:
  virtual ~Generator() = default;
  /// Fills the region. Results are the same on every machine, SIMD level, thread count and order of calls.
  virtual void generate(RegionBuilder& region) const = 0;
  /// What stands in place of a block at the side of a world that ends there: it would run or slide out.
  virtual BlockId at_side(BlockId block) const { return block; }
};

struct GeneratorInfo {
  std::string name;
  std::string what;
  /// Parameter names with defaults; unknown ones are an error.
  std::map<std::string, double> parameters;
  /// `parameters` may leave out what has a default. Fails where a parameter is unknown or the palette lacks a block.
  std::function<Result<std::unique_ptr<Generator>>(uint64_t seed, const std::map<std::string, double>& parameters,
                                                   const BlockPalette& palette)>
      make;
};

/// One a file of world/gen/, sorted by name.
const std::vector<GeneratorInfo>& generators();

/// The generator of that name, made; the error names the nearest known one.
Result<std::unique_ptr<Generator>> make_generator(const std::string& name, uint64_t seed,
                                                  const std::map<std::string, double>& parameters,
                                                  const BlockPalette& palette);

/// The id of a block that a generator needs.
Result<BlockId> needed_block(const BlockPalette& palette, const std::string& name);

/// Generates all regions that meet the box, in parallel, and adopts them. Voxels outside the box but inside those
/// regions are cut off to air.
Status generate(Store& store, const Generator& generator, const VoxelBox& box);

/// Puts a generator's blocks for sides along the four sides of a box that was generated, so that all stays in it.
Status hold_sides(Store& store, const Generator& generator, const VoxelBox& box);

}  // namespace world
