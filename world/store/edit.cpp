// Edits of the store in place: operations sorted by region and leaf, each leaf written once, last operation first, so
// that nothing is copied to see what changed.
#include "world/store/edit.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#ifdef __SSE2__
#include <emmintrin.h>
#endif
#include <fmt/format.h>

#include "world/store/leaf_masks.h"
#include "world/store/store.h"
#include "world/store/tree.h"

namespace world {

namespace {

constexpr uint64_t kMostLeavesInBatch = uint64_t{1} << 26;

/// How the counts of one region change, flushed into its census at its end.
class CensusChange {
 public:
  explicit CensusChange(size_t palette_size) : change_(palette_size, 0) {}
  void add(BlockId block, int64_t n) {
    if (change_[block] == 0) seen_.push_back(block);
    change_[block] += n;
  }
  void flush(StoreNodes& nodes, RegionPos r) {
    if (seen_.empty()) return;
    RegionCensus& census = nodes.census[r];
    for (BlockId block : seen_) {  // may hold a block twice; the second adds nothing
      census.add(block, change_[block]);
      change_[block] = 0;
    }
    seen_.clear();
  }

 private:
  std::vector<int64_t> change_;
  std::vector<BlockId> seen_;
};

// Comparisons of 64 ids, the innermost loops of all edits. Through SSE2, which every x86-64 has: the compiler's vectors
// and the product that gathers bits took 1.4 us a leaf of write_leaves() where this takes 0.85.
#ifdef __SSE2__
template <class Eight>
uint64_t differing_bits_of(const BlockId* row, Eight eight) {
  const auto equal = [&](int i) {
    return _mm_cmpeq_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(row + i)), eight(i));
  };
  uint64_t same = 0;
  for (int i = 0; i < 64; i += 16)
    same |= static_cast<uint64_t>(_mm_movemask_epi8(_mm_packs_epi16(equal(i), equal(i + 8)))) << i;
  return ~same;
}
/// Of 512. SSE2 has the larger of signed numbers only, so the top bit is turned.
BlockId highest_id(const BlockId* values) {
  const __m128i top = _mm_set1_epi16(INT16_MIN);
  __m128i most = top;
  for (int i = 0; i < kLeafVoxels; i += 8)
    most = _mm_max_epi16(most, _mm_xor_si128(_mm_loadu_si128(reinterpret_cast<const __m128i*>(values + i)), top));
  BlockId lanes[8];
  _mm_storeu_si128(reinterpret_cast<__m128i*>(lanes), _mm_xor_si128(most, top));
  return *std::max_element(lanes, lanes + 8);
}
/// Bit i: row[i] != block.
uint64_t differing_bits(const BlockId* row, BlockId block) {
  const __m128i eight = _mm_set1_epi16(static_cast<int16_t>(block));
  return differing_bits_of(row, [=](int) { return eight; });
}
/// Bit i: row[i] != other[i].
uint64_t differing_bits(const BlockId* row, const BlockId* other) {
  return differing_bits_of(row, [=](int i) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(other + i)); });
}
#else
/// Bit i: row[i] != other(i). Through bytes, which compilers compare in vectors, and a product that gathers eight.
template <class Other>
uint64_t differing_bits_of(const BlockId* row, Other other) {
  uint8_t differs[64];
  for (int i = 0; i < 64; ++i) differs[i] = row[i] != other(i);
  uint64_t bits = 0;
  for (int i = 0; i < 8; ++i) {
    uint64_t eight;
    std::memcpy(&eight, differs + 8 * i, 8);
    bits |= (eight * 0x0102040810204080ull >> 56) << (8 * i);
  }
  return bits;
}
uint64_t differing_bits(const BlockId* row, BlockId block) {
  return differing_bits_of(row, [=](int) { return block; });
}
uint64_t differing_bits(const BlockId* row, const BlockId* other) {
  return differing_bits_of(row, [=](int i) { return other[i]; });
}
BlockId highest_id(const BlockId* values) { return *std::max_element(values, values + kLeafVoxels); }
#endif

constexpr bool is_one_bit(uint64_t bits) { return (bits & (bits - 1)) == 0; }

/// Writes the leaves of one region in place: a tile becomes voxels at the first change, and voxels a tile where they
/// end up equal.
class RegionEdit {
 public:
  RegionEdit(StoreNodes& nodes, CensusChange& census, bool keep_old)
      : nodes_(nodes), census_(census), keep_old_(keep_old) {}
  ~RegionEdit() { census_.flush(nodes_, region_); }

