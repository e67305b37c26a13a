#include "world/store/brick_volume.h"

#include <algorithm>

#include "world/base/jobs.h"

namespace world {

namespace {

constexpr uint32_t kEmptyRegionCode = kRegionSize - 1;
/// Where a code of an empty leaf is taken for an index of words, it lies below this.
constexpr uint32_t kSharedWords = 128;
constexpr uint32_t kFullCode = BrickVolume::kMixed;
/// Codes may take this much whatever the world holds, or this much for each mixed leaf: 0.12 byte a voxel.
constexpr uint64_t kCodeBytes = 64 << 20, kCodeBytesPerLeaf = 61;

void words_from_mask(const LeafMask& mask, uint32_t* words) {
  for (int word = 0; word < BrickVolume::kWordsPerLeaf; ++word) {
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
  if (count > most || mixed_leaves_ * kWordsPerLeaf > kFirstWord - kSharedWords) return;

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
      words_from_mask(region.leaf(l), words_.data() + word);
      word += kWordsPerLeaf;
    }
  });
  for (const VoxelBox& box : content) content_.include(box);
}

size_t BrickVolume::bytes() const {
  return (codes_.capacity() + words_.capacity() + free_words_.capacity()) * sizeof(uint32_t);
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
    words_from_mask(mask, words_.data() + word);
    code = kMixed | word;
  }
  if (!mask.is_none()) {
    const VoxelPos v = voxel_from_leaf(leaf);
    content_.include(VoxelBox{v, v + VoxelPos{7, 7, 7}});
  }
  if ((before & kMixed) == (code & kMixed)) return;
  // Empty cubes around it came or went: those of leaves within the largest that holds it.
  const int32_t side = static_cast<int32_t>((code & kMixed ? before : code) + 1) / kLeafSize;
  const LeafPos corner{leaf.x & -side, leaf.y & -side, leaf.z & -side};
  for (int32_t x = 0; x < side; ++x)
    for (int32_t z = 0; z < side; ++z) {
      uint32_t* column = codes_.data() + index(corner + LeafPos{x, 0, z});
      for (int32_t y = 0; y < side; ++y)
        if (!(column[y] & kMixed)) column[y] = empty_code(region, corner + LeafPos{x, y, z});
    }
}

}  // namespace world
