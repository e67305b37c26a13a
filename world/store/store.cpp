#include "world/store/store.h"

#include <algorithm>
#include <cstring>

#include "world/base/jobs.h"
#include "world/base/random.h"
#include "world/store/leaf_masks.h"
#include "world/store/tree.h"

namespace world {

// ---- RegionBuilder ---------------------------------------------------------------------------------------------

struct RegionBuilder::Impl {
  std::unique_ptr<RegionNode> node;
};

RegionBuilder::RegionBuilder(RegionPos pos) : pos_(pos), impl_(std::make_unique<Impl>()) {
  impl_->node = std::make_unique<RegionNode>(coord(voxel_from_region(pos)), kAir, false);
}
RegionBuilder::~RegionBuilder() = default;
RegionBuilder::RegionBuilder(RegionBuilder&&) noexcept = default;
RegionBuilder& RegionBuilder::operator=(RegionBuilder&&) noexcept = default;

void RegionBuilder::set_leaf(int leaf_index, std::span<const BlockId, kLeafVoxels> values) {
  write_leaf(*impl_->node, leaf_from_region(pos_) + leaf_offset_in_region(leaf_index), values.data());
}

void RegionBuilder::set_uniform(int leaf_index, BlockId block) {
  const LeafPos l = leaf_from_region(pos_) + leaf_offset_in_region(leaf_index);
  impl_->node->addTile(1, coord(voxel_from_leaf(l)), block, block != kAir);
}

LeafBlocks RegionBuilder::leaf(int leaf_index) const { return leaf_of(*impl_->node, leaf_index); }

// ---- Store: reading --------------------------------------------------------------------------------------------

Store::Store(const BlockPalette& palette) : palette_(&palette), nodes_(std::make_unique<StoreNodes>()) {}
Store::~Store() = default;
Store::Store(Store&&) noexcept = default;
Store& Store::operator=(Store&&) noexcept = default;

LeafBlocks Store::leaf(LeafPos l) const { return nodes_->leaf(l); }
BlockId Store::get(VoxelPos v) const {
  const auto found = nodes_->regions.find(region_from_voxel(v));
  if (found == nodes_->regions.end()) return kAir;
  const int leaf = index_in_region(leaf_from_voxel(v));
  return found->second.packed ? found->second.packed->get(leaf, index_in_leaf(v))
                              : leaf_of(*found->second.node, leaf)[index_in_leaf(v)];
}

std::vector<RegionPos> Store::regions() const {
  std::vector<RegionPos> all;
  for (const auto& [pos, census] : nodes_->census)
    if (!census.counts.empty()) all.push_back(pos);
  std::sort(all.begin(), all.end());
  return all;
}

std::vector<LeafPos> Store::mixed_leaves() const {
  std::vector<LeafPos> all;
  for (const auto& [pos, slot] : nodes_->regions) {
    if (slot.node) {
      for (auto child = slot.node->cbeginChildOn(); child; ++child)
        all.push_back(leaf_from_voxel(voxel(child->origin())));
      continue;
    }
    for (int i = 0; i < kLeavesPerRegion; ++i)
      if (slot.packed->is_mixed(i)) all.push_back(leaf_from_region(pos) + leaf_offset_in_region(i));
  }
  std::sort(all.begin(), all.end());
  return all;
}

namespace {

/// Exact bounds of what is not air in a leaf, relative to its corner.
VoxelBox leaf_bounds(const LeafBlocks& leaf) {
  if (!leaf.values) return leaf.uniform == kAir ? VoxelBox{} : VoxelBox{{0, 0, 0}, {7, 7, 7}};
  const LeafMask mask = leaf_mask(leaf, [](BlockId b) { return b != kAir; });
  uint64_t any = 0;
  int min_x = 8, max_x = -1;
  for (int x = 0; x < 8; ++x)
    if (mask.word[x]) {
      any |= mask.word[x];
      min_x = std::min(min_x, x), max_x = x;
    }
  if (!any) return {};
  int min_z = 8, max_z = -1;
  for (int z = 0; z < 8; ++z)
    if (any >> z & 0x0101010101010101ull) min_z = std::min(min_z, z), max_z = z;
  const int min_y = std::countr_zero(any) / 8, max_y = 7 - std::countl_zero(any) / 8;
  return {{min_x, min_y, min_z}, {max_x, max_y, max_z}};
}

}  // namespace

VoxelBox Store::bounds() const {
  VoxelBox box;
  for (const RegionPos& pos : regions()) {
    RegionLeaves leaves(nodes_->regions.at(pos));
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const VoxelPos corner = voxel_from_leaf(leaf_from_region(pos) + leaf_offset_in_region(i));
      // A leaf inside the bounds so far adds nothing.
      if (box.contains(corner) && box.contains(corner + VoxelPos{7, 7, 7})) continue;
      const VoxelBox inside = leaf_bounds(leaves(i));
      if (!inside.empty()) box.include(VoxelBox{corner + inside.min, corner + inside.max});
    }
  }
  return box;
}

