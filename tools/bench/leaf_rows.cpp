#include "tools/bench/leaf_rows.h"

#include <array>
#include <cmath>

#include "tools/bench/world_copy.h"
#include "world/base/random.h"

namespace tools {

namespace {

using world::BlockId;
using world::IntLayer;
using world::kLeafVoxels;
using world::LeafMask;
using world::LeafPos;
using world::LeafWrite;
using world::RegionPos;
using world::Store;
using world::World;

constexpr size_t kLeaves = 4096;  // 2 M voxels
constexpr double kVoxels = double{kLeaves} * kLeafVoxels;
constexpr auto kRules = {world::MaskKind::occupied, world::MaskKind::granular, world::MaskKind::liquid};

double voxels_or_nan(bool ok) { return ok ? kVoxels : std::nan(""); }

/// 512 x 256 x 512 voxels of the valley with the masks that rules of matter walk.
std::shared_ptr<World> part_of(const World& valley) {
  const RegionPos low = world::region_from_voxel(region_box(valley.store).min) + RegionPos{2, 0, 2};
  auto part = std::make_shared<World>(copy_regions(valley, low, low + RegionPos{3, 1, 3}));
  for (const world::MaskKind kind : kRules) (void)part->store.masks(kind);
  return part;
}

/// What a step of a rule writes and takes back: two versions of leaves of which a tenth of the voxels differ, pairs
/// that have changed their places.
struct Step {
  std::vector<std::array<BlockId, kLeafVoxels>> blocks[2];
  std::vector<LeafWrite> writes[2];
  world::EditBatch changes[2], all[2];
};

std::shared_ptr<const Step> step_of(const Store& store, uint64_t seed) {
  auto step = std::make_shared<Step>();
  std::vector<LeafPos> leaves = store.mixed_leaves();
  leaves.resize(std::min(leaves.size(), kLeaves));
  for (auto& blocks : step->blocks) blocks.resize(kLeaves);
  for (size_t n = 0; n < kLeaves; ++n) {
    const LeafPos l = leaves[n % leaves.size()];
    auto &now = step->blocks[0][n], &next = step->blocks[1][n];
    for (int i = 0; i < kLeafVoxels; ++i) now[static_cast<size_t>(i)] = store.leaf(l)[i];
    next = now;
    for (int i = 0; i < kLeafVoxels / 10 / 2; ++i) {
      const uint64_t draw = world::random_bits(seed, static_cast<int64_t>(n), i, 0);
      std::swap(next[draw % kLeafVoxels], next[draw / kLeafVoxels % kLeafVoxels]);
    }
    for (size_t v = 0; v < 2; ++v) {
      step->writes[v].push_back({l, step->blocks[v][n].data()});
      for (int i = 0; i < kLeafVoxels; ++i) {
        const world::VoxelPos at = world::voxel_from_leaf(l) + world::offset_in_leaf(i);
        const BlockId block = step->blocks[v][n][static_cast<size_t>(i)];
        step->all[v].set(at, block);
        if (now[static_cast<size_t>(i)] != next[static_cast<size_t>(i)]) step->changes[v].set(at, block);
      }
    }
  }
  return step;
}

Result<Prepared> prepare_write_leaves(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  const auto ours = part_of(*valley), theirs = part_of(*valley), plainly = part_of(*valley);
  if (ours->store.mixed_leaves().size() < kLeaves) return world::input_error("the valley has too few mixed leaves");
  const auto step = step_of(ours->store, context.seed());
  const auto turns = std::make_shared<std::array<size_t, 3>>();
  return Prepared{
      .ours = {"write_leaves, with census, dirty set and three masks",
               [=] { return voxels_or_nan(ours->store.write_leaves(step->writes[++(*turns)[0] % 2]).ok()); }},
      .rivals = {{"apply of the voxels that change",
                  [=] { return voxels_or_nan(theirs->store.apply(step->changes[++(*turns)[1] % 2]).ok()); }},
                 {"apply of every voxel",
                  [=] { return voxels_or_nan(plainly->store.apply(step->all[++(*turns)[2] % 2]).ok()); }}},
      .counters =
          [=] {
            return std::map<std::string, double>{
                {"leaves", double{kLeaves}}, {"voxels_changed", static_cast<double>(step->changes[0].ops().size())}};
          },
      .check = [=]() -> Status {
        for (const size_t v : {1u, 0u}) {
          TRY([[maybe_unused]] const auto a, ours->store.write_leaves(step->writes[v]));
          TRY([[maybe_unused]] const auto b, theirs->store.apply(step->changes[v]));
          if (ours->store.content_hash() != theirs->store.content_hash() ||
              ours->store.census() != theirs->store.census())
            return world::input_error("the two stores differ");
        }
        return {};
      }};
}

/// A layer with values in half of the voxels of 16^3 leaves.
struct FilledLayer {
  IntLayer layer;
  std::vector<LeafPos> leaves;
  std::array<int32_t, kLeafVoxels> values;
  LeafMask active;
};

std::shared_ptr<FilledLayer> filled_layer() {
  auto filled = std::make_shared<FilledLayer>();
  for (int i = 0; i < kLeafVoxels; ++i) filled->values[static_cast<size_t>(i)] = 4096 - 8 * i;
  for (uint64_t& word : filled->active.word) word = 0x5555aaaa33330f0full;
  for (int i = 0; i < world::kLeavesPerRegion; ++i) {
    filled->leaves.push_back(world::leaf_offset_in_region(i));
    filled->layer.write_leaf(filled->leaves.back(), filled->values, filled->active);
  }
  return filled;
}

Result<Prepared> prepare_layer_write(BenchContext&) {
  const auto ours = filled_layer(), theirs = filled_layer();
  return Prepared{.ours = {"IntLayer::write_leaf",
                           [=] {
                             ++ours->values[0];
                             for (const LeafPos& l : ours->leaves)
                               ours->layer.write_leaf(l, ours->values, ours->active);
                             return kVoxels;
                           }},
                  .rivals = {{"OpenVDB by its tree, a voxel at a time",
                              [=] {
                                ++theirs->values[0];
                                for (const LeafPos& l : theirs->leaves)
                                  for (int i = 0; i < kLeafVoxels; ++i)
                                    if (theirs->active.test(i))
                                      theirs->layer.set(world::voxel_from_leaf(l) + world::offset_in_leaf(i),
                                                        theirs->values[static_cast<size_t>(i)]);
                                return kVoxels;
                              }}},
                  .check = [=]() -> Status {
                    if (ours->layer.active_voxels() == theirs->layer.active_voxels()) return {};
                    return world::input_error("the two layers differ");
                  }};
}

Result<Prepared> prepare_layer_read(BenchContext&) {
  const auto filled = filled_layer();
  const auto ours = [=] {
    int64_t sum = 0;
    std::array<int32_t, kLeafVoxels> values;
    LeafMask active;
    for (const LeafPos& l : filled->leaves)
      if (filled->layer.read_leaf(l, values, active)) sum += values[0] + values[511] + active.count();
    return sum;
  };
  const auto theirs = [=] {
    int64_t sum = 0;
    std::array<int32_t, kLeafVoxels> values;
    for (const LeafPos& l : filled->leaves) {
      filled->layer.read_cube(world::voxel_from_leaf(l), world::kLeafSize, INT32_MIN, values);
      int active = 0;
      for (const int32_t v : values) active += v != INT32_MIN;
      sum += (values[0] == INT32_MIN ? 0 : values[0]) + (values[511] == INT32_MIN ? 0 : values[511]) + active;
    }
    return sum;
  };
  const auto timed = [](auto work) {
    return [=] {
      const int64_t sum = work();
      keep(sum);
      return kVoxels;
    };
  };
  return Prepared{.ours = {"IntLayer::read_leaf", timed(ours)},
                  .rivals = {{"OpenVDB's accessor", timed(theirs)}},
                  .check = [=]() -> Status {
                    if (ours() == theirs()) return {};
                    return world::input_error("the sums differ");
                  }};
}

}  // namespace

void add_leaf_rows(Registry& registry) {
  registry.add({.name = "write_leaves",
                .what = "4096 leaves of the valley, of which a rule has changed a tenth of the voxels",
                .unit = "M voxels/s",
                .scale = 1e6,
                .threads = 1,
                .reach = Reach{512, "1 us a leaf of 512 voxels: what a rule of matter takes itself"},
                .prepare = prepare_write_leaves});
  registry.add({.name = "layer_write",
                .what = "4096 leaves of a layer of integers, half of the voxels active",
                .unit = "M voxels/s",
                .scale = 1e6,
                .threads = 1,
                .reach = Reach{512, "1 us a leaf of 512 voxels"},
                .prepare = prepare_layer_write});
  registry.add({.name = "layer_read",
                .what = "4096 leaves of a layer of integers and which of their voxels are active",
                .unit = "M voxels/s",
                .scale = 1e6,
                .threads = 1,
                .reach = Reach{512, "1 us a leaf of 512 voxels"},
                .prepare = prepare_layer_read});
}

}  // namespace tools
