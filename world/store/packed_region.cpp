#include "world/store/packed_region.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace world {

namespace {

constexpr int kMostPlanes = 9;  // 512 voxels hold at most 512 blocks
constexpr int kWordsOfPlainIds = kLeafVoxels / 4;

constexpr int planes_for(size_t blocks) { return std::bit_width(blocks - 1); }
constexpr size_t palette_words(size_t blocks) { return (blocks + 3) / 4; }

/// Bit i: row[i] == block, of 64 ids.
uint64_t equal_bits(const BlockId* row, BlockId block) {
  uint8_t equal[64];
  for (int i = 0; i < 64; ++i) equal[i] = row[i] == block;
  uint64_t bits = 0;
  for (int i = 0; i < 8; ++i) {
    uint64_t eight;
    std::memcpy(&eight, equal + 8 * i, 8);
    bits |= (eight * 0x0102040810204080ull >> 56) << (8 * i);
  }
  return bits;
}

/// Bit i of the eight becomes byte 7 - i, 0 or 1.
uint64_t spread_eight_bits(uint64_t eight) { return eight * 0x8040201008040201ull >> 7 & 0x0101010101010101ull; }

/// The voxels of word x whose planes spell `number`.
uint64_t voxels_of_number(const uint64_t* planes, int plane_count, int x, size_t number) {
  uint64_t voxels = ~uint64_t{0};
  for (int k = 0; k < plane_count; ++k) {
    const uint64_t plane = planes[x * plane_count + k];
    voxels &= number >> k & 1 ? plane : ~plane;
  }
  return voxels;
}

constexpr size_t kMostTerms = 16;  // blocks of a leaf up to which going by number beats going by voxel

/// The palette of a leaf and its bit planes.
struct LeafPlanes {
  size_t blocks = 0;
  BlockId palette[kLeafVoxels];
  uint64_t plane[8][kMostPlanes];  // by word of the mask, then plane

  explicit LeafPlanes(const BlockId* values) {
    // A sparse set: place[b] is b's place in the palette where palette[place[b]] == b, and anything elsewhere.
    thread_local std::vector<uint16_t> place(kMaxBlocks, 0);
    const auto place_of = [&](BlockId b) -> size_t {
      const size_t known = place[b];
      if (known < blocks && palette[known] == b) return known;
      place[b] = static_cast<uint16_t>(blocks);
      palette[blocks] = b;
      return blocks++;
    };
    std::memset(plane, 0, sizeof plane);
    for (int x = 0; x < 8; ++x) {
      const BlockId* row = values + 64 * x;
      uint64_t rest = ~uint64_t{0};
      // Few blocks make up a row: place each at once, and voxel by voxel only where there are many.
      for (int kind = 0; rest && kind < 8; ++kind) {
        const BlockId block = row[std::countr_zero(rest)];
        const uint64_t same = equal_bits(row, block) & rest;
        add(x, same, place_of(block));
        rest &= ~same;
      }
      for (; rest; rest &= rest - 1) add(x, rest & -rest, place_of(row[std::countr_zero(rest)]));
    }
  }

 private:
  void add(int x, uint64_t voxels, size_t number) {
    for (int k = 0; number >> k; ++k)
      if (number >> k & 1) plane[x][k] |= voxels;
  }
};

}  // namespace

PackedRegion::PackedRegion(const std::function<LeafBlocks(int)>& leaf) {
  std::vector<BlockId> uniform(kLeavesPerRegion, kAir);
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    if ((i & 63) == 0) mixed_before_[static_cast<size_t>(i) >> 6] = static_cast<uint16_t>(mixed_.size());
    const LeafBlocks blocks = leaf(i);
    if (!blocks.values) {
      uniform[static_cast<size_t>(i)] = blocks.uniform;
      continue;
    }
    mixed_bits_[static_cast<size_t>(i) >> 6] |= uint64_t{1} << (i & 63);
    pack_leaf(blocks.values);
  }
  mixed_.shrink_to_fit();
  words_.shrink_to_fit();

  // Number the ids of uniform leaves; mixed ones count as whichever comes first.
  for (int i = 0; i < kLeavesPerRegion; ++i)
    if (!is_mixed(i)) uniform_blocks_.push_back(uniform[static_cast<size_t>(i)]);
  std::sort(uniform_blocks_.begin(), uniform_blocks_.end());
  uniform_blocks_.erase(std::unique(uniform_blocks_.begin(), uniform_blocks_.end()), uniform_blocks_.end());
  uniform_blocks_.shrink_to_fit();
  if (uniform_blocks_.size() < 2) return;
  uniform_planes_.assign(static_cast<size_t>(planes_for(uniform_blocks_.size())) * 64, 0);
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    if (is_mixed(i)) continue;
    const auto at = std::lower_bound(uniform_blocks_.begin(), uniform_blocks_.end(), uniform[static_cast<size_t>(i)]);
    const size_t number = static_cast<size_t>(at - uniform_blocks_.begin());
    for (size_t k = 0; number >> k; ++k)
      if (number >> k & 1) uniform_planes_[k * 64 + (static_cast<size_t>(i) >> 6)] |= uint64_t{1} << (i & 63);
  }
}