Census Store::census() const {
  std::vector<uint64_t> by_block(palette_->size());
  for (const auto& [pos, region] : nodes_->census)
    for (const auto& [block, n] : region.counts) by_block[block] += static_cast<uint64_t>(n);
  Census total;
  for (size_t block = 0; block < by_block.size(); ++block)
    if (by_block[block]) total.emplace_hint(total.end(), static_cast<BlockId>(block), by_block[block]);
  return total;
}

Census Store::region_census(RegionPos r) const {
  Census total;
  if (const auto found = nodes_->census.find(r); found != nodes_->census.end())
    for (const auto& [block, n] : found->second.counts) total[block] = static_cast<uint64_t>(n);
  return total;
}

uint64_t Store::voxel_count() const {
  uint64_t n = 0;
  for (const auto& [block, count] : census()) n += count;
  return n;
}

namespace {

/// Of the tree and the packed regions.
size_t block_bytes(const StoreNodes& nodes) {
  size_t total = nodes.tree.memUsage();
  for (const auto& [pos, slot] : nodes.regions)
    if (slot.packed) total += slot.packed->bytes();
  return total;
}

}  // namespace

std::vector<LayerInfo> Store::layers() const {
  std::vector<LayerInfo> all{{"block", block_bytes(*nodes_), voxel_count()}};
  for (const auto& layer : nodes_->layers)
    std::visit(
        [&](const auto& values) {
          all.push_back({std::string(layer_rows()[static_cast<size_t>(layer.first)].name), values.bytes(),
                         values.active_voxels()});
        },
        layer.second);
  const char* names[kMaskKinds] = {"mask:occupied", "mask:opaque",   "mask:solid", "mask:liquid",
                                   "mask:emitting", "mask:granular", "mask:gas"};
  for (int k = 0; k < kMaskKinds; ++k)
    if (nodes_->masks[k]) all.push_back({names[k], nodes_->masks[k]->bytes(), nodes_->masks[k]->count()});
  return all;
}

size_t Store::bytes_memory() const {
  size_t total = block_bytes(*nodes_);
  for (const auto& masks : nodes_->masks)
    if (masks) total += masks->bytes();
  for (const auto& [layer, grid] : nodes_->layers)
    total += std::visit([](const auto& values) { return values.bytes(); }, grid);
  return total;
}

const AnyLayer* Store::find_any_layer(Layer layer) const {
  const auto found = nodes_->layers.find(layer);
  return found == nodes_->layers.end() ? nullptr : &found->second;
}

const FloatLayer* Store::find_layer(Layer layer) const {
  CHECK(!layer_rows()[static_cast<size_t>(layer)].is_integer);
  const AnyLayer* found = find_any_layer(layer);
  return found ? &std::get<FloatLayer>(*found) : nullptr;
}

const IntLayer* Store::find_int_layer(Layer layer) const {
  CHECK(layer_rows()[static_cast<size_t>(layer)].is_integer);
  const AnyLayer* found = find_any_layer(layer);
  return found ? &std::get<IntLayer>(*found) : nullptr;
}

AnyLayer& Store::make_any_layer(Layer layer) {
  const auto found = nodes_->layers.find(layer);
  return found != nodes_->layers.end() ? found->second
                                       : nodes_->layers.emplace(layer, empty_layer(layer)).first->second;
}

