#include "render/extract/cavities.h"

#include <algorithm>
#include <memory>

#include "render/extract/kernels.h"

namespace render {

using namespace world;

namespace {

/// Bits of a leaf's own border towards `face` whose neighbours in the next leaf are set in `next`.
void add_border(int face, const LeafMask& next, LeafMask& entry) {
  constexpr uint64_t kZ0 = 0x0101010101010101ull;
  switch (face) {
    case kFaceNegX:
      entry.word[0] |= next.word[7];
      return;
    case kFacePosX:
      entry.word[7] |= next.word[0];
      return;
    default:
      break;
  }
  for (int x = 0; x < 8; ++x) {
    const uint64_t n = next.word[x];
    entry.word[x] |= face == kFaceNegY   ? n >> 56
                     : face == kFacePosY ? n << 56
                     : face == kFaceNegZ ? n >> 7 & kZ0
                                         : (n & kZ0) << 7;
  }
}

/// Whether any bit at the border towards `face` is set.
bool touches_border(int face, const LeafMask& m) {
  if (face == kFaceNegX) return m.word[0] != 0;
  if (face == kFacePosX) return m.word[7] != 0;
  constexpr uint64_t kBorder[kFaces] = {0, 0, 0xff, 0xffull << 56, 0x0101010101010101ull, 0x8080808080808080ull};
  uint64_t any = 0;
  for (uint64_t w : m.word) any |= w;
  return (any & kBorder[face]) != 0;
}

LeafPos beside(LeafPos l, int face) {
  const VoxelPos s = face_step(face);
  return {l.x + s.x, l.y + s.y, l.z + s.z};
}

/// One region during the flood. A leaf without opaque voxels is reached as a whole; a mixed one has a mask.
struct FloodRegion {
  const MaskRegion* opaque;
  std::array<uint64_t, 64> reached_open{};  // by group and bit, as MaskRegion::any
  std::array<uint64_t, 64> queued{};
  std::vector<LeafMask> reached;  // by slot of the opaque masks
  std::vector<uint16_t> queue;    // index_in_region
  bool waiting = false;

  explicit FloodRegion(const MaskRegion& r) : opaque(&r), reached(r.masks.size()) {}
  const LeafMask& mask(LeafPos l) const {
    const int g = leaf_group(l);
    const uint64_t bit = 1ull << leaf_group_bit(l);
    if (opaque->any[g] & ~opaque->full[g] & bit) return reached[opaque->slot[index_in_region(l)]];
    return reached_open[g] & bit ? kAllMask : kNoneMask;
  }
};

class Flood {
 public:
  explicit Flood(const MaskVolume& opaque) : min_(opaque.min_region()), max_(opaque.max_region()) {
    uint64_t volume = 1;
    constexpr uint64_t kMostRegions = 1u << 20;
    for (int a = 0; a < 3; ++a) {
      size_[a] = static_cast<uint64_t>(int64_t{max_[a]} - min_[a] + 1);
      volume = volume > kMostRegions ? volume : volume * size_[a];
    }
    for (const MaskRegion* r : opaque.regions()) {
      by_pos_.emplace(r->pos, static_cast<uint32_t>(regions_.size()));
      regions_.emplace_back(*r);
    }
    if (volume <= kMostRegions) {
      grid_.assign(volume, kEmpty);
      for (uint32_t i = 0; i < regions_.size(); ++i) grid_[cell(regions_[i].opaque->pos)] = i;
    }
  }

  void run() {
    enter_from_outside();
    while (!waiting_.empty() || !open_regions_.empty()) {
      if (!open_regions_.empty()) {
        const RegionPos r = open_regions_.back();
        open_regions_.pop_back();
        for (int f = 0; f < kFaces; ++f) enter_region(step(r, f), opposite_face(f));
        continue;
      }
      FloodRegion& region = regions_[waiting_.back()];
      waiting_.pop_back();
      region.waiting = false;
      // Newest first would go deep and come back often: take a whole round at a time.
      std::vector<uint16_t> round;
      while (!region.queue.empty()) {
        round.swap(region.queue);
        for (const uint16_t index : round) visit(region, index);
        round.clear();
      }
    }
  }

