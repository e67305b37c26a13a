/// Worlds for tests of light: random blocks of every kind, and the reference that lights them voxel by voxel.
#pragma once

#include <gtest/gtest.h>

#include "sim/light/flood.h"
#include "tools/bench/rivals/light_queue.h"
#include "world/base/random.h"
#include "world/world.h"

namespace sim {

using world::BlockId;
using world::VoxelBox;
using world::VoxelPos;

/// Blocks named after what they do to light: by id, air first.
struct LightBlocks {
  world::BlockPalette palette;
  LightRules rules;

  LightBlocks() { add_optics({.loss = 1, .passes_sky = true}); }
  BlockId add(const std::string& name, BlockOptics optics) {
    return add(name, {optics, optics, optics}, optics.loss == 0);
  }
  BlockId add(const std::string& name, std::array<BlockOptics, 3> bands, bool opaque) {
    world::Block block;
    block.name = name;
    block.opaque = opaque;
    const BlockId id = *palette.add(block);
    rules.bands.push_back(bands);
    rules.all_bands.push_back(brightest(bands));
    return id;
  }

 private:
  void add_optics(BlockOptics o) {
    rules.bands.push_back({o, o, o});
    rules.all_bands.push_back(o);
  }
};

/// Of every kind: closed, dark and slow ones; sources that are closed, open, slow; blocks whose opacity to the eye says
/// otherwise.
inline LightBlocks every_kind_of_block() {
  LightBlocks blocks;
  blocks.add("stone", {.loss = 0});
  blocks.add("dirt", {.loss = 0});
  blocks.add("lamp_15", {.loss = 0, .level = 15});
  blocks.add("lamp_7", {.loss = 0, .level = 7});
  blocks.add("torch_14", {.loss = 1, .level = 14, .passes_sky = true});
  blocks.add("lantern_15", {.loss = 1, .level = 15, .passes_sky = true});
  blocks.add("water", {.loss = 1});
  blocks.add("glass", {.loss = 2});
  blocks.add("tinted", {.loss = 5});
  blocks.add("thick", {.loss = 15});
  blocks.add("glowing_water", {.loss = 3, .level = 4});
  const BlockOptics clear{.loss = 1, .passes_sky = true}, shut{.loss = 0};
  blocks.add("looks_opaque", {clear, clear, clear}, true);
  blocks.add("looks_clear", {shut, shut, shut}, false);
  return blocks;
}

inline uint64_t bits(uint64_t seed, int64_t i, int64_t j = 0) { return world::random_bits(seed, i, j, 7); }

/// All light of the store's blocks by the queue, with 16 voxels of air around them.
inline tools::LightQueue light_by_queue(const world::Store& store, const LightRules& rules) {
  VoxelBox box = store.bounds();
  if (box.empty()) box = {{0, 0, 0}, {0, 0, 0}};
  const VoxelPos margin{16, 16, 16};
  tools::LightQueue queue({box.min - margin, box.max + margin}, rules.sky_level, rules.all_bands);
  world::StoreReader reader(store);
  const VoxelBox all = queue.box();
  for (int x = all.min.x; x <= all.max.x; ++x)
    for (int y = all.min.y; y <= all.max.y; ++y)
      for (int z = all.min.z; z <= all.max.z; ++z) queue.put({x, y, z}, static_cast<uint8_t>(reader.get({x, y, z})));
  queue.light_all();
  return queue;
}

/// That each voxel around the blocks has the levels of the queue.
inline void expect_equal_to_queue(const world::Store& store, const FloodLight& light, const std::string& where) {
  const tools::LightQueue queue = light_by_queue(store, light.rules());
  const VoxelBox all = queue.box();
  size_t wrong = 0;
  for (int x = all.min.x; x <= all.max.x; ++x)
    for (int y = all.min.y; y <= all.max.y; ++y)
      for (int z = all.min.z; z <= all.max.z; ++z) {
        const VoxelPos v{x, y, z};
        const int sky = light.volume().sky().get(v), block = light.volume().block().get(v);
        if (sky == queue.sky(v) && block == queue.lamps(v)) continue;
        if (++wrong <= 5)
          ADD_FAILURE() << where << ": at " << x << ", " << y << ", " << z << " sky " << sky << " should be "
                        << queue.sky(v) << ", lamps " << block << " should be " << queue.lamps(v) << ", block "
                        << store.palette()[store.get(v)].name;
      }
  EXPECT_EQ(wrong, 0u) << where;
}

}  // namespace sim