FloatLayer& Store::make_layer(Layer layer) {
  CHECK(!layer_rows()[static_cast<size_t>(layer)].is_integer);
  return std::get<FloatLayer>(make_any_layer(layer));
}

IntLayer& Store::make_int_layer(Layer layer) {
  CHECK(layer_rows()[static_cast<size_t>(layer)].is_integer);
  return std::get<IntLayer>(make_any_layer(layer));
}

void Store::drop_layer(Layer layer) {
  if (nodes_->layers.erase(layer) > 0) nodes_->dropped_layers.insert(layer);
}

std::vector<Layer> Store::dropped_layers() const {
  return {nodes_->dropped_layers.begin(), nodes_->dropped_layers.end()};
}

void Store::mark_dropped(std::span<const Layer> layers) { nodes_->dropped_layers.insert(layers.begin(), layers.end()); }

uint64_t Store::content_hash() const {
  const size_t blocks = palette_->size();
  std::vector<uint64_t> name_hash(blocks), uniform_hash(blocks, 0);
  for (size_t b = 1; b < blocks; ++b) {
    uint64_t h = 0;
    for (char c : (*palette_)[static_cast<BlockId>(b)].name) h = hash_combine(h, static_cast<unsigned char>(c));
    name_hash[b] = h | 1;
  }
  // A voxel adds mix(name + index in its leaf), a leaf adds mix(position, sum): sums commute, so neither tiles nor
  // order matter. The name's multiple keeps this a multiply and two xor-shifts a voxel.
  const auto voxel_hash = [&](BlockId b, int i) { return mix64(name_hash[b] + static_cast<uint64_t>(i)); };
  for (size_t b = 1; b < blocks; ++b)
    for (int i = 0; i < kLeafVoxels; ++i) uniform_hash[b] += voxel_hash(static_cast<BlockId>(b), i);
  const std::vector<RegionPos> all = regions();
  return ordered_reduce<uint64_t>(
      all.size(), 1, 0,
      [&](size_t begin, size_t) {
        uint64_t sum = 0;
        RegionLeaves leaves(nodes_->regions.at(all[begin]));
        for (int n = 0; n < kLeavesPerRegion; ++n) {
          const LeafBlocks leaf = leaves(n);
          uint64_t h = 0;
          if (!leaf.values) {
            if (leaf.uniform == kAir) continue;
            h = uniform_hash[leaf.uniform];
          } else {
            for (int i = 0; i < kLeafVoxels; ++i)
              if (leaf.values[i] != kAir) h += voxel_hash(leaf.values[i], i);
          }
          const LeafPos l = leaf_from_region(all[begin]) + leaf_offset_in_region(n);
          sum += random_bits(h, l.x, l.y, l.z);
        }
        return sum;
      },
      [](uint64_t a, uint64_t b) { return a + b; });
}

const MaskVolume& Store::masks(MaskKind kind) const {
  auto& slot = nodes_->masks[static_cast<int>(kind)];
  if (slot) return *slot;
  slot = std::make_unique<MaskVolume>();
  const std::vector<RegionPos> all = regions();
  std::vector<std::unique_ptr<MaskRegion>> built(all.size());
  parallel_for(all.size(), [&](size_t i) {
    built[i] = build_mask_region(nodes_->regions.at(all[i]), all[i], palette_->masks(), static_cast<int>(kind));
  });
  for (size_t i = 0; i < all.size(); ++i) slot->put_region(all[i], std::move(built[i]));
  slot->finish();
  return *slot;
}

// ---- Store: writing --------------------------------------------------------------------------------------------

void Store::note_change(LeafPos l) {
  nodes_->changed(region_from_leaf(l));
  for (auto& list : nodes_->dirty)
    if (list.empty() || list.back() != l) list.push_back(l);
}

void Store::leaf_changed(LeafPos l) {
  note_change(l);
  for (int k = 0; k < kMaskKinds; ++k)
    if (nodes_->masks[k]) nodes_->masks[k]->set_leaf(l, leaf_mask_of_kind(nodes_->leaf(l), palette_->masks(), k));
}

