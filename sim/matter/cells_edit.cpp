/// What others change under the cells: edits, and regions that go and come.
#include <algorithm>

#include "sim/matter/cells.h"
#include "world/base/errors.h"

namespace sim {

using world::BlockId;
using world::LeafMask;
using world::LeafPos;
using world::RegionPos;
using world::VoxelBox;
using world::VoxelPos;

namespace {

/// Boxes of up to so many leaves open them as pages: they will be awake anyhow.
constexpr uint64_t kLeavesToOpen = 64;

VoxelBox box_of(LeafPos l) { return {world::voxel_from_leaf(l), world::voxel_from_leaf(l) + VoxelPos{7, 7, 7}}; }

VoxelBox both(const VoxelBox& a, const VoxelBox& b) {
  VoxelBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] = std::max(a.min[axis], b.min[axis]);
    box.max[axis] = std::min(a.max[axis], b.max[axis]);
  }
  return box;
}

template <class Visit>
void for_each_voxel(const VoxelBox& box, Visit visit) {
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) visit(VoxelPos{x, y, z});
}
/// Leaves, or regions, from one to another.
template <class Pos, class Visit>
void for_each_pos(Pos low, Pos high, Visit visit) {
  for (int x = low.x; x <= high.x; ++x)
    for (int y = low.y; y <= high.y; ++y)
      for (int z = low.z; z <= high.z; ++z) visit(Pos{x, y, z});
}

}  // namespace

// ---- edits of the store --------------------------------------------------------------------------------------------

bool Cells::follow_edits() {
  traits_.follow();
  met_.resize(traits_.size(), 0), booked_.resize(traits_.size());
  const std::vector<LeafPos> dirty = store_.take_dirty(subscriber_);
  const bool any = !dirty.empty() || !arrived_.empty();
  if (!any && settled()) return false;  // nothing is stirred that isn't awake
  for (const LeafPos& l : dirty) {
    const RegionPos r = world::region_from_leaf(l);
    if (away_.contains(r) || arrived_.contains(r)) continue;
    PageId p = find(l);
    if (p == kClosedPage) {
      if ((p = open(l)) == kClosedPage) continue;
    } else {
      CHECK(!unsaved_[p]);  // else the edit was made to blocks that had moved on: Matter::edit() may at any time
      reread(p);
    }
    // What the edit replaced isn't known any more, so that all of the leaf counts as changed.
    open_around(p);
    stir(p, world::kAllMask);
    unsaved_[p] = 0;
  }
  wake_arrived();
  spread();
  return any;
}

/// After an edit of the store: what it wrote is full, and as warm as its surroundings at rest. The layers say so.
void Cells::reread(PageId p) {
  if (heat_unsaved_[p]) {
    // Edited without a flush: what the page holds is newer than the layer, but where blocks differ.
    const world::LeafBlocks leaf = store_.leaf(pos_[p]);
    Blocks before;
    values_of(p, before);
    for (size_t i = 0; heats_[p] && i < before.size(); ++i)
      if (leaf[static_cast<int>(i)] != before[i]) (*heats_[p])[i] = 0;
  } else {
    heats_[p].reset();
    read_heats(p);
  }
  amounts_[p].reset();
  read(p, store_.leaf(pos_[p]));
  read_amounts(p, world::Layer::liquid, Content::liquid);
  read_amounts(p, world::Layer::gas, Content::gas);
  ++heat_changes_[p];
}

// ---- edits at any time ---------------------------------------------------------------------------------------------

void Cells::edit_page(PageId p, const VoxelBox& box, BlockId block) {
  const Cell now = {.block = block, .amount = static_cast<uint16_t>(is_fluid(block) ? kFullVoxel : 0)};
  LeafMask changed;
  for_each_voxel(box, [&](VoxelPos v) {
    const int i = world::index_in_leaf(v);
    if (this->block(p, i) == block) return;
    if (heats_[p] && (*heats_[p])[static_cast<size_t>(i)] != 0) stir_heat(p);
    transmute(p, i, now);
    changed.set(i);
  });
  if (changed.is_none()) return;
  open_around(p);
  stir(p, changed);
}

/// Books what a part of a leaf that isn't open holds now, and what it will.
void Cells::book_leaf(LeafPos l, const VoxelBox& box, BlockId block, Told& told) {
  std::map<BlockId, int64_t> gone;
  int64_t voxels = 0;
  const world::LeafBlocks leaf = store_.leaf(l);
  for_each_voxel(box, [&](VoxelPos v) {
    const BlockId was = leaf[world::index_in_leaf(v)];
    if (was == block) return;
    gone[was] += kFullVoxel;
    ++voxels;
  });
  std::array<int32_t, world::kLeafVoxels> value;
  LeafMask active;
  for (const world::Layer layer : {world::Layer::liquid, world::Layer::gas, world::Layer::heat}) {
    const world::IntLayer* values = store_.find_int_layer(layer);
    if (!values || !values->read_leaf(l, value, active)) continue;
    for_each_voxel(box, [&](VoxelPos v) {
      const int i = world::index_in_leaf(v);
      if (leaf[i] == block || !active.test(i)) return;  // the store leaves as it is what an edit doesn't change
      if (layer != world::Layer::heat) {
        gone[leaf[i]] += value[static_cast<size_t>(i)] - kFullVoxel;
        return;
      }
      book_heat(-static_cast<int64_t>(value[static_cast<size_t>(i)]));
      told.heat -= value[static_cast<size_t>(i)];
    });
  }
  for (const auto& [was, amount] : gone) {
    if (was != world::kAir) book(was, -amount);
    told.amounts[was] -= amount;
  }
  if (voxels == 0) return;
  if (block != world::kAir) book(block, voxels * kFullVoxel);
  told.amounts[block] += voxels * kFullVoxel;
}

