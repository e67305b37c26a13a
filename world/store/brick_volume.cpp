#include "world/store/brick_volume.h"

#include <algorithm>

#include "world/base/jobs.h"

namespace world {

namespace {

constexpr uint32_t kEmptyRegionCode = kRegionSize - 1;
/// Words of ones that full leaves share.
constexpr uint32_t kSharedWords = 16;
constexpr uint32_t kFullCode = BrickVolume::kMixed;
/// Codes may take this much whatever the world holds, or this much for each mixed leaf: 0.12 byte a voxel.
constexpr uint64_t kCodeBytes = 64 << 20, kCodeBytesPerLeaf = 61;
constexpr int32_t kHighestTop = INT16_MAX;  // in leaves

/// Side - 1 of the largest aligned empty cube around an empty leaf of the region.
uint32_t empty_code(const MaskRegion* region, LeafPos l) {
  if (!region) return kEmptyRegionCode;
  const int group = leaf_group(l), bit = leaf_group_bit(l);
  if (region->any_groups >> group & 1) return (region->any[group] >> (bit & 42) & 0x00330033) == 0 ? 15 : 7;
  return (region->any_groups >> (group & 42) & 0x00330033) == 0 ? 63 : 31;
}

size_t mixed_leaves_of(const MaskRegion& region) {
  size_t mixed = 0;
  for (int g = 0; g < 64; ++g) mixed += static_cast<size_t>(std::popcount(region.any[g] & ~region.full[g]));
  return mixed;
}

}  // namespace

void BrickVolume::leaf_words(const LeafMask& mask, uint32_t* words) {
  for (int word = 0; word < kWordsPerLeaf; ++word) {
    const int x = word >> 1 & 4, y = word & 6, z = (word & 1) << 2;
    uint32_t bits = 0;
    for (int i = 0; i < 4; ++i) {
      // Two rows of y, a byte each, of which one nibble is wanted.
      const uint32_t rows = static_cast<uint32_t>(mask.word[x + i] >> (y * 8 + z));
      bits |= ((rows & 0xf) | (rows >> 4 & 0xf0)) << (8 * i);
    }
    words[word] = bits;
  }
}

BrickVolume::BrickVolume(const MaskVolume& volume) {
  if (volume.empty()) return;
  const std::vector<const MaskRegion*> regions = volume.regions();
  std::vector<size_t> first(regions.size() + 1, 0);
  for (size_t i = 0; i < regions.size(); ++i) first[i + 1] = first[i] + mixed_leaves_of(*regions[i]);
  mixed_leaves_ = first.back();
  const uint64_t most = std::max(kCodeBytes, kCodeBytesPerLeaf * mixed_leaves_) / sizeof(uint32_t);
  low_ = leaf_from_region(volume.min_region());
  uint64_t count = 1;
  for (int a = 0; a < 3; ++a) {
    const uint64_t size = static_cast<uint64_t>(int64_t{volume.max_region()[a]} - volume.min_region()[a] + 1);
    count = count > most ? count : count * size * kRegionLeaves;
    size_[a] = static_cast<int32_t>(size * kRegionLeaves);
  }
  if (count > most || mixed_leaves_ * kWordsPerLeaf > kFirstWord - kSharedWords || size_[1] > kHighestTop) return;

  codes_.assign(count, kEmptyRegionCode);
  words_.assign(kSharedWords + mixed_leaves_ * kWordsPerLeaf, ~0u);
  std::vector<VoxelBox> content(regions.size());
  parallel_for(regions.size(), [&](size_t i) {
    const MaskRegion& region = *regions[i];
    uint32_t word = kSharedWords + static_cast<uint32_t>(first[i]) * kWordsPerLeaf;
    const LeafPos corner = leaf_from_region(region.pos);
    for (int at = 0; at < kLeavesPerRegion; ++at) {
      const LeafPos l = leaf_offset_in_region(at);
      uint32_t& code = codes_[index(corner + l)];
      if (!region.leaf_any(l)) {
        code = empty_code(&region, l);
        continue;
      }
      const VoxelPos v = voxel_from_leaf(corner + l);
      content[i].include(VoxelBox{v, v + VoxelPos{7, 7, 7}});
      code = kFullCode;
      if (region.leaf_full(l)) continue;
      code = kMixed | word;
      leaf_words(region.leaf(l), words_.data() + word);
      word += kWordsPerLeaf;
    }
  });
  for (const VoxelBox& box : content) content_.include(box);
  find_tops();
}

/// All tops, and the columns in the codes.
void BrickVolume::find_tops() {
  const size_t columns = static_cast<size_t>(size_[0]) * static_cast<size_t>(size_[2]);
  for (int level = 0; level < kLevels; ++level) tops_[level].assign(columns >> (2 * level), -1);
  const auto column = [&](int32_t x, int32_t z) { return codes_.data() + index(low_ + LeafPos{x, 0, z}); };
  parallel_for(static_cast<size_t>(size_[0] / kRegionLeaves), [&](size_t slice) {
    const int32_t begin = static_cast<int32_t>(slice) * kRegionLeaves;  // no area crosses it
    for (int32_t x = begin; x < begin + kRegionLeaves; ++x)
      for (int32_t z = 0; z < size_[2]; ++z) {
        const uint32_t* codes = column(x, z);
        int32_t top = size_[1] - 1;
        while (top >= 0 && !(codes[top] & kMixed)) --top;
        if (top >= 0) set_cap(column(x, z)[top]);
        for (int level = 0; level < kLevels; ++level) {
          int16_t& highest = tops_[level][area(level, x, z)];
          highest = std::max(highest, static_cast<int16_t>(top));
        }
      }
    for (int32_t x = begin; x < begin + kRegionLeaves; ++x)
      for (int32_t z = 0; z < size_[2]; ++z) {
        uint32_t* codes = column(x, z);
        for (int32_t y = tops_[0][area(0, x, z)] + 1; y < size_[1]; ++y) codes[y] = with_column(codes[y], {x, y, z});
      }
  });
}

/// The code of an empty leaf in a cube of this side.
uint32_t BrickVolume::with_column(uint32_t side, LeafPos l) const {
  for (int level = kLevels - 1; level >= 0; --level)
    if (tops_[level][area(level, l.x, l.z)] < l.y) {
      const uint32_t column = (uint32_t{kLeafSize} << level) - 1;
      return column >= side ? side | column << kColumnShift : side;
    }
  return side;
}

/// Of the highest leaf of a column that isn't empty.
void BrickVolume::set_cap(uint32_t& code) const {
  const uint32_t first = code & kFirstWord;
  if (first == 0) return;  // full
  const uint32_t* words = words_.data() + first;
  int row = 8;
  for (; row > 0; --row) {
    const int pair = (row - 1) & 6;
    const uint32_t both = words[pair] | words[pair + 1] | words[8 + pair] | words[9 + pair];
    if (both & (0x0f0f0f0fu << ((row - 1) % 2 * 4))) break;
  }
  code = kMixed | first | (row < 8 ? kCapped | static_cast<uint32_t>(row) : 0);
}

/// After the leaf ceased to be empty, or became so.
void BrickVolume::update_tops(LeafPos l, bool empty) {
  int32_t below = l.y - 1;  // what may have become the top
  if (empty) {
    const uint32_t* codes = codes_.data() + index(low_ + LeafPos{l.x, 0, l.z});
    while (below >= 0 && !(codes[below] & kMixed)) --below;
  }
  for (int level = 0; level < kLevels; ++level) {
    int16_t& top = tops_[level][area(level, l.x, l.z)];
    const int16_t before = top;
    if (!empty) {
      if (top >= l.y) return;
      top = static_cast<int16_t>(l.y);
    } else {
      if (top > l.y) return;
      int16_t highest = static_cast<int16_t>(below);
      if (level > 0)
        for (int part = 0; part < 4; ++part)
          highest =
              std::max(highest, tops_[level - 1][area(level - 1, (l.x >> level << level) + (part >> 1 << (level - 1)),
                                                      (l.z >> level << level) + ((part & 1) << (level - 1)))]);
      top = highest;
      if (top == before) return;
    }
    if (level == 0) {
      uint32_t* codes = codes_.data() + index(low_ + LeafPos{l.x, 0, l.z});
      if (before >= 0 && codes[before] & kMixed) codes[before] &= ~kCap;
      if (top >= 0) set_cap(codes[top]);
    }
    const int32_t side = 1 << level;
    for (int32_t x = l.x & -side; x < (l.x & -side) + side; ++x)
      for (int32_t z = l.z & -side; z < (l.z & -side) + side; ++z) {
        uint32_t* codes = codes_.data() + index(low_ + LeafPos{x, 0, z});
        for (int32_t y = std::min(before, top) + 1; y <= std::max(before, top); ++y)
          if (!(codes[y] & kMixed)) codes[y] = with_column(codes[y] & kSide, {x, y, z});
      }
  }
}

size_t BrickVolume::bytes() const {
  size_t columns = 0;
  for (const auto& level : tops_) columns += level.capacity();
  return (codes_.capacity() + words_.capacity() + free_words_.capacity()) * sizeof(uint32_t) +
         columns * sizeof(int16_t);
}

bool BrickVolume::inside(LeafPos l) const {
  for (int a = 0; a < 3; ++a)
    if (l[a] < low_[a] || int64_t{l[a]} - low_[a] >= size_[a]) return false;
  return true;
}

bool BrickVolume::test(VoxelPos v) const {
  const LeafPos leaf = leaf_from_voxel(v);
  if (!walkable() || !inside(leaf)) return false;
  const uint32_t c = code(leaf);
  return (c & kMixed) && (words_[(c & kFirstWord) + uint32_t(word_in_leaf(v))] >> bit_in_word(v) & 1);
}

void BrickVolume::update(const MaskVolume& volume, LeafPos leaf) {
  const MaskRegion* region = volume.region(region_from_leaf(leaf));
  if (!walkable() || !inside(leaf)) {
    if (region) *this = BrickVolume(volume);
    return;
  }
  uint32_t& code = codes_[index(leaf)];
  const LeafMask& mask = region ? region->leaf(leaf) : kNoneMask;
  const uint32_t before = code;
  if (mask.is_none() && !(before & kMixed)) return;
  const bool was_mixed = before & kMixed && (before & kFirstWord), is_mixed = !mask.is_none() && !mask.is_all();
  if (was_mixed && !is_mixed) free_words_.push_back(before & kFirstWord), --mixed_leaves_;
  if (!is_mixed) {
    code = mask.is_none() ? empty_code(region, leaf) : kFullCode;
  } else {
    uint32_t word = before & kFirstWord;
    if (!was_mixed) {
      ++mixed_leaves_;
      if (free_words_.empty()) {
        word = static_cast<uint32_t>(words_.size());
        words_.resize(words_.size() + kWordsPerLeaf);
      } else {
        word = free_words_.back();
        free_words_.pop_back();
      }
    }
    leaf_words(mask, words_.data() + word);
    code = kMixed | word;
  }
  if (!mask.is_none()) {
    const VoxelPos v = voxel_from_leaf(leaf);
    content_.include(VoxelBox{v, v + VoxelPos{7, 7, 7}});
  }
  if ((before & kMixed) == (code & kMixed)) {
    if (code & kMixed && tops_[0][area(0, leaf.x - low_.x, leaf.z - low_.z)] == leaf.y - low_.y) set_cap(code);
    return;
  }
  // Empty cubes around it came or went: those of leaves within the largest that holds it.
  const int32_t side = static_cast<int32_t>(((code & kMixed ? before : code) & kSide) + 1) / kLeafSize;
  const LeafPos corner{leaf.x & -side, leaf.y & -side, leaf.z & -side};
  for (int32_t x = 0; x < side; ++x)
    for (int32_t z = 0; z < side; ++z) {
      uint32_t* column = codes_.data() + index(corner + LeafPos{x, 0, z});
      for (int32_t y = 0; y < side; ++y)
        if (!(column[y] & kMixed))
          column[y] = with_column(empty_code(region, corner + LeafPos{x, y, z}), corner + LeafPos{x, y, z} - low_);
    }
  update_tops(leaf - low_, !(code & kMixed));
}

}  // namespace world