PackedRegion::~PackedRegion() { refreeze(); }

void PackedRegion::pack_leaf(const BlockId* values) {
  const LeafPlanes leaf(values);
  const auto at = static_cast<uint32_t>(words_.size());
  const int planes = planes_for(leaf.blocks);
  const size_t palette = palette_words(leaf.blocks), size = palette + 8 * static_cast<size_t>(planes);
  if (size >= kWordsOfPlainIds) {
    mixed_.push_back({at, kPlain, 0});
    words_.resize(at + kWordsOfPlainIds);
    std::memcpy(&words_[at], values, kLeafVoxels * sizeof(BlockId));
    return;
  }
  mixed_.push_back({at, static_cast<uint16_t>(leaf.blocks), static_cast<uint16_t>(planes)});
  words_.resize(at + size, 0);
  std::memcpy(&words_[at], leaf.palette, leaf.blocks * sizeof(BlockId));
  uint64_t* out = &words_[at + palette];
  for (int x = 0; x < 8; ++x)
    for (int k = 0; k < planes; ++k) *out++ = leaf.plane[x][k];
}

size_t PackedRegion::rank(int leaf_index) const {
  const size_t word = static_cast<size_t>(leaf_index) >> 6;
  const uint64_t below = mixed_bits_[word] & ((uint64_t{1} << (leaf_index & 63)) - 1);
  return mixed_before_[word] + static_cast<size_t>(std::popcount(below));
}

BlockId PackedRegion::uniform_block(int leaf_index) const {
  size_t number = 0;
  const size_t word = static_cast<size_t>(leaf_index) >> 6;
  for (size_t k = 0; k * 64 < uniform_planes_.size(); ++k)
    number |= (uniform_planes_[k * 64 + word] >> (leaf_index & 63) & 1) << k;
  return uniform_blocks_[number];
}

BlockId PackedRegion::get(int leaf_index, int voxel_index) const {
  if (!is_mixed(leaf_index)) return uniform_block(leaf_index);
  const MixedLeaf& leaf = mixed_[rank(leaf_index)];
  const uint64_t* words = &words_[leaf.at];
  const auto* ids = reinterpret_cast<const BlockId*>(words);
  if (leaf.blocks == kPlain) return ids[voxel_index];
  const uint64_t* planes = words + palette_words(leaf.blocks) + (voxel_index >> 6) * leaf.planes;
  size_t number = 0;
  for (int k = 0; k < leaf.planes; ++k) number |= (planes[k] >> (voxel_index & 63) & 1) << k;
  return ids[number];
}

void PackedRegion::unpack(int leaf_index, BlockId* values) const {
  const MixedLeaf& leaf = mixed_[rank(leaf_index)];
  const uint64_t* words = &words_[leaf.at];
  if (leaf.blocks == kPlain) {
    std::memcpy(values, words, kLeafVoxels * sizeof(BlockId));
    return;
  }
  const auto* ids = reinterpret_cast<const BlockId*>(words);
  const uint64_t* planes = words + palette_words(leaf.blocks);
  if (leaf.planes == 1) {
    // Most leaves are a surface between two blocks.
    const uint16_t first = ids[0], differ = ids[0] ^ ids[1];
    for (int x = 0; x < 8; ++x)
      for (int byte = 0; byte < 8; ++byte) {
        const uint64_t second = planes[x] >> (8 * byte) & 255;
        BlockId* out = values + 64 * x + 8 * byte;
        for (int i = 0; i < 8; ++i)
          out[i] = static_cast<BlockId>(first ^ (differ & static_cast<uint16_t>(-(second >> i & 1))));
      }
    return;
  }
  for (int x = 0; x < 8; ++x, planes += leaf.planes)
    for (int byte = 0; byte < 8; ++byte) {
      // Places of eight voxels as eight bytes; a ninth plane doubles them.
      uint64_t places = 0;
      for (int k = 0; k < std::min<int>(leaf.planes, 8); ++k)
        places |= spread_eight_bits(planes[k] >> (8 * byte) & 255) << k;
      BlockId* out = values + 64 * x + 8 * byte;
      if (leaf.planes <= 8)
        for (int i = 0; i < 8; ++i) out[i] = ids[places >> (56 - 8 * i) & 255];
      else
        for (int i = 0; i < 8; ++i)
          out[i] = ids[(places >> (56 - 8 * i) & 255) | (planes[8] >> (8 * byte + i) & 1) << 8];
    }
}