  void begin_region(RegionPos r) {
    census_.flush(nodes_, region_);
    region_ = r;
    nodes_.before_change(r);
    node_ = nodes_.open_region(r);
  }

  void begin_leaf(int leaf_index) {
    index_ = leaf_index;
    changed_ = {};
    values_ = nullptr;
    const LeafBlocks blocks = node_ ? leaf_of(*node_, index_) : LeafBlocks{};
    uniform_ = blocks.uniform;
    if (!blocks.values) return;
    leaf_ = const_cast<BlockLeaf*>(node_->getTable()[static_cast<openvdb::Index>(index_)].getChild());
    values_ = leaf_->buffer().data();
    active_ = leaf_->getValueMask();
  }

  /// Sets the voxels of word x whose bits are set.
  void write(int x, uint64_t bits, BlockId block) {
    if (!bits || (!values_ && uniform_ == block)) return;
    if (!values_) make_voxels();
    if (is_one_bit(bits))
      bits = values_[64 * x + std::countr_zero(bits)] == block ? 0 : bits;
    else
      bits &= differing_bits(values_ + 64 * x, block);
    if (!bits) return;
    replace(x, bits, block);
    census_.add(block, std::popcount(bits));
    uint64_t& active = active_.getWord<uint64_t>(static_cast<openvdb::Index>(x));
    active = block == kAir ? active & ~bits : active | bits;
  }

  /// Sets the whole leaf.
  void fill(BlockId block) {
    if (!values_) {
      if (uniform_ == block) return;
      changed_ = LeafMask::all();
      census_.add(uniform_, -kLeafVoxels);
      if (keep_old_) std::fill_n(old_, kLeafVoxels, uniform_);
    } else {
      for (int x = 0; x < 8; ++x)
        if (const uint64_t bits = differing_bits(values_ + 64 * x, block)) replace(x, bits, block);
    }
    const int count = changed_.count();
    census_.add(block, count);
    make_tile(block);
  }

  /// Puts `values` where the bits of `mask` are set, in index order.
  void put(const LeafMask& mask, const std::vector<BlockId>& values) {
    if (!values_) {
      if (std::all_of(values.begin(), values.end(), [&](BlockId v) { return v == uniform_; })) return;
      make_voxels();
    }
    const BlockId* next = values.data();
    for (int x = 0; x < 8; ++x)
      for (uint64_t rest = mask.word[x]; rest; rest &= rest - 1) {
        const int i = 64 * x + std::countr_zero(rest);
        const BlockId old = values_[i], block = *next++;
        if (old == block) continue;
        changed_.set(i);
        census_.add(old, -1);
        census_.add(block, 1);
        old_[i] = old;
        values_[i] = block;
        active_.set(static_cast<openvdb::Index>(i), block != kAir);
      }
  }

  /// Sets the whole leaf to these 512. `bits`: of each block, as BlockPalette::masks() gives them; derived() then says
  /// those of `kinds` for what changed.
  void put_all(const BlockId* values, std::span<const uint8_t> bits, unsigned kinds) {
    if (values_ && std::memcmp(values_, values, sizeof old_) == 0) return;
    for (int x = 0; x < 8; ++x)
      changed_.word[x] =
          values_ ? differing_bits(values + 64 * x, values_ + 64 * x) : differing_bits(values + 64 * x, uniform_);
    if (changed_.is_none()) return;
    if (values_) {
      if (keep_old_) std::memcpy(old_, values_, sizeof old_);
      for_each_changed(values_, [&](int, uint64_t same, BlockId old) { census_.add(old, -std::popcount(same)); });
    } else {
      if (keep_old_) std::fill_n(old_, kLeafVoxels, uniform_);
      census_.add(uniform_, -changed_.count());
    }
    for (int k = 0; kinds >> k; ++k) derived_[k] = {};
    for_each_changed(values, [&](int x, uint64_t same, BlockId block) {
      census_.add(block, std::popcount(same));
      for (unsigned rest = bits[block] & kinds; rest; rest &= rest - 1)
        derived_[std::countr_zero(rest)].word[x] |= same;
    });
    if (all_equal(values)) {
      make_tile(values[0]);
      return;
    }
    if (!values_) make_voxels();
    std::memcpy(values_, values, sizeof old_);
    for (int x = 0; x < 8; ++x)
      active_.getWord<uint64_t>(static_cast<openvdb::Index>(x)) = differing_bits(values + 64 * x, kAir);
  }
  const LeafMask& derived(int kind) const { return derived_[kind]; }