namespace {

bool not_air(const RegionSlot& slot, int leaf_index) {
  if (slot.packed) return slot.packed->is_mixed(leaf_index) || slot.packed->uniform_block(leaf_index) != kAir;
  const LeafBlocks leaf = leaf_of(*slot.node, leaf_index);
  return leaf.values || leaf.uniform != kAir;
}

/// Tells those who follow of every leaf that was or is not air.
void note_replaced(StoreNodes& nodes, RegionPos pos, const RegionSlot* before, const RegionSlot* after) {
  if (nodes.dirty.empty()) return;
  std::vector<LeafPos> changed;
  for (int i = 0; i < kLeavesPerRegion; ++i)
    if ((before && not_air(*before, i)) || (after && not_air(*after, i)))
      changed.push_back(leaf_from_region(pos) + leaf_offset_in_region(i));
  for (auto& list : nodes.dirty) list.insert(list.end(), changed.begin(), changed.end());
}

const RegionSlot* slot_at(const StoreNodes& nodes, RegionPos r) {
  const auto found = nodes.regions.find(r);
  return found == nodes.regions.end() ? nullptr : &found->second;
}

}  // namespace

void Store::adopt(RegionBuilder&& region) {
  CHECK_EQ(nodes_->views.load(), 0);
  const RegionPos pos = region.pos();
  const RegionSlot built{.node = region.impl_->node.get(), .packed = nullptr};
  note_replaced(*nodes_, pos, slot_at(*nodes_, pos), &built);
  RegionCensus census;
  count_region(built, palette_->size(), census);
  nodes_->put_region(pos, region.impl_->node.release());
  nodes_->census[pos] = std::move(census);
  nodes_->changed(pos);
  for (int k = 0; k < kMaskKinds; ++k)
    if (nodes_->masks[k]) {
      nodes_->masks[k]->put_region(pos, build_mask_region(built, pos, palette_->masks(), k));
      nodes_->masks[k]->finish();
    }
}

void Store::prune() {
  CHECK_EQ(nodes_->views.load(), 0);
  for (auto& [pos, slot] : nodes_->regions) {
    if (!slot.node) continue;
    nodes_->before_change(pos);
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const LeafBlocks leaf = leaf_of(*slot.node, i);
      if (leaf.values && all_equal(leaf.values))
        slot.node->addTile(1, coord(voxel_from_leaf(leaf_from_region(pos) + leaf_offset_in_region(i))), leaf.values[0],
                           leaf.values[0] != kAir);
    }
  }
}

// ---- what a save lacks -----------------------------------------------------------------------------------------

std::vector<RegionPos> Store::unsaved() const {
  std::vector<RegionPos> all(nodes_->unsaved.begin(), nodes_->unsaved.end());
  std::sort(all.begin(), all.end());
  return all;
}

bool Store::has_unsaved() const {
  return !nodes_->unsaved.empty() || !nodes_->dropped_layers.empty() ||
         std::any_of(nodes_->layers.begin(), nodes_->layers.end(), [](const auto& entry) {
           return std::visit([](const auto& values) { return !values.unsaved().empty(); }, entry.second);
         });
}

bool Store::is_unsaved(RegionPos r) const {
  return nodes_->unsaved.contains(r) ||
         std::any_of(nodes_->layers.begin(), nodes_->layers.end(), [&](const auto& entry) {
           return std::visit([&](const auto& values) { return values.is_unsaved(r); }, entry.second);
         });
}

void Store::mark_saved() {
  nodes_->unsaved.clear();
  nodes_->last_unsaved.reset();
  nodes_->dropped_layers.clear();
  for (auto& [layer, grid] : nodes_->layers) std::visit([](auto& values) { values.mark_saved(); }, grid);
}

void Store::mark_unsaved(std::span<const RegionPos> regions) { nodes_->unsaved.insert(regions.begin(), regions.end()); }

StoreSnapshot Store::snapshot(std::span<const RegionPos> regions) const {
  std::erase_if(nodes_->in_snapshot, [](const auto& entry) { return entry.second.expired(); });
  StoreSnapshot snapshot;
  snapshot.regions_.reserve(regions.size());
  for (const RegionPos& r : regions) {
    auto region = std::make_shared<StoreSnapshot::Region>();
    region->pos = r;
    region->census = region_census(r);
    if (const RegionSlot* slot = slot_at(*nodes_, r)) {
      region->packed = slot->packed;
      region->node = slot->node;
      if (slot->node) {
        nodes_->copy_for_snapshot(r);  // an older snapshot keeps its own
        nodes_->in_snapshot[r] = region;
      }
    }
    snapshot.regions_.push_back(std::move(region));
  }
  return snapshot;
}

