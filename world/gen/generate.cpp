// The registry of generators - each file world/gen/NAME.cpp exposes `GeneratorInfo NAME_generator()` - and the loop
// that runs one over a box.
#include "world/gen/generator.h"

#include <algorithm>
#include <mutex>

#include "world/base/jobs.h"
#include "world/base/text.h"

namespace world {

#define GENERATOR(name) GeneratorInfo name##_generator();
#include "world_gen.list.h"
#undef GENERATOR

namespace {

/// The info with a `make` that checks names and fills defaults before the member's own runs.
GeneratorInfo with_checked_parameters(GeneratorInfo info) {
  info.make = [name = info.name, defaults = info.parameters, make = info.make](
                  uint64_t seed, const std::map<std::string, double>& given,
                  const BlockPalette& palette) -> Result<std::unique_ptr<Generator>> {
    std::map<std::string, double> parameters = defaults;
    for (const auto& [key, value] : given) {
      const auto known = parameters.find(key);
      if (known != parameters.end()) {
        known->second = value;
        continue;
      }
      std::vector<std::string> names;
      for (const auto& [other, unused] : defaults) names.push_back(other);
      const std::string near = nearest_text(key, names);
      return input_error("generator '" + name + "' has no parameter '" + key + "'" +
                         (near.empty() ? "" : " (did you mean '" + near + "'?)"));
    }
    return make(seed, parameters, palette);
  };
  return info;
}

// A region's node alone takes 33 KiB, so this many take 1 GiB before their first leaf.
constexpr uint64_t kMostRegions = 1u << 15;

/// Turns the region's voxels outside the box into air.
void cut(RegionBuilder& region, const VoxelBox& box) {
  const LeafPos first = leaf_from_region(region.pos());
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    const VoxelPos low = voxel_from_leaf(first + leaf_offset_in_region(i)), high = low + VoxelPos{7, 7, 7};
    if (box.contains(low) && box.contains(high)) continue;
    const LeafBlocks blocks = region.leaf(i);
    if (!blocks.values && blocks.uniform == kAir) continue;
    BlockId values[kLeafVoxels];
    for (int v = 0; v < kLeafVoxels; ++v) values[v] = box.contains(low + offset_in_leaf(v)) ? blocks[v] : kAir;
    region.set_leaf(i, values);
  }
}

}  // namespace

const std::vector<GeneratorInfo>& generators() {
  static const std::vector<GeneratorInfo> all = {
#define GENERATOR(name) with_checked_parameters(name##_generator()),
#include "world_gen.list.h"
#undef GENERATOR
  };
  return all;
}

Result<std::unique_ptr<Generator>> make_generator(const std::string& name, uint64_t seed,
                                                  const std::map<std::string, double>& parameters,
                                                  const BlockPalette& palette) {
  std::vector<std::string> names;
  for (const GeneratorInfo& info : generators()) {
    if (info.name == name) return info.make(seed, parameters, palette);
    names.push_back(info.name);
  }
  std::string list;
  for (const std::string& known : names) list += (list.empty() ? "" : ", ") + known;
  const std::string near = nearest_text(name, names);
  return input_error("unknown generator '" + name + "'" + (near.empty() ? "" : " (did you mean '" + near + "'?)") +
                     "; there are " + list);
}

Result<BlockId> needed_block(const BlockPalette& palette, const std::string& name) {
  if (const auto id = palette.find(name)) return *id;
  return input_error("the generator needs the block '" + name +
                     "', which the palette lacks; start from the standard blocks");
}

Status generate(Store& store, const Generator& generator, const VoxelBox& box) {
  if (box.empty()) return {};
  if (!inside_world(box.min) || !inside_world(box.max))
    return input_error("the box to generate reaches past the world's border, +-" + std::to_string(kWorldBorder) +
                       " voxels");
  const RegionPos low = region_from_voxel(box.min), high = region_from_voxel(box.max);
  const int64_t nx = int64_t{high.x} - low.x + 1, ny = int64_t{high.y} - low.y + 1, nz = int64_t{high.z} - low.z + 1;
  const uint64_t regions = VoxelBox{{low.x, low.y, low.z}, {high.x, high.y, high.z}}.volume();
  if (regions > kMostRegions)
    return input_error("the box to generate covers " + with_thousands(regions) +
                       " regions of 128^3 voxels, and at most " + with_thousands(kMostRegions) +
                       " fit in memory: choose a smaller size");
  // Adopting is serial, in whichever order regions finish: the store is the same for any order.
  std::mutex adopting;
  parallel_for(static_cast<size_t>(nx * ny * nz), [&](size_t i) {
    const int64_t n = static_cast<int64_t>(i);
    // Regions above each other come one after the other: generators may keep what they share.
    const RegionPos pos{low.x + static_cast<int32_t>(n / (ny * nz)), low.y + static_cast<int32_t>(n % ny),
                        low.z + static_cast<int32_t>(n / ny % nz)};
    RegionBuilder region(pos);
    generator.generate(region);
    const VoxelPos first = voxel_from_region(pos), last = first + VoxelPos{127, 127, 127};
    if (!box.contains(first) || !box.contains(last)) cut(region, box);
    const std::lock_guard lock(adopting);
    store.adopt(std::move(region));
  });
  return {};
}

Status hold_sides(Store& store, const Generator& generator, const VoxelBox& box) {
  EditBatch batch;
  for (int32_t x = box.min.x; x <= box.max.x; ++x)
    for (int32_t z = box.min.z; z <= box.max.z; ++z) {
      const int32_t inwards = std::min({x - box.min.x, box.max.x - x, z - box.min.z, box.max.z - z});
      if (inwards > 1) {
        z = std::max(z, box.max.z - 2);
        continue;
      }
      for (int32_t y = box.min.y; y <= box.max.y; ++y) {
        const BlockId block = store.get({x, y, z}), held = generator.at_side(block);
        if (held == block) continue;
        // One voxel from the side only what may roll over the edge.
        bool open = inwards == 0;
        for (const VoxelPos step : {VoxelPos{1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}}) {
          const VoxelPos beside = VoxelPos{x, y, z} + step;
          const bool at_side =
              beside.x == box.min.x || beside.x == box.max.x || beside.z == box.min.z || beside.z == box.max.z;
          open |= at_side && store.get(beside) == kAir;
        }
        if (open) batch.set({x, y, z}, held);
      }
    }
  TRY(const EditReport report, store.apply(batch));
  static_cast<void>(report);
  return {};
}

}  // namespace world