LeafBlocks PackedRegion::leaf(int leaf_index) const {
  if (!is_mixed(leaf_index)) return {nullptr, uniform_block(leaf_index)};
  auto* table = thawed_.load(std::memory_order_acquire);
  if (!table) {
    auto fresh = std::make_unique<std::atomic<BlockId*>[]>(mixed_.size());
    for (size_t i = 0; i < mixed_.size(); ++i) fresh[i].store(nullptr, std::memory_order_relaxed);
    if (thawed_.compare_exchange_strong(table, fresh.get(), std::memory_order_acq_rel)) {
      table = fresh.release();
      thawed_bytes_.fetch_add(mixed_.size() * sizeof(BlockId*), std::memory_order_relaxed);
    }
  }
  std::atomic<BlockId*>& slot = table[rank(leaf_index)];
  BlockId* values = slot.load(std::memory_order_acquire);
  if (values) return {values, kAir};
  auto fresh = std::make_unique<BlockId[]>(kLeafVoxels);
  unpack(leaf_index, fresh.get());
  if (slot.compare_exchange_strong(values, fresh.get(), std::memory_order_acq_rel)) {
    thawed_bytes_.fetch_add(kLeafVoxels * sizeof(BlockId), std::memory_order_relaxed);
    values = fresh.release();
  }
  return {values, kAir};
}

void PackedRegion::refreeze() const {
  std::atomic<BlockId*>* table = thawed_.exchange(nullptr);
  if (!table) return;
  for (size_t i = 0; i < mixed_.size(); ++i) delete[] table[i].load();
  delete[] table;
  thawed_bytes_ = 0;
}

LeafMask PackedRegion::mask(int leaf_index, std::span<const uint8_t> bits, int kind) const {
  const auto is_set = [&](BlockId b) { return (bits[b] >> kind & 1) != 0; };
  if (!is_mixed(leaf_index)) return is_set(uniform_block(leaf_index)) ? kAllMask : kNoneMask;
  const MixedLeaf& leaf = mixed_[rank(leaf_index)];
  LeafMask mask;
  if (leaf.blocks > kMostTerms) {
    BlockId values[kLeafVoxels];
    unpack(leaf_index, values);
    for (int i = 0; i < kLeafVoxels; ++i) mask.word[i >> 6] |= static_cast<uint64_t>(is_set(values[i])) << (i & 63);
    return mask;
  }
  // One term for each block of the palette that is set: the voxels whose planes spell its number.
  const uint64_t* words = &words_[leaf.at];
  const auto* ids = reinterpret_cast<const BlockId*>(words);
  const uint64_t* planes = words + palette_words(leaf.blocks);
  for (size_t number = 0; number < leaf.blocks; ++number) {
    if (!is_set(ids[number])) continue;
    for (int x = 0; x < 8; ++x) mask.word[x] |= voxels_of_number(planes, leaf.planes, x, number);
  }
  return mask;
}

void PackedRegion::count(std::span<int64_t> counts) const {
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    if (!is_mixed(i)) {
      counts[uniform_block(i)] += kLeafVoxels;
      continue;
    }
    const MixedLeaf& leaf = mixed_[rank(i)];
    if (leaf.blocks > kMostTerms) {
      BlockId values[kLeafVoxels];
      unpack(i, values);
      for (const BlockId b : values) ++counts[b];
      continue;
    }
    const uint64_t* words = &words_[leaf.at];
    for (size_t number = 0; number < leaf.blocks; ++number)
      for (int x = 0; x < 8; ++x)
        counts[reinterpret_cast<const BlockId*>(words)[number]] +=
            std::popcount(voxels_of_number(words + palette_words(leaf.blocks), leaf.planes, x, number));
  }
}

size_t PackedRegion::bytes() const {
  return sizeof *this + uniform_blocks_.capacity() * sizeof(BlockId) + uniform_planes_.capacity() * 8 +
         mixed_.capacity() * sizeof(MixedLeaf) + words_.capacity() * 8 + thaw_bytes();
}

}  // namespace world
