#include "tools/play/history.h"

#include <algorithm>

namespace tools {

using world::BlockId;
using world::kLeafVoxels;
using world::LeafMask;
using world::LeafPos;

namespace {

std::vector<world::Layer> integer_layers() {
  std::vector<world::Layer> all;
  for (const world::LayerRow& row : world::layer_rows())
    if (row.is_integer) all.push_back(*world::layer_from_name(row.name));
  return all;
}

}  // namespace

History::History(world::World& world, size_t most_bytes)
    : world_(world), most_bytes_(most_bytes), subscriber_(world.store.subscribe()), known_(world.store) {
  for (const world::Layer layer : integer_layers()) {
    const world::IntLayer* values = world.store.find_int_layer(layer);
    if (!values) continue;
    for (const LeafPos& l : values->leaves()) {
      LayerChange now{l, {}, std::vector<int32_t>(kLeafVoxels)};
      if (values->read_leaf(l, std::span<int32_t, kLeafVoxels>(now.values.data(), kLeafVoxels), now.active))
        layers_[layer].emplace(l, std::move(now));
    }
  }
}

void History::close() {
  if (intervals_.empty() || intervals_.back().closed) return;
  Interval& open = intervals_.back();
  open.closed = true;
  Blocks scratch;
  for (const LeafPos& l : world_.store.take_dirty(subscriber_)) {
    const Blocks& before = known_.leaf(l, scratch);
    const world::LeafBlocks leaf = world_.store.leaf(l);
    LeafChange<BlockId> change{l, {}, {}};
    Blocks now;
    for (int i = 0; i < kLeafVoxels; ++i) {
      const size_t at = static_cast<size_t>(i);
      now[at] = leaf[i];
      if (now[at] == before[at]) continue;
      change.changed.set(i);
      change.values.push_back(before[at]);
    }
    if (change.values.empty()) continue;
    known_.learn(l, now);
    open.bytes += sizeof change + change.values.size() * sizeof(BlockId);
    open.blocks.push_back(std::move(change));
  }
  close_layers(open);
  closed_bytes_ += open.bytes;
}

void History::close_layers(Interval& open) {
  for (const world::Layer layer : integer_layers()) {
    const world::IntLayer* values = world_.store.find_int_layer(layer);
    auto& before = layers_[layer];
    if (!values && before.empty()) continue;
    std::unordered_map<LeafPos, LayerChange, world::PosHash> now;
    const auto keep = [&](const LayerChange& change) {
      open.bytes += sizeof change + change.values.size() * sizeof(int32_t);
      open.layers[layer].push_back(change);
    };
    if (values)
      for (const LeafPos& l : values->leaves()) {
        LayerChange leaf{l, {}, std::vector<int32_t>(kLeafVoxels)};
        if (!values->read_leaf(l, std::span<int32_t, kLeafVoxels>(leaf.values.data(), kLeafVoxels), leaf.active))
          continue;
        const auto was = before.find(l);
        if (was == before.end()) {
          keep({l, {}, {}});
        } else if (!(was->second.active == leaf.active) || was->second.values != leaf.values) {
          keep(was->second);
        }
        now.emplace(l, std::move(leaf));
      }
    for (const auto& [l, leaf] : before)
      if (!now.contains(l)) keep(leaf);
    // In an order that depends on places only.
    auto& kept = open.layers[layer];
    std::sort(kept.begin(), kept.end(), [](const LayerChange& a, const LayerChange& b) { return a.leaf < b.leaf; });
    if (kept.empty()) open.layers.erase(layer);
    before = std::move(now);
  }
}

void History::begin(uint64_t tick, std::optional<world::EditBatch> edit, world::VoxelPos around) {
  close();
  if (intervals_.empty()) {
    auto ignored = world_.store.take_dirty(subscriber_);
    (void)ignored;
  }
  if (edit) redo_.clear();
  Interval& next = intervals_.emplace_back();
  next.begin = {tick, world_.simulation.state, around};
  next.edit = std::move(edit);
  if (next.edit) next.bytes += next.edit->ops().size() * sizeof(world::EditBatch::Op);
  drop_oldest();
}

void History::merge(Interval& first, Interval&& second) {
  std::unordered_map<LeafPos, size_t, world::PosHash> at;
  for (size_t n = 0; n < first.blocks.size(); ++n) at[first.blocks[n].leaf] = n;
  for (LeafChange<BlockId>& later : second.blocks) {
    const auto found = at.find(later.leaf);
    if (found == at.end()) {
      first.blocks.push_back(std::move(later));
      continue;
    }
    // Of a voxel that changed in both, what it was before the first.
    LeafChange<BlockId>& earlier = first.blocks[found->second];
    LeafChange<BlockId> both{earlier.leaf, {}, {}};
    size_t e = 0, l = 0;
    for (int i = 0; i < kLeafVoxels; ++i) {
      const bool in_first = earlier.changed.test(i), in_second = later.changed.test(i);
      if (!in_first && !in_second) continue;
      both.changed.set(i);
      both.values.push_back(in_first ? earlier.values[e] : later.values[l]);
      e += in_first, l += in_second;
    }
    earlier = std::move(both);
  }
  for (auto& [layer, changes] : second.layers) {
    std::vector<LayerChange>& into = first.layers[layer];
    std::unordered_map<LeafPos, bool, world::PosHash> there;
    for (const LayerChange& change : into) there[change.leaf] = true;
    for (LayerChange& change : changes)
      if (!there.contains(change.leaf)) into.push_back(std::move(change));
  }
  first.bytes = first.edit ? first.edit->ops().size() * sizeof(world::EditBatch::Op) : 0;
  for (const LeafChange<BlockId>& change : first.blocks)
    first.bytes += sizeof change + change.values.size() * sizeof(BlockId);
  for (const auto& [layer, changes] : first.layers)
    for (const LayerChange& change : changes) first.bytes += sizeof change + change.values.size() * sizeof(int32_t);
}

void History::drop_oldest() {
  if (closed_bytes_ > most_bytes_) redo_.clear();  // places in the chain move now
  while (closed_bytes_ > most_bytes_ && intervals_.size() > 2) {
    size_t n = 1;
    while (n + 1 < intervals_.size() && intervals_[n].edit) ++n;
    if (n + 1 < intervals_.size()) {
      closed_bytes_ -= std::min(closed_bytes_, intervals_[n - 1].bytes + intervals_[n].bytes);
      merge(intervals_[n - 1], std::move(intervals_[n]));
      closed_bytes_ += intervals_[n - 1].bytes;
      intervals_.erase(intervals_.begin() + static_cast<std::ptrdiff_t>(n));
      continue;
    }
    closed_bytes_ -= std::min(closed_bytes_, intervals_.front().bytes);
    intervals_.pop_front();
    ++dropped_;
  }
}

void History::swap(Interval& interval) {
  std::vector<Blocks> values(interval.blocks.size());
  std::vector<world::LeafWrite> writes;
  for (size_t n = 0; n < interval.blocks.size(); ++n) {
    LeafChange<BlockId>& change = interval.blocks[n];
    const world::LeafBlocks leaf = world_.store.leaf(change.leaf);
    size_t next = 0;
    for (int i = 0; i < kLeafVoxels; ++i) {
      BlockId& now = values[n][static_cast<size_t>(i)];
      now = leaf[i];
      if (change.changed.test(i)) std::swap(now, change.values[next++]);
    }
    known_.learn(change.leaf, values[n]);
    writes.push_back({change.leaf, values[n].data()});
  }
  CHECK(world_.store.write_leaves(writes).ok());
  for (auto& [layer, changes] : interval.layers) {
    world::IntLayer& target = world_.store.make_int_layer(layer);
    auto& known_leaves = layers_[layer];
    for (LayerChange& change : changes) {
      LayerChange now{change.leaf, {}, std::vector<int32_t>(kLeafVoxels)};
      target.read_leaf(change.leaf, std::span<int32_t, kLeafVoxels>(now.values.data(), kLeafVoxels), now.active);
      if (now.active.is_none()) now.values.clear();
      change.values.resize(kLeafVoxels);
      target.write_leaf(change.leaf, std::span<const int32_t, kLeafVoxels>(change.values.data(), kLeafVoxels),
                        change.active);
      if (change.active.is_none())
        known_leaves.erase(change.leaf);
      else
        known_leaves[change.leaf] = change;
      change = std::move(now);
    }
  }
  auto ignored = world_.store.take_dirty(subscriber_);  // our own
  (void)ignored;
}

std::vector<History::Interval> History::rewind(size_t first) {
  close();
  std::vector<Interval> taken;
  while (intervals_.size() > first) {
    swap(intervals_.back());
    closed_bytes_ -= std::min(closed_bytes_, intervals_.back().bytes);
    taken.push_back(std::move(intervals_.back()));
    intervals_.pop_back();
  }
  std::reverse(taken.begin(), taken.end());
  return taken;
}

void History::restore(const Moment& moment) { world_.simulation.state = moment.state; }

size_t History::undo_steps() const {
  return static_cast<size_t>(
      std::count_if(intervals_.begin(), intervals_.end(), [](const Interval& i) { return i.edit.has_value(); }));
}

std::vector<History::Interval>& History::rewind_to_redo(size_t first, Moment end) {
  if (!redo_.empty() && redo_.back().first - dropped_ > first) {
    const std::vector<Interval> passed = rewind(redo_.back().first - dropped_);
    if (!passed.empty()) end = passed.front().begin;
  }
  redo_.push_back({first + dropped_, rewind(first), std::move(end)});
  return redo_.back().intervals;
}

std::optional<History::Restored> History::undo(uint64_t tick, world::VoxelPos around) {
  size_t last = intervals_.size();
  while (last > 0 && !intervals_[last - 1].edit) --last;
  if (last == 0) return std::nullopt;
  const Moment begin = rewind_to_redo(last - 1, {tick, world_.simulation.state, around}).front().begin;
  restore(begin);
  intervals_.push_back({.begin = begin});
  return Restored{begin.tick, {}, begin.around};
}

std::optional<History::Restored> History::redo() {
  if (redo_.empty()) return std::nullopt;
  rewind(redo_.back().first - dropped_);  // what passed since
  Redo group = std::move(redo_.back());
  redo_.pop_back();
  for (Interval& interval : group.intervals) {
    swap(interval);
    closed_bytes_ += interval.bytes;
    intervals_.push_back(std::move(interval));
  }
  restore(group.end);
  intervals_.push_back({.begin = group.end});  // what follows is no part of what was redone
  return Restored{group.end.tick, {}, group.end.around};
}

std::optional<History::Restored> History::back_to(uint64_t target, uint64_t tick, world::VoxelPos around) {
  size_t to = intervals_.size();
  while (to > 0 && intervals_[to - 1].begin.tick > target) --to;
  if (to-- == 0) return std::nullopt;
  // Edits that are passed on the way can be redone, and so can what was undone.
  const bool passes_edit = std::any_of(intervals_.begin() + static_cast<std::ptrdiff_t>(to) + 1, intervals_.end(),
                                       [](const Interval& i) { return i.edit.has_value(); });
  const bool passes_redo = !redo_.empty() && redo_.back().first - dropped_ > to;
  Interval again;
  const auto begin_of = [&](const Interval& first) { again.begin = first.begin, again.edit = first.edit; };
  if (passes_edit || passes_redo)
    begin_of(rewind_to_redo(to, {tick, world_.simulation.state, around}).front());
  else
    begin_of(rewind(to).front());
  restore(again.begin);
  const Restored restored{again.begin.tick, again.edit, again.begin.around};
  intervals_.push_back(std::move(again));
  return restored;
}

size_t History::bytes() const {
  size_t all = closed_bytes_ + known_.bytes();
  for (const Redo& group : redo_)
    for (const Interval& interval : group.intervals) all += interval.bytes;
  for (const auto& [layer, leaves] : layers_)
    all += leaves.size() * (sizeof(LayerChange) + kLeafVoxels * sizeof(int32_t));
  return all;
}

}  // namespace tools