  MaskVolume unreached() const {
    MaskVolume sealed;
    for (const FloodRegion& region : regions_) {
      std::unique_ptr<MaskRegion> out;
      const auto add = [&](int g, int bit, const LeafMask& mask) {
        if (mask.is_none()) return;
        if (!out) out = std::make_unique<MaskRegion>();
        const LeafPos first = leaf_from_region(region.opaque->pos);
        set_region_leaf(*out,
                        {first.x + (g >> 4) * 4 + (bit >> 4), first.y + (g >> 2 & 3) * 4 + (bit >> 2 & 3),
                         first.z + (g & 3) * 4 + (bit & 3)},
                        mask);
      };
      for (int g = 0; g < 64; ++g) {
        const uint64_t any = region.opaque->any[g];
        for (uint64_t bits = ~any & ~region.reached_open[g]; bits != 0; bits &= bits - 1)
          add(g, __builtin_ctzll(bits), kAllMask);
        for (uint64_t bits = any & ~region.opaque->full[g]; bits != 0; bits &= bits - 1) {
          const int bit = __builtin_ctzll(bits);
          const LeafPos l{(g >> 4) * 4 + (bit >> 4), (g >> 2 & 3) * 4 + (bit >> 2 & 3), (g & 3) * 4 + (bit & 3)};
          const uint32_t slot = region.opaque->slot[index_in_region(l)];
          LeafMask mask;
          for (int x = 0; x < 8; ++x)
            mask.word[x] = ~region.opaque->masks[slot].word[x] & ~region.reached[slot].word[x];
          add(g, bit, mask);
        }
      }
      if (out) sealed.put_region(region.opaque->pos, std::move(out));
    }
    for (uint64_t c = 0; c < grid_.size(); ++c) {
      if (grid_[c] != kEmpty) continue;
      auto out = std::make_unique<MaskRegion>();
      out->any.fill(~0ull), out->full.fill(~0ull), out->any_groups = ~0ull;
      const auto at = [&](int a, uint64_t n) { return min_[a] + static_cast<int32_t>(n); };
      sealed.put_region({at(0, c / (size_[1] * size_[2])), at(1, c / size_[2] % size_[1]), at(2, c % size_[2])},
                        std::move(out));
    }
    sealed.finish();
    return sealed;
  }

 private:
  static constexpr uint32_t kEmpty = 0xffffffff, kEmptyReached = 0xfffffffe;

  bool inside(RegionPos r) const {
    for (int a = 0; a < 3; ++a)
      if (r[a] < min_[a] || r[a] > max_[a]) return false;
    return true;
  }
  size_t cell(RegionPos r) const {
    const auto d = [&](int a) { return static_cast<uint64_t>(int64_t{r[a]} - min_[a]); };
    return (d(0) * size_[1] + d(1)) * size_[2] + d(2);
  }
  /// The number of a region with opaque voxels, or kEmpty or kEmptyReached.
  uint32_t look_up(RegionPos r) const {
    if (!inside(r)) return kEmptyReached;
    if (!grid_.empty()) return grid_[cell(r)];
    const auto found = by_pos_.find(r);
    return found == by_pos_.end() ? kEmptyReached : found->second;
  }
  static RegionPos step(RegionPos r, int face) {
    const VoxelPos s = face_step(face);
    return {r.x + s.x, r.y + s.y, r.z + s.z};
  }

  void push(uint32_t number, LeafPos l) {
    FloodRegion& region = regions_[number];
    const int g = leaf_group(l);
    const uint64_t bit = 1ull << leaf_group_bit(l);
    if ((region.opaque->full[g] | region.reached_open[g] | region.queued[g]) & bit) return;
    region.queued[g] |= bit;
    region.queue.push_back(static_cast<uint16_t>(index_in_region(l)));
    if (!region.waiting) waiting_.push_back(number), region.waiting = true;
  }

  /// A region without an opaque voxel is reached as a whole; false where it has some.
  bool reached_as_empty(RegionPos r, uint32_t number) {
    if (number == kEmpty) {
      grid_[cell(r)] = kEmptyReached;
      open_regions_.push_back(r);
    }
    return number == kEmpty || number == kEmptyReached;
  }

  /// Everything beyond the side `face` of a region is reached.
  void enter_region(RegionPos r, int face) {
    const uint32_t number = look_up(r);
    if (reached_as_empty(r, number)) return;
    const LeafPos first = leaf_from_region(r);
    const int axis = face_axis(face), u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    for (int i = 0; i < kRegionLeaves; ++i)
      for (int k = 0; k < kRegionLeaves; ++k) {
        LeafPos l = first;
        l[axis] += face_sign(face) > 0 ? kRegionLeaves - 1 : 0;
        l[u] += i, l[v] += k;
        push(number, l);
      }
  }

  void enter_from_outside() {
    // Regions at the bounds, and without a grid every region beside one that has no opaque voxel.
    for (const FloodRegion& region : regions_)
      for (int f = 0; f < kFaces; ++f)
        if (look_up(step(region.opaque->pos, f)) == kEmptyReached) enter_region(region.opaque->pos, f);
    for (size_t c = 0; c < grid_.size(); ++c) {
      if (grid_[c] != kEmpty) continue;
      const uint64_t x = c / (size_[1] * size_[2]), y = c / size_[2] % size_[1], z = c % size_[2];
      if (x && y && z && x + 1 < size_[0] && y + 1 < size_[1] && z + 1 < size_[2]) continue;
      grid_[c] = kEmptyReached;
      open_regions_.push_back(
          {min_.x + static_cast<int32_t>(x), min_.y + static_cast<int32_t>(y), min_.z + static_cast<int32_t>(z)});
    }
  }