  /// True where a voxel changed.
  bool end_leaf() {
    if (changed_.is_none()) return false;
    if (!values_) return true;  // it is a tile by now
    if (all_equal(values_))
      make_tile(values_[0]);
    else
      leaf_->setValueMask(active_);
    return true;
  }

  const LeafMask& changed() const { return changed_; }
  /// The leaf's old blocks where it changed.
  LeafUndo undo() const {
    LeafUndo undo{position(), changed_, {}};
    undo.values.reserve(static_cast<size_t>(changed_.count()));
    for (int x = 0; x < 8; ++x)
      for (uint64_t bits = changed_.word[x]; bits; bits &= bits - 1)
        undo.values.push_back(old_[64 * x + std::countr_zero(bits)]);
    return undo;
  }
  LeafPos position() const { return leaf_from_region(region_) + leaf_offset_in_region(index_); }

 private:
  /// visit(bits, block) for those of the 64 voxels of a row whose bits are set. Few blocks make up a row: each at once,
  /// and one by one only where there are many.
  template <class Visit>
  static void for_each_block(const BlockId* row, uint64_t bits, Visit visit) {
    for (int kind = 0; bits && kind < 4; ++kind) {
      const BlockId block = row[std::countr_zero(bits)];
      const uint64_t same = is_one_bit(bits) ? bits : bits & ~differing_bits(row, block);
      visit(same, block);
      bits &= ~same;
    }
    for (; bits; bits &= bits - 1) visit(bits & -bits, row[std::countr_zero(bits)]);
  }
  /// visit(word, bits, block) for what changed of a leaf.
  template <class Visit>
  void for_each_changed(const BlockId* values, Visit visit) const {
    for (int x = 0; x < 8; ++x)
      for_each_block(values + 64 * x, changed_.word[x], [&](uint64_t same, BlockId block) { visit(x, same, block); });
  }

  /// Replaces voxels of word x, all of which differ from `block`.
  void replace(int x, uint64_t bits, BlockId block) {
    changed_.word[x] |= bits;
    BlockId* row = values_ + 64 * x;
    if (keep_old_)
      for (uint64_t rest = bits; rest; rest &= rest - 1) {
        const int i = std::countr_zero(rest);
        old_[64 * x + i] = row[i];
      }
    for_each_block(row, bits, [&](uint64_t same, BlockId old) { census_.add(old, -std::popcount(same)); });
    if (bits == ~uint64_t{0})
      std::fill_n(row, 64, block);
    else
      for (; bits; bits &= bits - 1) row[std::countr_zero(bits)] = block;
  }

  void make_voxels() {
    if (!node_) node_ = &nodes_.make_region(region_);
    leaf_ = new BlockLeaf(coord(voxel_from_leaf(position())), uniform_, uniform_ != kAir);
    node_->addChild(leaf_);
    values_ = leaf_->buffer().data();
    active_ = leaf_->getValueMask();
  }

  void make_tile(BlockId block) {
    if (!node_) node_ = &nodes_.make_region(region_);
    node_->addTile(1, coord(voxel_from_leaf(position())), block, block != kAir);
    values_ = nullptr, uniform_ = block;
  }

  StoreNodes& nodes_;
  CensusChange& census_;
  bool keep_old_;
  RegionPos region_{};
  RegionNode* node_ = nullptr;
  int index_ = 0;
  BlockId uniform_ = kAir;
  BlockLeaf* leaf_ = nullptr;
  BlockId* values_ = nullptr;  // null while the leaf is a tile
  BlockLeaf::NodeMaskType active_;
  LeafMask changed_;
  LeafMask derived_[kMaskKinds];
  BlockId old_[kLeafVoxels];
};

/// The leaves that a batch touches: pairs of (leaf, operation), sorted by region, then leaf, then operation.
///   key  region's rank << (12 + op bits) | leaf in its region << op bits | operation; 26 + 12 + 26 bits at most
struct LeafOps {
  int op_bits = 0;
  std::vector<uint64_t> keys;
  std::vector<RegionPos> ranked;  // by rank; empty where ranks count through the box of regions below
  RegionPos low;
  uint64_t size_y = 1, size_z = 1;

