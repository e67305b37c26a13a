/// What the tests of matter share: small worlds, and the rules once more, voxel by voxel over a dense box.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <string_view>
#include <vector>

#include "sim/matter/granular_kernel.h"
#include "sim/matter/matter.h"
#include "world/base/jobs.h"
#include "world/base/simd.h"
#include "world/world.h"

namespace sim {

inline world::BlockId block_named(const world::World& world, std::string_view name) {
  return world.palette->find(name).value();
}
inline void fill(world::World& world, const world::VoxelBox& box, world::BlockId block) {
  world::EditBatch batch;
  batch.fill(box, block);
  CHECK(world.store.apply(batch).ok());
}

/// A basin of stone, open at the top; inside of the box is air.
inline world::World basin(const world::VoxelBox& inside) {
  world::World world(world::standard_blocks());
  const world::VoxelPos one{1, 1, 1};
  fill(world, {inside.min - one, inside.max + world::VoxelPos{1, 0, 1}}, block_named(world, "granite"));
  fill(world, inside, world::kAir);
  return world;
}
/// The same with a ceiling.
inline world::World sealed_room(const world::VoxelBox& inside) {
  world::World world(world::standard_blocks());
  const world::VoxelPos one{1, 1, 1};
  fill(world, {inside.min - one, inside.max + one}, block_named(world, "granite"));
  fill(world, inside, world::kAir);
  return world;
}

/// run() makes a world, simulates it and returns a hash of its state: the same for any threads and instructions.
template <class Run>
void expect_the_same_for_any_threads_and_instructions(Run run) {
  const uint64_t first = run();
  for (const int threads : {1, 2, 3, 8}) {
    const world::ThreadLimit limit(threads);
    EXPECT_EQ(run(), first) << threads << " threads";
  }
  for (const world::SimdLevel& level : world::simd_levels()) {
    const world::SimdChoice choice(level);
    EXPECT_EQ(run(), first) << level.name;
  }
}

/// A dense box of blocks; outside of it all is closed. The rules are written here as their headers state them, with no
/// masks, pages or sleep.
class DenseMatter {
 public:
  DenseMatter(const world::World& world, const world::VoxelBox& box, uint64_t seed)
      : box_(box), seed_(seed), traits_(*world.palette) {
    world::StoreReader reader(world.store);
    for_each([&](world::VoxelPos v) { blocks_.push_back(reader.get(v)); });
  }

  world::BlockId get(world::VoxelPos v) const { return blocks_[index(v)]; }
  void step_granular(uint64_t tick) {
    // Decide.
    std::vector<int> goes(blocks_.size(), kStays);
    for_each([&](world::VoxelPos v) {
      if (!is_grain(v)) return;
      if (enters(v, v + kDown)) {
        goes[index(v)] = kFalls;
        return;
      }
      if (!occupied(v + kDown)) return;  // a liquid that bears it
      bool may[kSides];
      for (int d = 0; d < kSides; ++d) may[d] = may_slide(v, kSideStep[d]);
      const int d = first_of(may, v, tick, OrderStream::decide);
      if (d >= 0 && enters(v, v + kSideStep[d])) goes[index(v)] = d;
    });
    // Accept.
    std::vector<world::BlockId> next = blocks_;
    for_each([&](world::VoxelPos v) {
      if (occupied(v)) return;
      const world::VoxelPos above = v - kDown;
      if (inside(above) && goes[index(above)] == kFalls) {
        std::swap(next[index(v)], next[index(above)]);
        return;
      }
      bool comes[kSides];
      for (int d = 0; d < kSides; ++d) {
        const world::VoxelPos from = v - kSideStep[d];
        comes[d] = inside(from) && goes[index(from)] == d;
      }
      const int d = first_of(comes, v, tick, OrderStream::accept);
      if (d >= 0) std::swap(next[index(v)], next[index(v - kSideStep[d])]);
    });
    blocks_ = next;
  }

  template <class Visit>
  void for_each(Visit visit) const {
    for (int x = box_.min.x; x <= box_.max.x; ++x)
      for (int y = box_.min.y; y <= box_.max.y; ++y)
        for (int z = box_.min.z; z <= box_.max.z; ++z) visit(world::VoxelPos{x, y, z});
  }

 private:
  static constexpr int kStays = -1, kFalls = 4;
  static constexpr world::VoxelPos kDown{0, -1, 0};

  bool inside(world::VoxelPos v) const { return box_.contains(v); }
  size_t index(world::VoxelPos v) const {
    const world::VoxelPos d = v - box_.min, n = box_.max - box_.min + world::VoxelPos{1, 1, 1};
    return (static_cast<size_t>(d.x) * static_cast<size_t>(n.y) + static_cast<size_t>(d.y)) * static_cast<size_t>(n.z) +
           static_cast<size_t>(d.z);
  }
  const BlockTraits& traits(world::VoxelPos v) const { return traits_[get(v)]; }
  bool is_grain(world::VoxelPos v) const { return inside(v) && traits(v).content == Content::grain; }
  bool occupied(world::VoxelPos v) const {
    return !inside(v) || traits(v).content == Content::closed || traits(v).content == Content::grain;
  }
  bool enters(world::VoxelPos v, world::VoxelPos to) const {
    return !occupied(to) && !(traits(to).content == Content::liquid && traits(to).density >= traits(v).density);
  }
  bool may_slide(world::VoxelPos v, world::VoxelPos step) const {
    const world::VoxelPos side = v + step, two = side + step;
    if (occupied(side)) return false;
    const uint32_t rough = roughness(page_hash(v), world::index_in_leaf(v));
    if (!occupied(side + kDown)) return rough >= traits(v).steep_of || !occupied(side + kDown + kDown);
    return rough < traits(v).smooth_of && !occupied(two) && !occupied(two + kDown);
  }
  uint64_t page_hash(world::VoxelPos v) const {
    const world::LeafPos l = world::leaf_from_voxel(v);
    return world::random_bits(seed_, l.x, l.y, l.z);
  }
  int first_of(const bool* may, world::VoxelPos v, uint64_t tick, OrderStream stream) const {
    const RandomOrder order = random_order(page_hash(v), tick, stream);
    const int i = world::index_in_leaf(v);
    const int start = order.start_low.test(i) + 2 * order.start_high.test(i);
    for (int k = 0; k < kSides; ++k) {
      const int d = (order.reversed.test(i) ? start - k : start + k) & 3;
      if (may[d]) return d;
    }
    return -1;
  }

  world::VoxelBox box_;
  uint64_t seed_;
  MatterTraits traits_;
  std::vector<world::BlockId> blocks_;
};

/// Voxels of the box that differ.
inline size_t differences(const world::World& world, const DenseMatter& dense) {
  world::StoreReader reader(world.store);
  size_t count = 0;
  dense.for_each([&](world::VoxelPos v) { count += reader.get(v) != dense.get(v); });
  return count;
}

}  // namespace sim