  void visit(FloodRegion& region, int index) {
    const LeafPos first = leaf_from_region(region.opaque->pos), o = leaf_offset_in_region(index);
    const LeafPos l{first.x + o.x, first.y + o.y, first.z + o.z};
    const int g = leaf_group(l);
    const uint64_t bit = 1ull << leaf_group_bit(l);
    region.queued[g] &= ~bit;
    if ((region.opaque->any[g] & bit) == 0) {
      region.reached_open[g] |= bit;
      for (int f = 0; f < kFaces; ++f) pass_on(region, l, f);
      return;
    }
    const uint32_t slot = region.opaque->slot[index];
    LeafMask open, entry;
    for (int x = 0; x < 8; ++x) open.word[x] = ~region.opaque->masks[slot].word[x];
    for (int f = 0; f < kFaces; ++f) add_border(f, reached_at(region, beside(l, f)), entry);
    LeafMask& reached = region.reached[slot];
    const LeafMask before = reached;
    if (!flood_leaf(open, entry, reached)) return;
    LeafMask fresh;
    for (int x = 0; x < 8; ++x) fresh.word[x] = reached.word[x] & ~before.word[x];
    for (int f = 0; f < kFaces; ++f)
      if (touches_border(f, fresh)) pass_on(region, l, f);
  }

  const LeafMask& reached_at(const FloodRegion& region, LeafPos l) const {
    const RegionPos r = region_from_leaf(l);
    if (r == region.opaque->pos) return region.mask(l);
    const uint32_t number = look_up(r);
    if (number == kEmpty) return kNoneMask;
    return number == kEmptyReached ? kAllMask : regions_[number].mask(l);
  }

  void pass_on(const FloodRegion& region, LeafPos l, int face) {
    const LeafPos to = beside(l, face);
    const RegionPos r = region_from_leaf(to);
    if (r == region.opaque->pos) {
      push(static_cast<uint32_t>(&region - regions_.data()), to);
      return;
    }
    const uint32_t number = look_up(r);
    if (reached_as_empty(r, number)) return;
    push(number, to);
  }

  RegionPos min_, max_;
  uint64_t size_[3];
  std::vector<FloodRegion> regions_;
  std::unordered_map<RegionPos, uint32_t, PosHash> by_pos_;
  std::vector<uint32_t> grid_;  // by position in the bounds: number of the region, kEmpty or kEmptyReached
  std::vector<uint32_t> waiting_;
  std::vector<RegionPos> open_regions_;  // empty regions just reached
};

}  // namespace

MaskVolume find_sealed_cavities(const MaskVolume& opaque) {
  if (opaque.empty()) return {};
  Flood flood(opaque);
  flood.run();
  return flood.unreached();
}

std::vector<LeafPos> reopen_cavities(MaskVolume& sealed, const MaskVolume& opaque, std::span<const LeafPos> dirty) {
  std::vector<LeafPos> changed, queue;
  if (sealed.empty()) return changed;
  for (const LeafPos l : dirty) {
    const LeafMask& was = sealed.leaf(l);
    LeafMask now;
    for (int x = 0; x < 8; ++x) now.word[x] = was.word[x] & ~opaque.leaf(l).word[x];
    if (now != was) sealed.set_leaf(l, now), changed.push_back(l);
    queue.push_back(l);
    for (int f = 0; f < kFaces; ++f) queue.push_back(beside(l, f));
  }
  // Flood into sealed voxels from those that are open and not sealed.
  const auto reachable = [&](LeafPos l) {
    LeafMask m;
    const LeafMask &o = opaque.leaf(l), &s = sealed.leaf(l);
    for (int x = 0; x < 8; ++x) m.word[x] = ~o.word[x] & ~s.word[x];
    return m;
  };
  while (!queue.empty()) {
    const LeafPos l = queue.back();
    queue.pop_back();
    const LeafMask closed = sealed.leaf(l);
    if (closed.is_none()) continue;
    LeafMask open = reachable(l);
    for (int x = 0; x < 8; ++x) open.word[x] |= closed.word[x];
    // What is reachable inside the leaf enters too; the rest of `open` is sealed.
    LeafMask entry = reachable(l), reached;
    for (int f = 0; f < kFaces; ++f) add_border(f, reachable(beside(l, f)), entry);
    flood_leaf(open, entry, reached);
    LeafMask still;
    for (int x = 0; x < 8; ++x) still.word[x] = closed.word[x] & ~reached.word[x];
    if (still == closed) continue;
    sealed.set_leaf(l, still);
    changed.push_back(l);
    for (int f = 0; f < kFaces; ++f) queue.push_back(beside(l, f));
  }
  std::sort(changed.begin(), changed.end());
  changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
  return changed;
}

}  // namespace render