  RegionPos region(uint64_t rank) const {
    if (!ranked.empty()) return ranked[rank];
    return {low.x + static_cast<int32_t>(rank / (size_y * size_z)),
            low.y + static_cast<int32_t>(rank / size_z % size_y), low.z + static_cast<int32_t>(rank % size_z)};
  }
  uint64_t rank(RegionPos r) const {
    if (!ranked.empty())
      return static_cast<uint64_t>(std::lower_bound(ranked.begin(), ranked.end(), r) - ranked.begin());
    return (static_cast<uint64_t>(r.x - low.x) * size_y + static_cast<uint64_t>(r.y - low.y)) * size_z +
           static_cast<uint64_t>(r.z - low.z);
  }
};

template <class Visit>
void for_each(const VoxelPos& a, const VoxelPos& b, Visit visit) {
  for (int x = a.x; x <= b.x; ++x)
    for (int y = a.y; y <= b.y; ++y)
      for (int z = a.z; z <= b.z; ++z) visit(x, y, z);
}
constexpr VoxelPos shifted(VoxelPos v, int bits) { return {v.x >> bits, v.y >> bits, v.z >> bits}; }

/// Least significant digits first, which keeps the order of equal keys: the operations are in order already.
void sort_keys(std::vector<uint64_t>& keys, int lowest_bit) {
  if (std::is_sorted(keys.begin(), keys.end())) return;
  if (keys.size() < 512) {
    std::sort(keys.begin(), keys.end());
    return;
  }
  constexpr int kDigit = 11;
  const int highest_bit = std::bit_width(*std::max_element(keys.begin(), keys.end()));
  std::vector<uint64_t> sorted(keys.size());
  for (int bit = lowest_bit; bit < highest_bit; bit += kDigit) {
    const auto digit = [bit](uint64_t key) { return key >> bit & ((1u << kDigit) - 1); };
    std::array<size_t, (size_t{1} << kDigit) + 1> place{};
    for (uint64_t key : keys) ++place[digit(key) + 1];
    for (size_t i = 1; i < place.size(); ++i) place[i] += place[i - 1];
    for (uint64_t key : keys) sorted[place[digit(key)]++] = key;
    keys.swap(sorted);
  }
}

std::string outside_palette(BlockId block, size_t palette_size) {
  return fmt::format(
      "an edit writes block id {}, but the world's palette has only {} blocks: add the block to the palette first",
      block, palette_size);
}

Result<LeafOps> split_by_leaf(const EditBatch& batch, size_t palette_size) {
  VoxelBox bounds;
  uint64_t leaves = 0;
  for (const EditBatch::Op& op : batch.ops()) {
    if (!inside_world(op.box.min) || !inside_world(op.box.max)) return input_error(fmt_edit_outside(op.box));
    if (op.block >= palette_size) return input_error(outside_palette(op.block, palette_size));
    leaves += VoxelBox{shifted(op.box.min, kLeafLog2), shifted(op.box.max, kLeafLog2)}.volume();
    if (leaves > kMostLeavesInBatch)
      return input_error("an edit batch covers more than 67,108,864 leaves of 8^3 voxels: split it into smaller boxes");
    bounds.include(op.box);
  }
  LeafOps ops;
  if (batch.empty()) return ops;
  ops.op_bits = static_cast<int>(std::bit_width(batch.ops().size() - 1));
  const VoxelBox regions{shifted(bounds.min, kRegionLog2), shifted(bounds.max, kRegionLog2)};
  ops.low = region_from_voxel(bounds.min);
  ops.size_y = static_cast<uint64_t>(regions.max.y - regions.min.y) + 1;
  ops.size_z = static_cast<uint64_t>(regions.max.z - regions.min.z) + 1;
  if (regions.volume() > kMostLeavesInBatch) {  // far apart: rank only the regions that are touched
    for (const EditBatch::Op& op : batch.ops())
      for_each(shifted(op.box.min, kRegionLog2), shifted(op.box.max, kRegionLog2), [&](int x, int y, int z) {
        ops.ranked.push_back({x, y, z});
      });
    std::sort(ops.ranked.begin(), ops.ranked.end());
    ops.ranked.erase(std::unique(ops.ranked.begin(), ops.ranked.end()), ops.ranked.end());
  }
  ops.keys.reserve(leaves);
  for (size_t i = 0; i < batch.ops().size(); ++i) {
    const VoxelBox& box = batch.ops()[i].box;
    for_each(shifted(box.min, kLeafLog2), shifted(box.max, kLeafLog2), [&](int x, int y, int z) {
      const LeafPos l{x, y, z};
      const uint64_t leaf = ops.rank(region_from_leaf(l)) << 12 | static_cast<uint64_t>(index_in_region(l));
      ops.keys.push_back(leaf << ops.op_bits | i);
    });
  }
  sort_keys(ops.keys, ops.op_bits);
  return ops;
}