// ---- what is in memory -----------------------------------------------------------------------------------------

void Store::install(PreparedRegion&& region) {
  CHECK_EQ(nodes_->views.load(), 0);
  const RegionPos pos = region.pos();
  CHECK(!is_unsaved(pos));
  if (region.packed_->is_air()) return evict(pos);
  const RegionSlot built{.node = nullptr, .packed = region.packed_};
  note_replaced(*nodes_, pos, slot_at(*nodes_, pos), &built);
  nodes_->put_packed(pos, std::move(region.packed_));
  nodes_->census[pos].counts = std::move(region.counts_);
  for (int k = 0; k < kMaskKinds; ++k) {
    if (!nodes_->masks[k]) continue;
    const bool prepared = region.mask_kinds_ >> k & 1;
    nodes_->masks[k]->put_region(
        pos, prepared ? std::move(region.masks_[k]) : build_mask_region(built, pos, palette_->masks(), k));
    nodes_->masks[k]->finish();
  }
}

void Store::install(Layer layer, RegionPos r, AnyLayer&& part) {
  CHECK_EQ(nodes_->views.load(), 0);
  std::visit(
      [&](auto& values) {
        CHECK(!values.is_unsaved(r));
        values.install(r, std::get<std::decay_t<decltype(values)>>(std::move(part)));
      },
      make_any_layer(layer));
}

void Store::evict(RegionPos r) {
  CHECK_EQ(nodes_->views.load(), 0);
  for (auto& [layer, grid] : nodes_->layers) std::visit([&](auto& values) { values.evict(r); }, grid);
  const RegionSlot* slot = slot_at(*nodes_, r);
  if (!slot) return;
  note_replaced(*nodes_, r, slot, nullptr);
  nodes_->remove_region(r);
  nodes_->census.erase(r);
  nodes_->unsaved.erase(r);
  if (nodes_->last_unsaved == r) nodes_->last_unsaved.reset();
  for (auto& masks : nodes_->masks)
    if (masks) {
      masks->put_region(r, nullptr);
      masks->finish();
    }
}

void Store::pack(RegionPos r) {
  CHECK_EQ(nodes_->views.load(), 0);
  const RegionSlot* slot = slot_at(*nodes_, r);
  if (!slot || slot->packed) return;
  RegionLeaves leaves(*slot);
  auto packed = std::make_shared<const PackedRegion>([&](int i) { return leaves(i); });
  if (packed->is_air())
    nodes_->remove_region(r);
  else
    nodes_->put_packed(r, std::move(packed));
}

void Store::pack() {
  CHECK_EQ(nodes_->views.load(), 0);
  std::vector<RegionPos> open;
  for (const auto& [pos, slot] : nodes_->regions)
    if (slot.node) open.push_back(pos);
  std::sort(open.begin(), open.end());
  std::vector<std::shared_ptr<const PackedRegion>> packed(open.size());
  parallel_for(open.size(), [&](size_t i) {
    RegionLeaves leaves(nodes_->regions.at(open[i]));
    packed[i] = std::make_shared<const PackedRegion>([&](int leaf) { return leaves(leaf); });
  });
  for (size_t i = 0; i < open.size(); ++i) {
    if (packed[i]->is_air())
      nodes_->remove_region(open[i]);
    else
      nodes_->put_packed(open[i], std::move(packed[i]));
  }
  // Nodes of 4096^3 without an open region cost 264 KiB each.
  if (!open.empty()) nodes_->tree.clear();
}

bool Store::is_packed(RegionPos r) const {
  const RegionSlot* slot = slot_at(*nodes_, r);
  return slot && slot->packed;
}

void Store::refreeze(RegionPos r) {
  CHECK_EQ(nodes_->views.load(), 0);
  if (const RegionSlot* slot = slot_at(*nodes_, r); slot && slot->packed) slot->packed->refreeze();
}

