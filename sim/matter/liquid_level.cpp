#include "sim/matter/liquid_level.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <tuple>

#include "world/base/jobs.h"
#include "world/base/random.h"
#include "world/store/leaf_flood.h"

namespace sim {

using world::LeafMask;
using world::LeafPos;
using world::VoxelPos;

namespace {

constexpr int kTileLeaves = 16;
constexpr int kMostGiven = kFullVoxel;
/// Beyond this difference a voxel that has become full presses liquid into the air above it in the same round, and so
/// much: else a narrow mouth below a wide basin gives no more than what flows off its own voxels to the sides.
constexpr int kPressure = 2 * kFullVoxel, kMostPressed = 2;  // voxels
constexpr size_t kLeavesATask = 32;
constexpr int kOrderBits = 22, kKeyBits = kOrderBits + 22;  // of a hash; and of a head above them
constexpr int kNumberBits = 64 - kKeyBits;
constexpr size_t kTileSize = size_t{kTileLeaves} * kTileLeaves * kTileLeaves;
constexpr size_t kMostBeyond = 1024;
constexpr int kHighestBeyond = 60;  // leaves; heads are counted from 64 below the tile
// Where tops lie: above the body, and beside it.
constexpr world::Face kOpenFaces[] = {world::kFacePosY, world::kFaceNegX, world::kFacePosX, world::kFaceNegZ,
                                      world::kFacePosZ};
constexpr std::span<const world::Face> kSideFaces(kOpenFaces + 1, 4);

size_t index_in_tile(LeafPos d) { return static_cast<size_t>((d.x * kTileLeaves + d.y) * kTileLeaves + d.z); }
LeafPos place_in_tile(size_t index) {
  return {static_cast<int32_t>(index / 256), static_cast<int32_t>(index / 16 % 16), static_cast<int32_t>(index % 16)};
}
bool inside_tile(LeafPos d) {
  const auto in = [](int32_t c) { return c >= 0 && c < kTileLeaves; };
  return in(d.x) && in(d.y) && in(d.z);
}
constexpr std::array<LeafMask, world::kFaces> side_masks() {
  std::array<LeafMask, world::kFaces> masks{};
  for (int face = 0; face < world::kFaces; ++face) masks[static_cast<size_t>(face)] = world::side_of(face);
  return masks;
}
constexpr std::array<LeafMask, world::kFaces> kSideMasks = side_masks();
LeafPos leaf_step(int face) {
  const VoxelPos step = world::face_step(face);
  return {step.x, step.y, step.z};
}
}  // namespace

PageId LiquidLevels::page_beside(Cells& cells, PageId p, int dx, int dy, int dz) const {
  const PageId known = cells.around(p)[static_cast<size_t>(around_index(dx, dy, dz))];
  return known != kClosedPage ? known : cells.open(cells.pos(p) + LeafPos{dx, dy, dz});
}

const LiquidMasks& LiquidLevels::masks_beside(Cells& cells, PageId p) {
  pages_->view(cells, p);
  return pages_->masks(p);
}

/// Of a page's voxels that hold some of it, those that are parts of a body: under a ceiling, or under others.
LeafMask LiquidLevels::conduits(Cells& cells, PageId p) {
  const LiquidMasks& own = masks_beside(cells, p);
  if (own.part.is_none()) return {};
  const LiquidMasks& above = masks_beside(cells, page_beside(cells, p, 0, 1, 0));
  const LeafMask air_above = world::across(own.air, above.air, world::kFacePosY);
  const LeafMask part_above = world::across(own.part, above.part, world::kFacePosY);
  return without(without(own.part, air_above), part_above) | (own.most & part_above);
}

/// A leaf of the tile, read on the first look.
LiquidLevels::Leaf& LiquidLevels::leaf_at(Cells& cells, LeafPos low, size_t index) {
  Leaf& leaf = leaves_[index];
  if (leaf.read == tile_) return leaf;
  leaf.read = tile_;
  leaf.moved = false;
  if (index < kTileSize) leaf.place = place_in_tile(index);
  leaf.page = cells.open(low + leaf.place);
  leaf.masks = &masks_beside(cells, leaf.page);
  leaf.conduit = conduits(cells, leaf.page);
  leaf.left = leaf.masks->full | leaf.conduit;
  return leaf;
}

/// kNoLeaf where it is neither of the tile nor was reached beyond it.
size_t LiquidLevels::index_of(LeafPos place) const {
  if (inside_tile(place)) return index_in_tile(place);
  const auto found = beyond_.find(place);
  return found == beyond_.end() ? world::kNoLeaf : found->second;
}

/// The next leaf of a flood, or kNoLeaf. Through the border of the tile lead leaves of it that hold nothing but liquid
/// and walls, pipes: outwards, and back in.
size_t LiquidLevels::beside(Cells& cells, LeafPos low, size_t index, int face) {
  const LeafPos next = leaves_[index].place + leaf_step(face);
  const bool from_inside = index < kTileSize, to_inside = inside_tile(next);
  if (from_inside && to_inside) return index_in_tile(next);
  const auto is_pipe = [&](const Leaf& leaf) {
    return !leaf.masks->full.is_all() && leaf.masks->air.is_none() && leaf.masks->part.is_none();
  };
  if (to_inside) return is_pipe(leaf_at(cells, low, index_in_tile(next))) ? index_in_tile(next) : world::kNoLeaf;
  if (from_inside && !is_pipe(leaves_[index])) return world::kNoLeaf;
  const size_t known = index_of(next);
  if (known != world::kNoLeaf && in_body(known)) return known;
  if (beyond_body_ == kMostBeyond || std::abs(next.y) >= kHighestBeyond) return world::kNoLeaf;
  if (known != world::kNoLeaf) return known;
  leaves_.emplace_back();
  leaves_.back().place = next;
  beyond_.emplace(next, leaves_.size() - 1);
  return leaves_.size() - 1;
}

/// The body that holds seed_mask of a leaf of the tile: first what of it lies there, then what pipes lead to, from the
/// same leaves in the same order wherever the seed was.
void LiquidLevels::flood(Cells& cells, LeafPos low, size_t start, const LeafMask& seed_mask) {
  body_.clear();
  ++number_;
  beyond_body_ = 0;
  const auto left = [&](size_t index) -> LeafMask& { return leaf_at(cells, low, index).left; };
  const auto reached = [&](size_t index, const LeafMask& fresh) {
    Leaf& leaf = leaves_[index];
    if (leaf.in_body != number_) {
      leaf.in_body = number_;
      leaf.body = {};
      body_.push_back(index);
      beyond_body_ += index >= kTileSize;
    }
    leaf.body = leaf.body | fresh;
    return true;
  };
  front_.assign(1, {start, seed_mask});
  const auto within = [&](size_t index, int face) {
    const LeafPos next = leaves_[index].place + leaf_step(face);
    return inside_tile(next) ? index_in_tile(next) : world::kNoLeaf;
  };
  world::flood_leaves(front_, left, within, reached);
  std::sort(body_.begin(), body_.end());
  for (const size_t index : body_)
    for (int face = 0; face < world::kFaces; ++face) {
      if (inside_tile(leaves_[index].place + leaf_step(face))) continue;
      const LeafMask touched = world::across(world::kNoneMask, leaves_[index].body, world::opposite_face(face));
      if (touched.is_none()) continue;
      const size_t next = beside(cells, low, index, face);
      if (next != world::kNoLeaf) front_.emplace_back(next, touched);
    }
  const auto beyond = [&](size_t index, int face) { return beside(cells, low, index, face); };
  world::flood_leaves(front_, left, beyond, reached);
}

/// The voxels of a leaf that are full and of the body in hand.
const LeafMask* LiquidLevels::full_of_body(LeafPos place) const {
  const size_t index = index_of(place);
  return index != world::kNoLeaf && in_body(index) ? &leaves_[index].full_body : nullptr;
}

void LiquidLevels::add_tops(const Surface& in, LeafPos low, uint64_t salt, const LeafMask& above,
                            const LeafMask& beside, std::vector<Top>& tops) const {
  const uint16_t* amounts = (*pages_)[in.page].own();
  const VoxelPos corner = world::voxel_from_leaf(low + in.place);
  const int32_t height = (in.place.y + 64) * world::kLeafSize;
  const auto add = [&](int index, unsigned beside_bit) {
    const VoxelPos o = world::offset_in_leaf(index), v = corner + o;
    const uint16_t amount = amounts[index];
    const auto head = static_cast<uint32_t>((height + o.y) * kFullVoxel + amount);
    const uint64_t place =
        static_cast<uint64_t>(v.x) << 42 ^ static_cast<uint64_t>(v.y) << 21 ^ static_cast<uint64_t>(v.z);
    const uint64_t order = world::hash_combine(salt, place);
    tops.push_back({static_cast<uint64_t>(head) << kOrderBits | order >> (64 - kOrderBits), in.page,
                    static_cast<uint16_t>(static_cast<unsigned>(index) | beside_bit), amount});
  };
  world::for_each_voxel(above, [&](int index) { add(index, 0); });
  world::for_each_voxel(beside, [&](int index) { add(index, Top::kBeside); });
}

/// Those that lie in the voxels of a leaf: above the body, and beside it where they aren't above it.
void LiquidLevels::tops_of_leaf(const Surface& in, LeafPos low, uint64_t salt, Part& into) const {
  const LiquidMasks& masks = (*pages_)[in.page].voxels->masks;
  const LeafMask surface = masks.air | masks.part;
  if (surface.is_none()) return;
  const auto part = [&](const LeafMask* m) -> const LeafMask& { return m ? *m : world::kNoneMask; };
  const LeafMask& own = part(full_of_body(in.place));
  const auto near = [&](int face) { return world::across(own, part(full_of_body(in.place + leaf_step(face))), face); };
  const LeafMask on_body = near(world::kFaceNegY), above = on_body & surface;
  LeafMask beside;
  for (const world::Face face : kSideFaces) beside = beside | near(face);
  beside = without(beside & surface, on_body);
  if (is_of_others(in.place) && !masks.part.is_none()) {
    if (!(above | beside).is_none()) into.rims.push_back({in, above, beside});
    return;
  }
  // Conduits are parts of the body; where they aren't borne by it they take.
  LeafMask conduit;
  if (!is_of_others(in.place)) {
    const Leaf& leaf = leaves_[index_of(in.place)];
    conduit = without(leaf.body & leaf.conduit, on_body);
  }
  beside = without(beside, conduit);
  if (!beside.is_none()) into.rims.push_back({in, {}, beside});
  add_tops(in, low, salt, above, conduit, into.tops);
}

/// Takes out of a rim what is a top, or a part, of another body. `turn`: of the round, which side comes first.
void LiquidLevels::leave_to_others(Cells& cells, uint64_t turn, Rim& rim) {
  const PageId page = rim.in.page;
  const LeafPos place = rim.in.place;
  const LiquidMasks& masks = masks_beside(cells, page);
  if (is_of_others(place)) {
    const LeafMask conduit = conduits(cells, page);
    rim.above = without(rim.above, conduit), rim.beside = without(rim.beside, conduit);
  }
  if (rim.beside.is_none()) return;
  const auto all_full = [&](world::Face face) {
    const LeafPos step = leaf_step(face);
    const PageId next = page_beside(cells, page, step.x, step.y, step.z);
    return world::across(masks.full, next == kClosedPage ? world::kNoneMask : masks_beside(cells, next).full, face);
  };
  const auto part = [&](const LeafMask* m) -> const LeafMask& { return m ? *m : world::kNoneMask; };
  LeafMask left = without(rim.beside, all_full(world::kFaceNegY));
  rim.beside = {};
  for (uint64_t k = 0; k < kSideFaces.size(); ++k) {
    const world::Face face = kSideFaces[(turn & 4 ? turn - k : turn + k) & 3];
    const LeafMask ours = world::across(part(full_of_body(place)), part(full_of_body(place + leaf_step(face))), face);
    rim.beside = rim.beside | (left & ours);
    left = without(left, all_full(face));
  }
}

/// Where the body in hand ends upwards and sideways, each voxel once.
void LiquidLevels::find_tops(Cells& cells, LeafPos low, uint64_t round, uint64_t seed) {
  // Leaves of the body, and those across the faces through which it may end: on one thread, as these may have to be
  // opened and read.
  surfaces_.clear();
  for (const size_t index : body_) {
    Leaf& leaf = leaves_[index];
    leaf.full_body = leaf.body & leaf.masks->full;
    surfaces_.push_back({leaf.page, leaf.place});
  }
  const size_t own = surfaces_.size();
  for (size_t n = 0; n < own; ++n) {
    const Surface from = surfaces_[n];
    const LeafMask& full = leaves_[body_[n]].full_body;
    for (const world::Face face : kOpenFaces) {
      if ((full & kSideMasks[static_cast<size_t>(face)]).is_none()) continue;
      const LeafPos step = leaf_step(face), next = from.place + step;
      if (full_of_body(next)) continue;
      const PageId beyond = page_beside(cells, from.page, step.x, step.y, step.z);
      if (beyond >= seen_.size()) seen_.resize(cells.page_limit(), 0);
      if (beyond == kClosedPage || seen_[beyond] == number_) continue;
      seen_[beyond] = number_;
      masks_beside(cells, beyond);
      surfaces_.push_back({beyond, next});
    }
  }
  const size_t chunks = (surfaces_.size() + kLeavesATask - 1) / kLeavesATask;
  if (parts_.size() < chunks) parts_.resize(chunks);
  const uint64_t salt = world::hash_combine(seed, round);
  world::parallel_for(chunks, [&](size_t c) {
    Part& part = parts_[c];
    part.tops.clear(), part.rims.clear();
    const size_t end = std::min(surfaces_.size(), (c + 1) * kLeavesATask);
    for (size_t n = c * kLeavesATask; n < end; ++n) tops_of_leaf(surfaces_[n], low, salt, part);
  });
  tops_.clear();
  for (size_t c = 0; c < chunks; ++c) {
    tops_.insert(tops_.end(), parts_[c].tops.begin(), parts_[c].tops.end());
    for (Rim& rim : parts_[c].rims) {
      leave_to_others(cells, salt, rim);
      add_tops(rim.in, low, salt, rim.above, rim.beside, tops_);
    }
  }
}

/// By head, then by hash, as they come where both are equal.
void LiquidLevels::sort_by_key() {
  constexpr int kBits = 11, kDigits = (kKeyBits + kBits - 1) / kBits;
  constexpr uint32_t kRadix = 1u << kBits;
  const size_t count_of_all = tops_.size();
  if (count_of_all > size_t{1} << kNumberBits) {  // more than any water at rest has in a tile
    std::stable_sort(tops_.begin(), tops_.end(), [](const Top& a, const Top& b) { return a.key < b.key; });
    return;
  }
  std::array<std::array<uint32_t, kRadix>, kDigits> counts{};
  // Keys alone are moved about, each with its number below it.
  order_.resize(2 * count_of_all);
  uint64_t *from = order_.data(), *to = from + count_of_all;
  for (size_t n = 0; n < count_of_all; ++n) {
    const uint64_t key = tops_[n].key;
    from[n] = key << kNumberBits | n;
    for (int d = 0; d < kDigits; ++d) ++counts[static_cast<size_t>(d)][key >> (d * kBits) & (kRadix - 1)];
  }
  for (int d = 0; d < kDigits; ++d) {
    std::array<uint32_t, kRadix>& count = counts[static_cast<size_t>(d)];
    uint32_t before = 0;
    bool sorted = false;
    for (uint32_t& c : count) {
      sorted |= c == count_of_all;
      before += std::exchange(c, before);
    }
    if (sorted) continue;
    const int shift = kNumberBits + d * kBits;
    for (size_t n = 0; n < count_of_all; ++n) to[count[from[n] >> shift & (kRadix - 1)]++] = from[n];
    std::swap(from, to);
  }
  scratch_.resize(count_of_all);
  for (size_t n = 0; n < count_of_all; ++n) scratch_[n] = tops_[from[n] & ((uint64_t{1} << kNumberBits) - 1)];
  tops_.swap(scratch_);
}

/// By head, then by hash, then by place.
void LiquidLevels::sort_tops(const Cells& cells) {
  sort_by_key();
  const auto place = [&](const Top& t) {
    return world::voxel_from_leaf(cells.pos(t.page)) + world::offset_in_leaf(t.voxel());
  };
  for (size_t begin = 0, end; begin < tops_.size(); begin = end) {
    for (end = begin + 1; end < tops_.size() && tops_[end].key == tops_[begin].key;) ++end;
    if (end - begin < 2) continue;
    const auto at = [&](size_t n) { return tops_.begin() + static_cast<std::ptrdiff_t>(n); };
    std::sort(at(begin), at(end), [&](const Top& a, const Top& b) { return place(a) < place(b); });
  }
}

void LiquidLevels::change(Cells& cells, PageId p, int index, int by) {
  if (cells.met_heat()) {
    if (by < 0)
      heat_->take(cells, p, index, -by, (*pages_)[p].own()[index]);
    else
      heat_->give(p, index, by);
  }
  pages_->add(p, index, by);
  if (p >= is_touched_.size()) is_touched_.resize(p + 1);  // pressing opens pages
  if (is_touched_[p]) return;
  is_touched_[p] = 1;
  touched_.push_back(p);
}

/// Whether full voxels stand beside one: then it is a top of its own.
bool LiquidLevels::has_full_side(Cells& cells, PageId p, int index) {
  const VoxelPos o = world::offset_in_leaf(index);
  for (const world::Face face : kSideFaces) {
    const VoxelPos step = world::face_step(face), next = o + step;
    const bool inside = next.x >= 0 && next.x < world::kLeafSize && next.z >= 0 && next.z < world::kLeafSize;
    const PageId page = inside ? p : page_beside(cells, p, step.x, 0, step.z);
    if (page != kClosedPage && masks_beside(cells, page).full.test(world::index_in_leaf(next))) return true;
  }
  return false;
}

/// Moves from the highest tops to the lowest.
bool LiquidLevels::level_body(Cells& cells) {
  if (tops_.size() < 2) return false;
  uint64_t least = tops_[0].key, most = least;
  for (const Top& t : tops_) least = std::min(least, t.key), most = std::max(most, t.key);
  if (static_cast<int>((most >> kOrderBits) - (least >> kOrderBits)) < 2) return false;
  sort_tops(cells);
  is_touched_.resize(cells.page_limit(), 0);
  bool any = false;
  const auto top = [&](size_t n) -> const Top& { return tops_[n]; };
  const auto can_give = [](const Top& t) { return t.amount == 0 ? kMostGiven : std::min<int>(t.amount, kMostGiven); };
  const auto can_take = [](const Top& t) { return std::min(kFullVoxel - t.amount, kMostGiven); };
  size_t low = 0, high = tops_.size() - 1;
  int gives = can_give(top(high)), takes = can_take(top(low));
  int head_from = top(high).head(), head_to = top(low).head();
  int given_all = 0, taken_all = 0;
  const auto leave_high = [&] {
    const Top& from = top(high);
    if (given_all > 0) {
      // Of air, nothing lies in it: the full voxel under it gives.
      const int index = from.voxel();
      if (from.amount > 0)
        change(cells, from.page, index, -given_all);
      else if (index & 56)
        change(cells, from.page, index - 8, -given_all);
      else
        change(cells, cells.around(from.page)[kBelow], index + 56, -given_all);
    }
    given_all = 0;
    if (--high > low) gives = can_give(top(high)), head_from = top(high).head();
  };
  struct Place {
    PageId page;
    int index;
  };
  const auto above = [&](Place p) -> Place {
    if ((p.index & 56) != 56) return {p.page, p.index + 8};
    return {page_beside(cells, p.page, 0, 1, 0), p.index - 56};
  };
  bool pressed = false;  // what lies lowest takes more than its voxel holds
  const auto can_press = [&](const Top& t) {
    int room = 0;
    for (Place p{t.page, t.voxel()}; !t.is_beside() && room < kMostPressed * kFullVoxel; room += kFullVoxel) {
      p = above(p);
      if (p.page == kClosedPage || !masks_beside(cells, p.page).air.test(p.index) ||
          has_full_side(cells, p.page, p.index))
        break;
    }
    return room;
  };
  const auto leave_low = [&] {
    Place p{top(low).page, top(low).voxel()};
    for (int room = kFullVoxel - top(low).amount; taken_all > 0; room = kFullVoxel, p = above(p)) {
      const int taken = std::min(taken_all, room);
      if (taken > 0) change(cells, p.page, p.index, taken);
      taken_all -= taken;
    }
    taken_all = 0, pressed = false;
    if (++low < high) takes = can_take(top(low)), head_to = top(low).head();
  };
  while (low < high) {
    if (top(high).is_beside() || gives == 0) {
      leave_high();
      continue;
    }
    const int difference = head_from - head_to;
    if (difference < 2 && given_all == 0 && taken_all == 0) break;
    const int given = std::max(0, std::min({difference / 2, gives, takes}));
    gives -= given, takes -= given;
    head_from -= given, head_to += given;
    given_all += given, taken_all += given;
    any |= given > 0;
    // Two that are level now are done; else the one that can't give or take more.
    const bool level = given >= difference / 2;
    if (level || gives == 0) leave_high();
    if (!level && takes == 0 && !pressed && head_from - head_to >= kPressure)
      pressed = true, takes = std::min(can_press(top(low)), (head_from - head_to) / 4);
    if (level || takes == 0) leave_low();
  }
  if (given_all > 0) leave_high();
  if (taken_all > 0) leave_low();
  heat_->settle(cells);
  return any;
}

void LiquidLevels::store_changes(Cells& cells) {
  for (const PageId p : touched_) cells.open_around(p);
  std::atomic<uint64_t> changed{0};
  world::parallel_ranges(touched_.size(), kLeavesATask, [&](size_t begin, size_t end) {
    uint64_t of_task = 0;
    for (size_t n = begin; n < end; ++n) of_task += pages_->store(cells, touched_[n]);
    changed += of_task;
  });
  for (const PageId p : touched_) is_touched_[p] = 0;
  touched_.clear();
  result_.voxels_changed += changed;
}

const LiquidLevels::Result& LiquidLevels::level(Cells& cells, LiquidPages& pages, LiquidHeat& heat,
                                                std::span<const PageId> list, uint64_t round, uint64_t seed,
                                                world::FunctionRef<bool(PageId)> is_wavy) {
  pages_ = &pages;
  heat_ = &heat;
  result_.voxels_changed = 0;
  result_.moved.assign(list.size(), 0);
  const int32_t shift = round & 1 ? kTileLeaves / 2 : 0;
  const auto tile_of = [&](LeafPos l) { return LeafPos{(l.x + shift) >> 4, (l.y + shift) >> 4, (l.z + shift) >> 4}; };
  // By tiles, in order.
  by_tile_.clear();
  for (size_t n = 0; n < list.size(); ++n) by_tile_.emplace_back(tile_of(cells.pos(list[n])), n);
  std::sort(by_tile_.begin(), by_tile_.end());
  if (round & 2) std::reverse(by_tile_.begin(), by_tile_.end());
  const uint64_t last_round = tile_;
  for (size_t begin = 0, end; begin < by_tile_.size(); begin = end) {
    const LeafPos tile = by_tile_[begin].first;
    for (end = begin; end < by_tile_.size() && by_tile_[end].first == tile;) ++end;
    const LeafPos low{tile.x * kTileLeaves - shift, tile.y * kTileLeaves - shift, tile.z * kTileLeaves - shift};
    ++tile_;
    leaves_.resize(kTileSize);
    beyond_.clear();
    for (size_t n = begin; n < end; ++n) {
      const size_t start = index_in_tile(cells.pos(list[by_tile_[n].second]) - low);
      for (;;) {
        // A body that isn't known yet: flood from one of its voxels.
        const LeafMask& left = leaf_at(cells, low, start).left;
        int x = 0;
        while (x < 8 && !left.word[x]) ++x;
        if (x == 8) break;
        LeafMask seed_mask;
        seed_mask.word[x] = left.word[x] & -left.word[x];
        flood(cells, low, start, seed_mask);
        const auto any_page = [&](auto is) {
          return std::any_of(body_.begin(), body_.end(), [&](size_t index) { return is(leaves_[index].page); });
        };
        if (any_page(is_wavy)) continue;
        moved_in_.resize(cells.page_limit(), 0);
        const bool moved_before =
            any_page([&](PageId p) { return moved_in_[p] > last_round && moved_in_[p] != tile_; });
        if (!moved_before) {
          find_tops(cells, low, round, seed);
          if (!level_body(cells)) continue;
        }
        moved_in_.resize(cells.page_limit(), 0);
        for (const size_t index : body_) {
          leaves_[index].moved = true;
          if (!moved_before) moved_in_[leaves_[index].page] = tile_;
        }
      }
    }
    // Pages that hold a part of such a body go on being watched.
    for (size_t n = begin; n < end; ++n) {
      const Leaf& leaf = leaves_[index_in_tile(cells.pos(list[by_tile_[n].second]) - low)];
      result_.moved[by_tile_[n].second] = leaf.read == tile_ && leaf.moved;
    }
  }
  store_changes(cells);
  return result_;
}

}  // namespace sim