/// Writes the part of a box that lies in the leaf, except where later operations wrote.
void write_box(RegionEdit& edit, VoxelPos corner, const EditBatch::Op& op, LeafMask& written) {
  VoxelPos a, b;
  for (int axis = 0; axis < 3; ++axis) {
    a[axis] = std::max(op.box.min[axis] - corner[axis], 0);
    b[axis] = std::min(op.box.max[axis] - corner[axis], 7);
  }
  const bool whole = a == VoxelPos{0, 0, 0} && b == VoxelPos{7, 7, 7};
  if (whole && written.is_none()) {
    edit.fill(op.block);
    written = LeafMask::all();
    return;
  }
  const uint64_t row = (0xffull >> (7 - (b.z - a.z))) << a.z;
  const uint64_t rows = (0x0101010101010101ull >> (8 * (7 - (b.y - a.y)))) << (8 * a.y);
  for (int x = a.x; x <= b.x; ++x) {
    const uint64_t bits = row * rows & ~written.word[x];
    edit.write(x, bits, op.block);
    written.word[x] |= bits;
  }
}

/// What a voxel held goes with its block: the amounts of fluids and the heat that layers say of it.
void forget_contents(StoreNodes& nodes, LeafPos l, const LeafMask& changed) {
  for (const Layer layer : {Layer::liquid, Layer::gas, Layer::heat}) {
    const auto found = nodes.layers.find(layer);
    if (found == nodes.layers.end()) continue;
    IntLayer& values = std::get<IntLayer>(found->second);
    std::array<int32_t, kLeafVoxels> value;
    LeafMask active;
    if (!values.read_leaf(l, value, active)) continue;
    LeafMask kept;
    for (int x = 0; x < 8; ++x) kept.word[x] = active.word[x] & ~changed.word[x];
    if (!(kept == active)) values.write_leaf(l, value, kept);
  }
}

}  // namespace

Result<EditReport> Store::apply(const EditBatch& batch, UndoLog* undo) {
  CHECK_EQ(nodes_->views.load(), 0);
  TRY(const LeafOps ops, split_by_leaf(batch, palette_->size()));
  EditReport report;
  std::vector<LeafUndo> step;
  CensusChange census(palette_->size());
  RegionEdit edit(*nodes_, census, undo != nullptr);
  const uint64_t op_mask = (uint64_t{1} << ops.op_bits) - 1;
  uint64_t rank = UINT64_MAX;
  for (size_t i = 0; i < ops.keys.size();) {
    const uint64_t leaf = ops.keys[i] >> ops.op_bits;
    size_t end = i + 1;
    while (end < ops.keys.size() && ops.keys[end] >> ops.op_bits == leaf) ++end;
    // Sorted by leaf, the operations lie scattered in memory.
    for (size_t k = i + 32; k < std::min(end + 32, ops.keys.size()); ++k)
      __builtin_prefetch(&batch.ops()[ops.keys[k] & op_mask]);
    if (leaf >> 12 != rank) {
      rank = leaf >> 12;
      edit.begin_region(ops.region(rank));
    }
    edit.begin_leaf(static_cast<int>(leaf & 4095));
    const VoxelPos corner = voxel_from_leaf(edit.position());
    // The last operation wins, so each voxel is written by the last that covers it, and only once.
    LeafMask written;
    for (size_t k = end; k-- > i && !written.is_all();)
      write_box(edit, corner, batch.ops()[ops.keys[k] & op_mask], written);
    i = end;
    if (!edit.end_leaf()) continue;
    report.voxels_changed += static_cast<uint64_t>(edit.changed().count());
    ++report.leaves_changed;
    if (undo) step.push_back(edit.undo());
    forget_contents(*nodes_, edit.position(), edit.changed());
    leaf_changed(edit.position());
  }
  if (undo && !step.empty()) {
    undo->done_.push_back(std::move(step));
    undo->undone_.clear();
  }
  return report;
}

namespace {

struct WritePlace {
  RegionPos region;
  int leaf;  // index in the region
  uint32_t write;

