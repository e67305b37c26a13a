#include "sim/light/queue_flood.h"

#include <bit>

#include "sim/light/flood_bits.h"
#include "sim/light/flood_window.h"

namespace sim {

namespace {

/// What leaves of one level are read from.
const std::array<LightLeaf, kMaxLight + 1> kUniform = [] {
  std::array<LightLeaf, kMaxLight + 1> all;
  for (int level = 0; level <= kMaxLight; ++level) all[static_cast<size_t>(level)] = LightLeaf::of(level);
  return all;
}();

}  // namespace

bool QueueFlood::follow(std::span<const BrokenLeaf> broken, const OpticsVolume& optics, LightField& field, int top,
                        bool is_sky, LightReport& report, std::vector<LeafPos>& changed) {
  optics_ = &optics, field_ = &field, is_sky_ = is_sky;
  leaf_count_ = dark_count_ = again_count_ = raised_count_ = 0;
  place_.fill(0);
  first_raised_.fill(-1);
  waiting_levels_ = 0, work_ = 0, no_room_ = false;
  if (!take_broken(broken, top) || !darken() || !raise_again() || !spread()) return false;
  write(report, changed);
  ++report.queues;
  report.queue_voxels += again_count_ + raised_count_;
  return true;
}

int16_t QueueFlood::find_leaf(LeafPos l) {
  const auto hash = static_cast<uint32_t>(l.x) * 25 + static_cast<uint32_t>(l.y) * 5 + static_cast<uint32_t>(l.z);
  size_t at = hash % place_.size();
  for (; place_[at]; at = (at + 1) % place_.size())
    if (leaves_[place_[at] - 1u].pos == l) return static_cast<int16_t>(place_[at] - 1);
  LightRegion* region = field_->regions().find(region_from_leaf(l));
  if (!region) return kOutside;
  if (leaf_count_ == kMostLeaves) {
    no_room_ = true;
    return kNoRoom;
  }
  Leaf& leaf = leaves_[leaf_count_];
  place_[at] = static_cast<uint8_t>(++leaf_count_);
  const LightLeafView view = region->leaf(index_in_region(l));
  leaf.levels = view.leaf ? view.leaf : &kUniform[view.tile];
  leaf.optics = optics_->leaf(l);
  leaf.pos = l;
  leaf.beside.fill(kUnknown);
  leaf.region = region;
  return static_cast<int16_t>(leaf_count_ - 1);
}

int16_t QueueFlood::leaf_beside(int16_t leaf, int face) {
  Leaf& from = leaves_[static_cast<size_t>(leaf)];
  int16_t& other = from.beside[static_cast<size_t>(face)];
  if (other == kUnknown) {
    const VoxelPos step = world::face_step(face);
    other = find_leaf(from.pos + LeafPos{step.x, step.y, step.z});
  }
  return other;
}

template <class Visit>
void QueueFlood::around(Voxel v, Visit visit) {
  for (int axis = 0; axis < 3; ++axis) {
    const int shift = 6 - 3 * axis, along = v.index >> shift & 7;
    if (along > 0)
      visit(Voxel{v.leaf, static_cast<int16_t>(v.index - (1 << shift))});
    else if (const int16_t leaf = leaf_beside(v.leaf, 2 * axis); leaf >= 0)
      visit(Voxel{leaf, static_cast<int16_t>(v.index + (7 << shift))});
    if (along < 7)
      visit(Voxel{v.leaf, static_cast<int16_t>(v.index + (1 << shift))});
    else if (const int16_t leaf = leaf_beside(v.leaf, 2 * axis + 1); leaf >= 0)
      visit(Voxel{leaf, static_cast<int16_t>(v.index - (7 << shift))});
  }
}

void QueueFlood::set_level(Voxel v, int level) {
  Leaf& leaf = leaves_[static_cast<size_t>(v.leaf)];
  if (leaf.levels != &leaf.changed) leaf.changed = *leaf.levels, leaf.levels = &leaf.changed;
  leaf.changed.set(v.index, level);
}

/// Of a voxel that isn't closed.
int QueueFlood::loss(Voxel v) const {
  for (const NumberedMask& slow : leaves_[static_cast<size_t>(v.leaf)].optics.slow)
    if (slow.mask.test(v.index)) return slow.number;
  return 1;
}

/// As a lamp. What the sky lights from above is told with the broken voxels, and else has the highest level.
int QueueFlood::own_level(Voxel v) const {
  if (is_sky_) return 0;
  for (const NumberedMask& source : leaves_[static_cast<size_t>(v.leaf)].optics.sources)
    if (source.mask.test(v.index)) return source.number;
  return 0;
}

QueueFlood::Gathered QueueFlood::gather(Voxel v) {
  Gathered found;
  around(v, [&](Voxel n) {
    const int at = level(n);
    found.level = std::max(found.level, at);
    if (at < found.lowest && !is_closed(n)) found.lowest = at;
  });
  found.level = is_closed(v) ? 0 : std::max(0, found.level - loss(v));
  return found;
}

/// Begins the queues: broken voxels that are too bright are darkened.
bool QueueFlood::take_broken(std::span<const BrokenLeaf> broken, int top) {
  for (const BrokenLeaf& part : broken) {
    const int16_t leaf = find_leaf(part.pos);
    if (leaf < 0) return false;
    for (int x = 0; x < 8; ++x)
      for (uint64_t left = part.voxels.word[x]; left; left &= left - 1) {
        const Voxel v{leaf, static_cast<int16_t>(x * 64 + std::countr_zero(left))};
        const int given = !is_sky_ ? own_level(v) : part.sunlit.test(v.index) ? top : 0;
        if (again_count_ == kMostWork) return false;
        again_[again_count_++] = {v, -1, static_cast<uint8_t>(given)};
      }
  }
  // All right sides before any level goes. What was sunlit has no neighbour that is brighter.
  for (size_t i = 0; i < again_count_; ++i) {
    const int old = level(again_[i].voxel);
    if (old > again_[i].level && (old == top || old > gather(again_[i].voxel).level))
      dark_[dark_count_++] = {again_[i].voxel, -1, static_cast<uint8_t>(old)};
  }
  for (size_t i = 0; i < dark_count_; ++i) set_level(dark_[i].voxel, 0);
  return !no_room_;
}

bool QueueFlood::darken() {
  const size_t first = dark_count_;  // from here on they were waited for
  for (size_t i = 0; i < dark_count_; ++i) {
    const Entry gone = dark_[i];
    if (i >= first) work_ -= gone.level;
    ++work_;
    bool room = true;
    around(gone.voxel, [&](Voxel n) {
      const int had = level(n);
      if (had == 0 || had >= gone.level || is_closed(n) || had > gone.level - loss(n)) return;
      const int own = own_level(n);
      if (had <= own) return;
      room &= dark_count_ < kMostVoxels && again_count_ < kMostVoxels;
      if (!room) return;
      set_level(n, 0);
      dark_[dark_count_++] = {n, -1, static_cast<uint8_t>(had)};
      again_[again_count_++] = {n, -1, static_cast<uint8_t>(own)};
      work_ += had;
    });
    if (!room) return false;
    if (work_ > kMostWork || no_room_) return false;
  }
  return true;
}

bool QueueFlood::raise(Voxel v, int to) {
  if (raised_count_ == kMostVoxels) return false;
  set_level(v, to);
  raised_[raised_count_] = {v, first_raised_[static_cast<size_t>(to)], static_cast<uint8_t>(to)};
  first_raised_[static_cast<size_t>(to)] = static_cast<int16_t>(raised_count_++);
  waiting_levels_ |= 1u << to;
  return true;
}

bool QueueFlood::raise_again() {
  for (size_t i = 0; i < again_count_; ++i) {
    const Entry& entry = again_[i];
    const Gathered found = gather(entry.voxel);
    const int right = std::max<int>(entry.level, found.level);
    if (right <= level(entry.voxel)) continue;
    if (found.lowest >= right - 1)
      set_level(entry.voxel, right);  // no neighbour asks for more
    else if (!raise(entry.voxel, right))
      return false;
  }
  return !no_room_;
}

bool QueueFlood::spread() {
  const size_t first = raised_count_;
  while (waiting_levels_) {
    const int from = std::bit_width(waiting_levels_) - 1;
    int16_t& head = first_raised_[static_cast<size_t>(from)];
    if (head < 0) {
      waiting_levels_ &= ~(1u << from);
      continue;
    }
    const int16_t at = head;
    const Entry entry = raised_[static_cast<size_t>(at)];
    head = entry.next;
    if (static_cast<size_t>(at) >= first) work_ -= from;
    ++work_;
    if (level(entry.voxel) != from) continue;  // raised further since
    bool room = true;
    around(entry.voxel, [&](Voxel n) {
      const int had = level(n);
      if (had + 1 >= from || is_closed(n)) return;
      const int given = from - loss(n);
      if (given <= had) return;
      room &= raise(n, given);
      work_ += given;
    });
    if (!room) return false;
    if (work_ > kMostWork || no_room_) return false;
  }
  return true;
}

void QueueFlood::write(LightReport& report, std::vector<LeafPos>& changed) {
  for (size_t i = 0; i < leaf_count_; ++i) {
    const Leaf& leaf = leaves_[i];
    if (leaf.levels != &leaf.changed) continue;
    leaf.region->split();
    const int index = index_in_region(leaf.pos);
    const int tile = tile_of(leaf.changed);
    if (tile < 0 ? leaf.region->set_leaf(index, leaf.changed) : leaf.region->set_leaf(index, tile)) {
      ++report.leaves_changed;
      changed.push_back(leaf.pos);
    }
    leaf.region->join();
  }
}

}  // namespace sim