void Cells::edit(const world::EditBatch& batch, Told& told, std::map<RegionPos, world::EditBatch>& waiting) {
  traits_.follow();
  met_.resize(traits_.size(), 0), booked_.resize(traits_.size());
  for (const world::EditBatch::Op& op : batch.ops()) {
    const LeafPos low = world::leaf_from_voxel(op.box.min), high = world::leaf_from_voxel(op.box.max);
    const bool is_small = VoxelBox{{low.x, low.y, low.z}, {high.x, high.y, high.z}}.volume() <= kLeavesToOpen;
    world::EditBatch to_store;
    for_each_pos(world::region_from_leaf(low), world::region_from_leaf(high), [&](RegionPos r) {
      const VoxelPos corner = world::voxel_from_region(r);
      constexpr int kLast = world::kRegionSize - 1;
      const VoxelBox in_region = both(op.box, {corner, corner + VoxelPos{kLast, kLast, kLast}});
      if (away_.contains(r)) {
        waiting[r].fill(in_region, op.block);
        return;
      }
      for_each_pos(world::leaf_from_voxel(in_region.min), world::leaf_from_voxel(in_region.max), [&](LeafPos l) {
        const VoxelBox box = both(op.box, box_of(l));
        if (const PageId p = is_small ? open(l) : find(l)) return edit_page(p, box, op.block);
        book_leaf(l, box, op.block, told);
        to_store.fill(box, op.block);
      });
    });
    if (to_store.empty()) continue;
    CHECK(store_.apply(to_store).ok());
    for (const LeafPos& l : store_.take_dirty(subscriber_))
      if (const PageId p = open(l)) {
        open_around(p);
        stir(p, world::kAllMask);
        unsaved_[p] = 0;
      }
  }
  spread();
}

// ---- what is awake -------------------------------------------------------------------------------------------------

bool Cells::may_move(const world::LeafBlocks& leaf, std::span<const uint8_t> also) const {
  const auto may = [&](BlockId id) {
    const Content c = traits_[id].content;
    return c == Content::grain || c == Content::liquid || c == Content::gas || (id < also.size() && also[id]);
  };
  if (!leaf.values) return may(leaf.uniform);
  return std::any_of(leaf.values, leaf.values + world::kLeafVoxels, may);
}

void Cells::wake_all(std::span<const uint8_t> also) {
  traits_.follow();
  met_.resize(traits_.size(), 0), booked_.resize(traits_.size());
  world::StoreReader reader(store_);
  const auto wake = [&](LeafPos l) {
    const PageId p = open(l);
    for (AwakeSet& set : awake_) set.add(p);
  };
  for (const RegionPos& r : store_.regions())
    for (int i = 0; i < world::kLeavesPerRegion; ++i) {
      const LeafPos l = world::leaf_from_region(r) + world::leaf_offset_in_region(i);
      if (may_move(reader.leaf(l), also)) wake(l);
    }
  // What was left warm or cold.
  if (const world::IntLayer* heat = store_.find_int_layer(world::Layer::heat))
    for (const LeafPos& l : heat->leaves()) wake(l);
}

void Cells::unload(RegionPos r) {
  if (!away_.insert(r).second) return;
  arrived_.erase(r);
  const Slots* slots = slots_.find(r);
  if (!slots) return;
  std::vector<PageId> pages;
  for (const PageId p : slots->page)
    if (p != kClosedPage) pages.push_back(p);
  const auto gone = [&](PageId p) { return world::region_from_leaf(pos_[p]) == r; };
  for (const PageId p : pages) {
    CHECK(!unsaved_[p] && !heat_unsaved_[p]);
    for (const PageId other : around_[p]) {
      if (other == kClosedPage || gone(other)) continue;
      ++version_[other], ++content_changes_[other];  // what rules know of it may say what was here
      for (AwakeSet& set : awake_) set.add(other);
    }
  }
  for (AwakeSet& set : awake_) set.remove(gone);
  for (const PageId p : pages) release(p);
}

void Cells::load(RegionPos r, std::span<const uint8_t> also) {
  if (away_.erase(r) == 0) return;
  arrived_[r].assign(also.begin(), also.end());
  floor_leaf_ = std::min(floor_leaf_, r.y * world::kRegionLeaves);
}

/// In regions that came, and in the leaves around: whatever waited at their border.
void Cells::wake_arrived() {
  if (arrived_.empty()) return;
  world::StoreReader reader(store_);
  for (const auto& arrived : arrived_) {
    const world::RegionPos r = arrived.first;
    const auto& also = arrived.second;
    const LeafPos first = world::leaf_from_region(r) - LeafPos{1, 1, 1};
    const LeafPos last = first + LeafPos{world::kRegionLeaves + 1, world::kRegionLeaves + 1, world::kRegionLeaves + 1};
    const auto inside = [&](LeafPos l) {
      return l.x >= first.x && l.y >= first.y && l.z >= first.z && l.x <= last.x && l.y <= last.y && l.z <= last.z;
    };
    const auto wake = [&](LeafPos l) {
      const PageId p = open(l);
      if (p == kClosedPage) return;
      ring_[p] = 0;                          // its neighbours may be there now,
      ++version_[p], ++content_changes_[p];  // and what rules know of it may say that they aren't
      for (AwakeSet& set : awake_) set.add(p);
    };
    for_each_pos(first, last, [&](LeafPos l) {
      if (find(l) != kClosedPage || may_move(reader.leaf(l), also)) wake(l);
    });
    if (const world::IntLayer* heat = store_.find_int_layer(world::Layer::heat))
      for (const LeafPos& l : heat->leaves())
        if (inside(l)) wake(l);
  }
  arrived_.clear();
}

}  // namespace sim