  bool same_leaf(const WritePlace& o) const { return leaf == o.leaf && region == o.region; }
  friend bool operator<(const WritePlace& a, const WritePlace& b) {
    if (a.region != b.region) return a.region < b.region;
    return a.leaf != b.leaf ? a.leaf < b.leaf : a.write < b.write;
  }
};

Status check_write(const LeafWrite& write, size_t palette_size) {
  constexpr int32_t kBorder = kWorldBorder / kLeafSize;
  for (int axis = 0; axis < 3; ++axis)
    if (write.leaf[axis] < -kBorder || write.leaf[axis] >= kBorder)
      return input_error(fmt::format("the leaf ({}, {}, {}) lies outside of the world's border", write.leaf.x,
                                     write.leaf.y, write.leaf.z));
  const BlockId highest = highest_id(write.values);
  if (highest < palette_size) return {};
  return input_error(outside_palette(highest, palette_size));
}

}  // namespace

Result<EditReport> Store::write_leaves(std::span<const LeafWrite> leaves, UndoLog* undo) {
  CHECK_EQ(nodes_->views.load(), 0);
  // Check all, so that an error changes nothing.
  std::vector<WritePlace> places;
  places.reserve(leaves.size());
  for (const LeafWrite& write : leaves) {
    TRY_STATUS(check_write(write, palette_->size()));
    places.push_back({region_from_leaf(write.leaf), index_in_region(write.leaf), static_cast<uint32_t>(places.size())});
  }
  // By region, so that each is opened and counted once.
  if (!std::is_sorted(places.begin(), places.end())) std::sort(places.begin(), places.end());

  EditReport report;
  std::vector<LeafUndo> step;
  CensusChange census(palette_->size());
  RegionEdit edit(*nodes_, census, undo != nullptr);
  const std::span<const uint8_t> bits = palette_->masks();
  const unsigned kinds = mask_kinds();
  const WritePlace* last = nullptr;
  for (size_t i = 0; i < places.size(); ++i) {
    const WritePlace& place = places[i];
    if (i + 1 < places.size() && place.same_leaf(places[i + 1])) continue;
    if (!last || place.region != last->region) edit.begin_region(place.region);
    last = &place;
    edit.begin_leaf(place.leaf);
    edit.put_all(leaves[place.write].values, bits, kinds);
    if (!edit.end_leaf()) continue;
    report.voxels_changed += static_cast<uint64_t>(edit.changed().count());
    ++report.leaves_changed;
    if (undo) step.push_back(edit.undo());
    const LeafPos l = leaves[place.write].leaf;
    note_change(l);
    for (int k = 0; kinds >> k; ++k) {
      if (!nodes_->masks[k]) continue;
      LeafMask mask = nodes_->masks[k]->leaf(l);
      for (int x = 0; x < 8; ++x) mask.word[x] = (mask.word[x] & ~edit.changed().word[x]) | edit.derived(k).word[x];
      nodes_->masks[k]->set_leaf(l, mask);
    }
  }
  if (undo && !step.empty()) {
    undo->done_.push_back(std::move(step));
    undo->undone_.clear();
  }
  return report;
}

void Store::swap_leaves(std::vector<LeafUndo>& step) {
  CHECK_EQ(nodes_->views.load(), 0);
  CensusChange census(palette_->size());
  RegionEdit edit(*nodes_, census, true);
  bool first = true;
  RegionPos region;
  for (LeafUndo& entry : step) {
    if (first || region_from_leaf(entry.leaf) != region) {
      region = region_from_leaf(entry.leaf), first = false;
      edit.begin_region(region);
    }
    edit.begin_leaf(index_in_region(entry.leaf));
    edit.put(entry.changed, entry.values);
    if (!edit.end_leaf()) continue;
    forget_contents(*nodes_, entry.leaf, edit.changed());
    leaf_changed(entry.leaf);
    entry = edit.undo();
  }
}

bool UndoLog::undo(Store& store) {
  if (done_.empty()) return false;
  store.swap_leaves(done_.back());
  undone_.push_back(std::move(done_.back()));
  done_.pop_back();
  return true;
}

bool UndoLog::redo(Store& store) {
  if (undone_.empty()) return false;
  store.swap_leaves(undone_.back());
  done_.push_back(std::move(undone_.back()));
  undone_.pop_back();
  return true;
}

size_t UndoLog::bytes() const {
  size_t total = 0;
  for (const auto* log : {&done_, &undone_})
    for (const auto& step : *log)
      for (const LeafUndo& leaf : step) total += sizeof leaf + leaf.values.capacity() * sizeof(BlockId);
  return total;
}

}  // namespace world
