#include "sim/matter/liquid_layers.h"

#include <algorithm>

#include "sim/matter/sides.h"
#include "world/base/random.h"

namespace sim {

using world::BlockId;

LiquidLayers::Place LiquidLayers::beside(const Cells& cells, Place at, int face) {
  const world::VoxelPos step = world::face_step(static_cast<world::Face>(face));
  const world::VoxelPos o = world::offset_in_leaf(at.index) + step;
  const bool inside = ((o.x | o.y | o.z) & ~7) == 0;
  const PageId page =
      inside ? at.page : cells.around(at.page)[static_cast<size_t>(around_index(step.x, step.y, step.z))];
  return {page, world::index_in_leaf(o)};
}

float LiquidLayers::density(const Cells& cells, Place at) {
  const BlockId* blocks = cells.find_blocks(at.page);
  if (!blocks) return 0;
  const BlockTraits& traits = cells.traits()[blocks[at.index]];
  return traits.content == Content::liquid ? traits.density : 0;
}

/// Whether two liquids lie in the page, or one in it and another across a side or below.
bool LiquidLayers::holds_two(const Cells& cells, PageId p) {
  BlockId first = world::kAir;
  const auto look = [&](PageId of) {
    const BlockId* blocks = cells.find_blocks(of);
    if (!blocks) return false;
    BlockId last = world::kAir;
    for (int i = 0; i < world::kLeafVoxels; ++i) {
      const BlockId id = blocks[i];
      if (id == last || id == first) continue;
      last = id;
      if (cells.traits()[id].content != Content::liquid) continue;
      if (first != world::kAir) return true;
      first = id;
    }
    return false;
  };
  if (look(p)) return true;
  if (first == world::kAir) return false;
  for (const world::VoxelPos step : {world::VoxelPos{0, -1, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 0, 1}, {0, 0, -1}})
    if (look(cells.around(p)[static_cast<size_t>(around_index(step.x, step.y, step.z))])) return true;
  return false;
}

/// Whether a voxel of that density goes to the side: from the foot of its column, or from its top.
LiquidLayers::Way LiquidLayers::way(const Cells& cells, Place from, float own, int face) {
  constexpr int kWay = 7;  // no further than the next leaf
  Place to = beside(cells, from, face);
  if (!is_lighter(cells, to, own)) return Way::none;
  // Something denser is about to sink there.
  if (density(cells, beside(cells, to, world::kFacePosY)) > density(cells, to)) return Way::none;
  if (density(cells, beside(cells, from, world::kFacePosY)) >= own)
    return is_lighter(cells, beside(cells, to, world::kFaceNegY), own) ? Way::none : Way::foot;
  for (int k = 0; k < kWay; ++k) {
    if (is_lighter(cells, beside(cells, to, world::kFaceNegY), own)) return Way::top;
    to = beside(cells, to, face);
    if (!is_lighter(cells, to, own)) break;
  }
  return Way::none;
}

uint64_t LiquidLayers::changes_around(const Cells& cells, PageId p) {
  uint64_t sum = 0;
  for (const PageId q : cells.around(p)) sum += cells.content_changes(q);
  return sum;
}

/// Returns whether a voxel would change places, if its turn came.
bool LiquidLayers::find_pairs(const Cells& cells, PageId p, uint64_t tick, uint64_t turn) {
  const bool downwards = tick % 2 == 0;
  const Way of_turn = downwards ? Way::none : tick % 4 == 1 ? Way::foot : Way::top;
  const int side = static_cast<int>(turn & 3);
  const int parity = static_cast<int>(downwards ? tick >> 1 & 1 : turn >> 2 & 1);
  const bool along_x = kSideStep[side].x != 0;
  bool restless = false;
  for (int i = 0; i < world::kLeafVoxels; ++i) {
    const Place at{p, i};
    const float own = density(cells, at);
    if (own == 0) continue;
    // Leaves lie at multiples of eight: parity in the leaf is that in the world.
    const world::VoxelPos o = world::offset_in_leaf(i);
    const Place below = beside(cells, at, world::kFaceNegY);
    if (is_lighter(cells, below, own)) {
      restless = true;
      if (downwards && (o.y & 1) == parity) pairs_.push_back({at, below});
      continue;
    }
    for (int d = 0; d < kSides; ++d) {
      const Way goes = way(cells, at, own, kSideFace[d]);
      if (goes == Way::none) continue;
      restless = true;
      if (goes == of_turn && d == side && ((along_x ? o.x : o.z) & 1) == parity)
        pairs_.push_back({at, beside(cells, at, kSideFace[d])});
    }
  }
  return restless;
}

uint64_t LiquidLayers::exchange(Cells& cells, std::span<const PageId> pages, size_t rule, uint64_t tick,
                                uint64_t seed) {
  // What was woken, and where something changed within reach.
  is_mixed_.resize(cells.page_limit(), 0);
  list_.clear();
  std::erase_if(mixed_, [&](Mixed& m) {
    if (changes_around(cells, m.page) == m.changes) return false;
    is_mixed_[m.page] = 0;
    list_.push_back(m.page);
    return true;
  });
  for (const PageId p : pages)
    if (!is_mixed_[p]) list_.push_back(p);
  std::sort(list_.begin(), list_.end());
  list_.erase(std::unique(list_.begin(), list_.end()), list_.end());
  std::erase_if(list_, [&](PageId p) { return !holds_two(cells, p); });
  for (const PageId p : list_) cells.open_around(p);

  pairs_.clear();
  const uint64_t turn = world::hash_combine(seed, tick);
  for (const PageId p : list_) {
    const bool restless = find_pairs(cells, p, tick, turn);
    if (restless) cells.awake(rule).add(p);
    is_mixed_.resize(cells.page_limit(), 0);
    // One that goes on is looked at next time anyway.
    mixed_.push_back({p, restless ? 0 : changes_around(cells, p)});
    is_mixed_[p] = 1;
  }
  for (const Pair& pair : pairs_) {
    const Cell a = cells.cell(pair.a.page, pair.a.index), b = cells.cell(pair.b.page, pair.b.index);
    cells.put(pair.a.page, pair.a.index, b);
    cells.put(pair.b.page, pair.b.index, a);
    for (const Place& at : {pair.a, pair.b}) changed_.add(cells, at.page, at.index);
  }
  return changed_.stir(cells);
}

}  // namespace sim