size_t Store::region_bytes(RegionPos r) const {
  size_t total = 0;
  if (const RegionSlot* slot = slot_at(*nodes_, r))
    total += slot->packed ? slot->packed->bytes()
                          : sizeof(RegionNode) + slot->node->getChildMask().countOn() *
                                                     (sizeof(BlockLeaf) + kLeafVoxels * sizeof(BlockId));
  for (const auto& masks : nodes_->masks)
    if (masks)
      if (const MaskRegion* region = masks->region(r)) total += bytes_of(*region);
  for (const auto& [layer, grid] : nodes_->layers)
    total += std::visit([&](const auto& values) { return values.region_bytes(r); }, grid);
  return total;
}

unsigned Store::mask_kinds() const {
  unsigned kinds = 0;
  for (int k = 0; k < kMaskKinds; ++k) kinds |= nodes_->masks[k] ? 1u << k : 0u;
  return kinds;
}

// ---- what changed ----------------------------------------------------------------------------------------------

uint64_t Store::identity() const { return nodes_->identity; }

int Store::subscribe() const {
  nodes_->dirty.emplace_back();
  return static_cast<int>(nodes_->dirty.size()) - 1;
}

std::vector<LeafPos> Store::take_dirty(int subscriber) const {
  std::vector<LeafPos> taken = std::move(nodes_->dirty[static_cast<size_t>(subscriber)]);
  nodes_->dirty[static_cast<size_t>(subscriber)].clear();
  std::sort(taken.begin(), taken.end());
  taken.erase(std::unique(taken.begin(), taken.end()), taken.end());
  return taken;
}

void Store::begin_view() const { ++nodes_->views; }
void Store::end_view() const { --nodes_->views; }

// ---- StoreReader -----------------------------------------------------------------------------------------------

/// The regions last used, by the low three bits of each coordinate: a world of up to 8 regions an axis never looks
/// twice.
struct StoreReader::Impl {
  struct Entry {
    RegionPos pos{INT32_MAX, 0, 0};
    const RegionNode* node = nullptr;
    const PackedRegion* packed = nullptr;
  };
  const StoreNodes* nodes;
  LeafPos last_pos{INT32_MAX, 0, 0};  // of get()
  LeafBlocks last;
  const PackedRegion* last_packed = nullptr;  // where the leaf is packed and mixed
  Entry entries[512];

  const Entry& region(RegionPos r) {
    Entry& entry = entries[(r.x & 7) << 6 | (r.y & 7) << 3 | (r.z & 7)];
    if (entry.pos != r) {
      const auto found = nodes->regions.find(r);
      entry = found == nodes->regions.end() ? Entry{r} : Entry{r, found->second.node, found->second.packed.get()};
    }
    return entry;
  }
};

StoreReader::StoreReader(const Store& store) : impl_(std::make_unique<Impl>()) { impl_->nodes = &store.nodes(); }
StoreReader::~StoreReader() = default;

LeafBlocks StoreReader::leaf(LeafPos l) {
  const Impl::Entry& region = impl_->region(region_from_leaf(l));
  if (region.node) return leaf_of(*region.node, index_in_region(l));
  return region.packed ? region.packed->leaf(index_in_region(l)) : LeafBlocks{};
}

BlockId StoreReader::get(VoxelPos v) {
  if (const LeafPos l = leaf_from_voxel(v); l != impl_->last_pos) {
    const Impl::Entry& region = impl_->region(region_from_leaf(l));
    const int index = index_in_region(l);
    const bool packed = region.packed && region.packed->is_mixed(index);
    impl_->last_packed = packed ? region.packed : nullptr;
    if (!packed)
      impl_->last = region.node     ? leaf_of(*region.node, index)
                    : region.packed ? LeafBlocks{nullptr, region.packed->uniform_block(index)}
                                    : LeafBlocks{};
    impl_->last_pos = l;
  }
  // Single voxels are read from the planes; only bulk reads, by leaf, unpack.
  if (impl_->last_packed) return impl_->last_packed->get(index_in_region(impl_->last_pos), index_in_leaf(v));
  return impl_->last[index_in_leaf(v)];
}

}  // namespace world
