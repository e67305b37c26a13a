#include "sim/matter/liquid_level.h"

#include <algorithm>
#include <bit>
#include <tuple>

#include "sim/matter/liquid_kernel.h"
#include "world/base/random.h"
#include "world/store/leaf_flood.h"

namespace sim {

using world::BlockId;
using world::LeafMask;
using world::LeafPos;
using world::VoxelPos;

namespace {

constexpr int kTileLeaves = 16;
constexpr int kMostGiven = kFullVoxel / 2;
constexpr int kMostOfVoxel = kFullVoxel / 4 * 3;

size_t index_in_tile(LeafPos d) { return static_cast<size_t>((d.x * kTileLeaves + d.y) * kTileLeaves + d.z); }
LeafPos offset_in_tile(size_t index) {
  return {static_cast<int32_t>(index / 256), static_cast<int32_t>(index / 16 % 16), static_cast<int32_t>(index % 16)};
}
bool inside_tile(LeafPos d) {
  const auto in = [](int32_t c) { return c >= 0 && c < kTileLeaves; };
  return in(d.x) && in(d.y) && in(d.z);
}
}  // namespace

void LiquidLevels::read(Cells& cells, BlockId liquid, Leaf& leaf) {
  leaf.full = leaf.part = leaf.most = leaf.air = {};
  if (leaf.page == kClosedPage) return;
  const BlockId* blocks = cells.find_blocks(leaf.page);
  if (!blocks) {
    leaf.air = without(world::kAllMask, cells.occupied_mask(leaf.page));
    return;
  }
  const LiquidMasks masks = masks_of(blocks, cells.find_amounts(leaf.page), liquid, kMostOfVoxel);
  leaf.full = masks.full, leaf.part = masks.part, leaf.most = masks.most, leaf.air = masks.air;
}

/// A leaf of the tile whose lowest leaf is `low`, read on the first look.
LiquidLevels::Leaf& LiquidLevels::leaf_at(Cells& cells, LeafPos low, LeafPos d) {
  Leaf& leaf = leaves_[index_in_tile(d)];
  if (leaf.read == tile_) return leaf;
  leaf.read = tile_;
  leaf.moved = false;
  leaf.page = cells.open(low + d);
  read(cells, liquid_, leaf);
  leaf.conduit = {};
  if (!leaf.part.is_none()) {
    Leaf above;
    above.page = cells.open(low + d + LeafPos{0, 1, 0});
    read(cells, liquid_, above);
    const auto up = [](const LeafMask& own, const LeafMask& next) {
      return world::across(own, next, world::kFacePosY);
    };
    const LeafMask air_above = up(leaf.air, above.air), part_above = up(leaf.part, above.part);
    leaf.conduit = without(without(leaf.part, air_above), part_above) | (leaf.most & part_above);
  }
  leaf.left = leaf.full | leaf.conduit;
  return leaf;
}

/// Moves from the highest tops to the lowest.
bool LiquidLevels::level_body(Cells& cells, BlockId liquid, uint64_t& changed) {
  if (tops_.size() < 2) return false;
  std::sort(tops_.begin(), tops_.end(), [](const Top& a, const Top& b) {
    return std::tie(a.head_y, a.amount, a.order) < std::tie(b.head_y, b.amount, b.order);
  });
  const auto head = [](const Top& t) { return int64_t{t.head_y} * kFullVoxel + t.amount; };
  bool any = false;
  const auto change = [&](VoxelPos v, int by) {
    const PageId p = cells.find(world::leaf_from_voxel(v));
    const int i = world::index_in_leaf(v);
    const int now = (cells.block(p, i) == liquid ? cells.amount(p, i) : 0) + by;
    Cell cell = cells.cell(p, i);
    cell.block = now > 0 ? liquid : world::kAir;
    cell.amount = static_cast<uint16_t>(now);
    cells.put(p, i, cell);
    LeafMask mask;
    mask.set(i);
    cells.open_around(p);
    cells.stir(p, mask);
    ++changed;
  };
  const auto can_give = [](const Top& t) { return t.below_air ? kMostGiven : std::min(t.amount, kMostGiven); };
  const auto can_take = [](const Top& t) { return std::min(kFullVoxel - t.amount, kMostGiven); };
  size_t low = 0, high = tops_.size() - 1;
  int gives = can_give(tops_[high]), takes = can_take(tops_[low]);
  int64_t head_from = head(tops_[high]), head_to = head(tops_[low]);
  int given_all = 0, taken_all = 0;
  const auto leave_high = [&] {
    const Top& from = tops_[high];
    if (given_all > 0) change(from.below_air ? from.v - VoxelPos{0, 1, 0} : from.v, -given_all);
    given_all = 0;
    if (--high > low) gives = can_give(tops_[high]), head_from = head(tops_[high]);
  };
  const auto leave_low = [&] {
    if (taken_all > 0) change(tops_[low].v, taken_all);
    taken_all = 0;
    if (++low < high) takes = can_take(tops_[low]), head_to = head(tops_[low]);
  };
  while (low < high) {
    if (tops_[high].beside || gives == 0) {
      leave_high();
      continue;
    }
    const int64_t difference = head_from - head_to;
    if (difference < 2 && given_all == 0 && taken_all == 0) break;
    const int given = static_cast<int>(std::max<int64_t>(0, std::min<int64_t>({difference / 2, gives, takes})));
    gives -= given, takes -= given;
    head_from -= given, head_to += given;
    given_all += given, taken_all += given;
    any |= given > 0;
    // Two that are level now are done; else the one that can't give or take more.
    const bool level = given >= difference / 2;
    if (level || gives == 0) leave_high();
    if (level || takes == 0) leave_low();
  }
  if (given_all > 0) leave_high();
  if (taken_all > 0) leave_low();
  return any;
}

/// Where the body in hand ends upwards and sideways, each voxel once.
void LiquidLevels::find_tops(Cells& cells, LeafPos low, uint64_t round, uint64_t seed) {
  tops_.clear();
  beside_.clear();
  Leaf outside;
  const Leaf nothing;
  constexpr world::Face kOpen[] = {world::kFacePosY, world::kFaceNegX, world::kFacePosX, world::kFaceNegZ,
                                   world::kFacePosZ};
  const auto add = [&](VoxelPos v, bool is_air, bool beside) {
    Top top;
    top.v = v;
    top.head_y = v.y;
    top.below_air = is_air;
    top.beside = beside;
    top.amount = is_air ? 0 : cells.amount(cells.find(world::leaf_from_voxel(v)), world::index_in_leaf(v));
    top.order = world::random_bits(seed, v.x, v.y, v.z, round, 5);
    (beside ? beside_ : tops_).push_back(top);
  };
  const auto each = [](const LeafMask& mask, auto visit) {
    world::for_each_voxel(mask, [&](int index) { visit(world::offset_in_leaf(index)); });
  };
  const auto is_body = [&](VoxelPos v) {
    const LeafPos d = world::leaf_from_voxel(v) - low;
    if (!inside_tile(d)) return false;
    const Leaf& leaf = leaves_[index_in_tile(d)];
    return leaf.read == tile_ && leaf.in_body == number_ && leaf.body.test(v) && leaf.full.test(v);
  };
  for (const size_t index : body_) {
    const LeafPos d = offset_in_tile(index);
    const Leaf& leaf = leaves_[index];
    const VoxelPos corner = world::voxel_from_leaf(low + d);
    each(leaf.body & leaf.conduit, [&](VoxelPos o) {
      if (!is_body(corner + o - VoxelPos{0, 1, 0})) add(corner + o, false, true);
    });
    const LeafMask part = leaf.body & leaf.full;
    for (const world::Face face : kOpen) {
      const VoxelPos step = world::face_step(face);
      // Voxels of the body beside which the surface may lie, which may be in the next leaf, or of another tile.
      const Leaf* beyond = &nothing;
      if (!(part & world::side_of(face)).is_none()) {
        const LeafPos next = d + LeafPos{step.x, step.y, step.z};
        if (inside_tile(next) && leaves_[index_in_tile(next)].read == tile_) {
          beyond = &leaves_[index_in_tile(next)];
        } else {
          outside.page = cells.open(low + next);
          read(cells, liquid_, outside);
          beyond = &outside;
        }
      }
      for (const bool is_air : {true, false}) {
        const LeafMask there =
            is_air ? world::across(leaf.air, beyond->air, face) : world::across(leaf.part, beyond->part, face);
        each(part & there, [&](VoxelPos o) {
          const VoxelPos v = corner + o + step;
          // What lies above one voxel of the body and beside another is above it.
          if (face != world::kFacePosY && is_body(v - VoxelPos{0, 1, 0})) return;
          add(v, is_air, face != world::kFacePosY);
        });
      }
    }
  }
  // Conduits and what lies beside two voxels of the body come twice.
  std::sort(beside_.begin(), beside_.end(), [](const Top& a, const Top& b) { return a.v < b.v; });
  beside_.erase(std::unique(beside_.begin(), beside_.end(), [](const Top& a, const Top& b) { return a.v == b.v; }),
                beside_.end());
  tops_.insert(tops_.end(), beside_.begin(), beside_.end());
}

LiquidLevels::Result LiquidLevels::level(Cells& cells, BlockId liquid, std::span<const PageId> pages, uint64_t round,
                                         uint64_t seed) {
  liquid_ = liquid;
  Result result;
  result.moved.assign(pages.size(), 0);
  const int32_t shift = round & 1 ? kTileLeaves / 2 : 0;
  const auto tile_of = [&](LeafPos l) { return LeafPos{(l.x + shift) >> 4, (l.y + shift) >> 4, (l.z + shift) >> 4}; };
  // By tiles, in order.
  std::vector<std::pair<LeafPos, size_t>> by_tile;
  for (size_t n = 0; n < pages.size(); ++n) by_tile.emplace_back(tile_of(cells.pos(pages[n])), n);
  std::sort(by_tile.begin(), by_tile.end());
  world::LeafFront front;
  for (size_t begin = 0, end; begin < by_tile.size(); begin = end) {
    const LeafPos tile = by_tile[begin].first;
    for (end = begin; end < by_tile.size() && by_tile[end].first == tile;) ++end;
    const LeafPos low{tile.x * kTileLeaves - shift, tile.y * kTileLeaves - shift, tile.z * kTileLeaves - shift};
    leaves_.resize(size_t{kTileLeaves} * kTileLeaves * kTileLeaves);
    ++tile_;
    for (size_t n = begin; n < end; ++n) {
      const LeafPos start = cells.pos(pages[by_tile[n].second]) - low;
      for (;;) {
        // A body that isn't known yet: flood from one of its voxels.
        LeafMask seed_mask;
        {
          const LeafMask& left = leaf_at(cells, low, start).left;
          int x = 0;
          while (x < 8 && !left.word[x]) ++x;
          if (x == 8) break;
          seed_mask.word[x] = left.word[x] & -left.word[x];
        }
        body_.clear();
        ++number_;
        front.assign(1, {index_in_tile(start), seed_mask});
        world::flood_leaves(
            front, [&](size_t index) -> LeafMask& { return leaf_at(cells, low, offset_in_tile(index)).left; },
            [&](size_t index, int face) {
              const VoxelPos step = world::face_step(face);
              const LeafPos next = offset_in_tile(index) + LeafPos{step.x, step.y, step.z};
              return inside_tile(next) ? index_in_tile(next) : world::kNoLeaf;
            },
            [&](size_t index, const LeafMask& fresh) {
              Leaf& leaf = leaves_[index];
              if (leaf.in_body != number_) {
                leaf.in_body = number_;
                leaf.body = {};
                body_.push_back(index);
              }
              leaf.body = leaf.body | fresh;
              return true;
            });
        find_tops(cells, low, round, seed);
        if (!level_body(cells, liquid, result.voxels_changed)) continue;
        for (const size_t index : body_) leaves_[index].moved = true;
      }
    }
    // Pages that hold a part of such a body go on being watched.
    for (size_t n = begin; n < end; ++n) {
      const Leaf& leaf = leaves_[index_in_tile(cells.pos(pages[by_tile[n].second]) - low)];
      result.moved[by_tile[n].second] = leaf.read == tile_ && leaf.moved;
    }
  }
  return result;
}

}  // namespace sim
