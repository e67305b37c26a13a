#include "world/store/layer.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <new>
#include <utility>

#include "world/store/grid_stream.h"
#include "world/store/region_grid.h"

namespace world {

namespace {

constexpr LayerRow kRows[] = {
#define LAYER(name, type, background, unit, what) {#name, #type, unit, what, std::is_same_v<type, int32_t>},
#include "world/store/layers.def"
#undef LAYER
};

template <class T>
using TreeOf = typename GridLayer<T>::Grid::Type::TreeType;
template <class T>
using LeafOf = typename TreeOf<T>::LeafNodeType;
template <class T>
using RegionOf = typename TreeOf<T>::RootNodeType::ChildNodeType::ChildNodeType;
static_assert(RegionOf<float>::DIM == kRegionSize && RegionOf<int32_t>::DIM == kRegionSize);
static_assert(LeafOf<float>::SIZE == kLeafVoxels && LeafOf<int32_t>::SIZE == kLeafVoxels);

/// Adds what is active of the region to another tree.
template <class T>
void copy_region(const TreeOf<T>& from, RegionPos r, TreeOf<T>& to) {
  const openvdb::Coord at = coord(voxel_from_region(r));
  const auto* node = from.template probeConstNode<RegionOf<T>>(at);
  if (!node) {
    if (from.isValueOn(at)) to.addTile(2, at, from.getValue(at), true);
    return;
  }
  for (openvdb::Index n = 0; n < RegionOf<T>::NUM_VALUES; ++n) {
    if (node->isChildMaskOn(n)) {
      const LeafOf<T>& leaf = *node->getTable()[n].getChild();
      if (!leaf.getValueMask().isOff()) to.addLeaf(new LeafOf<T>(leaf));
    } else if (node->isValueMaskOn(n)) {
      to.addTile(1, node->offsetToGlobalCoord(n), node->getTable()[n].getValue(), true);
    }
  }
}

/// visit(box) for each leaf with an active voxel, and for each active tile.
template <class T, class Visit>
void for_each_active(const TreeOf<T>& tree, Visit visit) {
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf)
    if (!leaf->getValueMask().isOff()) visit(leaf->getNodeBoundingBox());
  auto tile = tree.cbeginValueOn();
  tile.setMaxDepth(TreeOf<T>::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) visit(tile.getBoundingBox());
}

template <class T>
bool is_finite(T value) {
  if constexpr (std::is_same_v<T, float>) return std::isfinite(value);
  return true;
}

/// Values where their bit is set, else 0: eight at a time, which the compiler compares in vectors.
template <class T>
void copy_active(const T* values, const LeafMask& active, T* out) {
  static constexpr uint32_t kBit[8] = {1, 2, 4, 8, 16, 32, 64, 128};
  for (int w = 0; w < 8; ++w)
    for (int b = 0; b < 64; b += 8) {
      const auto eight = static_cast<uint32_t>(active.word[w] >> b & 0xff);
      for (int i = 0; i < 8; ++i) {
        const uint32_t keep = (eight & kBit[i]) == kBit[i] ? ~uint32_t{0} : 0;
        out[w * 64 + b + i] = std::bit_cast<T>(std::bit_cast<uint32_t>(values[w * 64 + b + i]) & keep);
      }
    }
}

}  // namespace

std::span<const LayerRow> layer_rows() { return kRows; }

std::optional<Layer> layer_from_name(std::string_view name) {
  for (size_t i = 0; i < std::size(kRows); ++i)
    if (kRows[i].name == name) return static_cast<Layer>(i);
  return std::nullopt;
}

AnyLayer empty_layer(Layer layer) {
  CHECK(layer != Layer::block);
  if (kRows[static_cast<size_t>(layer)].is_integer) return IntLayer();
  return FloatLayer();
}

template <class T>
GridLayer<T>::GridLayer() : grid_(std::make_unique<Grid>()) {}
template <class T>
GridLayer<T>::~GridLayer() = default;
template <class T>
GridLayer<T>::GridLayer(GridLayer&&) noexcept = default;
template <class T>
GridLayer<T>& GridLayer<T>::operator=(GridLayer&&) noexcept = default;

template <class T>
T GridLayer<T>::get(VoxelPos v) const {
  return grid_->grid->tree().getValue(coord(v));
}
template <class T>
void GridLayer<T>::set(VoxelPos v, T value) {
  grid_->grid->tree().setValueOn(coord(v), value);
  mark_changed(region_from_voxel(v));
  note_leaf(leaf_from_voxel(v));
}
template <class T>
bool GridLayer<T>::active(VoxelPos v) const {
  return grid_->grid->tree().isValueOn(coord(v));
}
template <class T>
uint64_t GridLayer<T>::active_voxels() const {
  return grid_->grid->activeVoxelCount();
}
template <class T>
size_t GridLayer<T>::bytes() const {
  return grid_->grid->memUsage();
}

template <class T>
typename GridLayer<T>::Grid& GridLayer<T>::grid() {
  for (const RegionPos& r : regions()) unsaved_.insert(r);
  all_unsaved_ = true;
  forget_changes();
  return *grid_;
}

// ---- what changed ------------------------------------------------------------------------------------------------

namespace {
constexpr size_t kMostChanges = size_t{1} << 17;  // kept, 1.5 MB; one who is further behind looks at all
}

template <class T>
void GridLayer<T>::note_leaf(LeafPos l) {
  if (identity_ == 0) return;
  if (journal_begin_ + journal_.size() > told_ && !journal_.empty() && journal_.back() == l) return;
  if (journal_.size() == kMostChanges) forget_changes();
  journal_.push_back(l);
}

template <class T>
void GridLayer<T>::forget_changes() {
  journal_begin_ += journal_.size() + 1;
  journal_.clear();
}

template <class T>
std::optional<std::vector<LeafPos>> GridLayer<T>::changes(LayerMark& mark) const {
  static std::atomic<uint64_t> layers{0};
  if (identity_ == 0) identity_ = ++layers;
  told_ = journal_begin_ + journal_.size();
  const LayerMark before = std::exchange(mark, {identity_, told_});
  if (before.layer != identity_ || before.seen < journal_begin_) return std::nullopt;
  std::vector<LeafPos> changed(journal_.begin() + static_cast<std::ptrdiff_t>(before.seen - journal_begin_),
                               journal_.end());
  std::sort(changed.begin(), changed.end());
  changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
  return changed;
}

// ---- by leaf -----------------------------------------------------------------------------------------------------

template <class T>
bool GridLayer<T>::read_leaf(LeafPos l, std::span<T, kLeafVoxels> values, LeafMask& active) const {
  const auto& tree = grid_->grid->constTree();
  const openvdb::Coord at = coord(voxel_from_leaf(l));
  if (const LeafOf<T>* leaf = tree.probeConstLeaf(at)) {
    std::copy_n(leaf->buffer().data(), kLeafVoxels, values.data());
    for (openvdb::Index w = 0; w < 8; ++w) active.word[w] = leaf->getValueMask().template getWord<uint64_t>(w);
    return !active.is_none();
  }
  const bool is_tile = tree.isValueOn(at);
  active = is_tile ? LeafMask::all() : LeafMask::none();
  std::fill(values.begin(), values.end(), is_tile ? tree.getValue(at) : T{0});
  return is_tile;
}

template <class T>
void GridLayer<T>::write_leaf(LeafPos l, std::span<const T, kLeafVoxels> values, const LeafMask& active) {
  auto& tree = grid_->grid->tree();
  const openvdb::Coord at = coord(voxel_from_leaf(l));
  const RegionPos r = region_from_leaf(l);
  if (!active.is_none()) {
    LeafOf<T>& leaf = *tree.touchLeaf(at);
    copy_active(values.data(), active, leaf.buffer().data());
    typename LeafOf<T>::NodeMaskType mask;
    for (openvdb::Index w = 0; w < 8; ++w) mask.template getWord<uint64_t>(w) = active.word[w];
    leaf.setValueMask(mask);
    mark_changed(r);
    note_leaf(l);
    return;
  }
  auto* node = tree.template probeNode<RegionOf<T>>(at);
  if (!node) {
    if (!tree.isValueOn(at)) return;
    tree.touchLeaf(at);  // of a tile that covers the region
    node = tree.template probeNode<RegionOf<T>>(at);
  }
  const openvdb::Index n = RegionOf<T>::coordToOffset(at);
  if (!node->isChildMaskOn(n) && !node->isValueMaskOn(n)) return;
  node->addTile(1, at, T{0}, false);
  if (node->getChildMask().isOff() && node->getValueMask().isOff()) tree.addTile(2, at, T{0}, false);
  mark_changed(r);
  note_leaf(l);
}

// ---- by region ---------------------------------------------------------------------------------------------------

template <class T>
void GridLayer<T>::mark_changed(RegionPos r) {
  if (last_unsaved_ == r) return;
  unsaved_.insert(r);
  last_unsaved_ = r;
}

template <class T>
std::vector<RegionPos> GridLayer<T>::unsaved() const {
  std::vector<RegionPos> all(unsaved_.begin(), unsaved_.end());
  if (all_unsaved_) {
    const std::vector<RegionPos> there = regions();
    all.insert(all.end(), there.begin(), there.end());
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

template <class T>
bool GridLayer<T>::is_unsaved(RegionPos r) const {
  return unsaved_.contains(r) || (all_unsaved_ && holds(r));
}

template <class T>
void GridLayer<T>::mark_saved() {
  unsaved_.clear();
  last_unsaved_.reset();
  all_unsaved_ = false;
}

template <class T>
void GridLayer<T>::mark_unsaved(std::span<const RegionPos> regions) {
  unsaved_.insert(regions.begin(), regions.end());
}

template <class T>
GridLayer<T> GridLayer<T>::copy_of(std::span<const RegionPos> regions) const {
  GridLayer copy;
  for (const RegionPos& r : regions) copy_region<T>(grid_->grid->constTree(), r, copy.grid_->grid->tree());
  return copy;
}

template <class T>
bool GridLayer<T>::holds(RegionPos r) const {
  const auto& tree = grid_->grid->constTree();
  const openvdb::Coord at = coord(voxel_from_region(r));
  if (const auto* node = tree.template probeConstNode<RegionOf<T>>(at)) {
    if (!node->getValueMask().isOff()) return true;
    for (auto leaf = node->cbeginChildOn(); leaf; ++leaf)
      if (!leaf->getValueMask().isOff()) return true;
    return false;
  }
  return tree.isValueOn(at);
}

template <class T>
size_t GridLayer<T>::region_bytes(RegionPos r) const {
  const auto* node = grid_->grid->constTree().template probeConstNode<RegionOf<T>>(coord(voxel_from_region(r)));
  if (!node) return 0;
  return sizeof(RegionOf<T>) + node->getChildMask().countOn() * (sizeof(LeafOf<T>) + kLeafVoxels * sizeof(T));
}

template <class T>
void GridLayer<T>::install(RegionPos r, GridLayer&& part) {
  evict(r);
  if (identity_ != 0)
    for (const LeafPos l : part.leaves()) note_leaf(l);
  grid_->grid->tree().merge(part.grid_->grid->tree());  // nodes change their owner, no value is copied
}

template <class T>
void GridLayer<T>::evict(RegionPos r) {
  auto& tree = grid_->grid->tree();
  const openvdb::Coord at = coord(voxel_from_region(r));
  const auto* node = tree.template probeConstNode<RegionOf<T>>(at);
  if (identity_ != 0 && node)
    for (openvdb::Index n = 0; n < RegionOf<T>::NUM_VALUES; ++n)
      if (node->isChildMaskOn(n) || node->isValueMaskOn(n))
        note_leaf(leaf_from_voxel(voxel(node->offsetToGlobalCoord(n))));
  if (!node && tree.isValueOn(at)) forget_changes();
  if (node || tree.isValueOn(at)) tree.addTile(2, at, T{0}, false);
  unsaved_.erase(r);
  if (last_unsaved_ == r) last_unsaved_.reset();
}

template <class T>
VoxelBox GridLayer<T>::bounds() const {
  const openvdb::CoordBBox box = grid_->grid->evalActiveVoxelBoundingBox();
  return box.empty() ? VoxelBox{} : VoxelBox{voxel(box.min()), voxel(box.max())};
}

template <class T>
void GridLayer<T>::read_cube(VoxelPos low, int size, T inactive, std::span<T> values) const {
  // Leaf by leaf: a look for each voxel took three times as long.
  const auto& tree = grid_->grid->constTree();
  const VoxelPos high = low + VoxelPos{size - 1, size - 1, size - 1};
  const LeafPos first = leaf_from_voxel(low), last = leaf_from_voxel(high);
  for (int lx = first.x; lx <= last.x; ++lx)
    for (int ly = first.y; ly <= last.y; ++ly)
      for (int lz = first.z; lz <= last.z; ++lz) {
        const VoxelPos corner = voxel_from_leaf({lx, ly, lz});
        const LeafOf<T>* leaf = tree.probeConstLeaf(coord(corner));
        T tile{};
        if (!leaf && !tree.probeValue(coord(corner), tile)) tile = inactive;
        const VoxelPos a{std::max(low.x, corner.x), std::max(low.y, corner.y), std::max(low.z, corner.z)};
        const VoxelPos b{std::min(high.x, corner.x + 7), std::min(high.y, corner.y + 7),
                         std::min(high.z, corner.z + 7)};
        for (int x = a.x; x <= b.x; ++x)
          for (int y = a.y; y <= b.y; ++y) {
            T* out = &values[static_cast<size_t>(((x - low.x) * size + y - low.y) * size + a.z - low.z)];
            if (!leaf) {
              std::fill(out, out + (b.z - a.z + 1), tile);
              continue;
            }
            const auto row = static_cast<openvdb::Index>(index_in_leaf({x, y, a.z}));
            const T* in = leaf->buffer().data() + row;
            for (openvdb::Index n = 0; n <= static_cast<openvdb::Index>(b.z - a.z); ++n)
              out[n] = leaf->isValueOn(row + n) ? in[n] : inactive;
          }
      }
}

template <class T>
std::vector<LeafPos> GridLayer<T>::leaves() const {
  std::vector<LeafPos> all;
  const auto add = [&](const openvdb::CoordBBox& box) {
    const LeafPos a = leaf_from_voxel(voxel(box.min())), b = leaf_from_voxel(voxel(box.max()));
    for (int x = a.x; x <= b.x; ++x)
      for (int y = a.y; y <= b.y; ++y)
        for (int z = a.z; z <= b.z; ++z) all.push_back({x, y, z});
  };
  for_each_active<T>(grid_->grid->constTree(), add);
  std::sort(all.begin(), all.end());
  return all;
}

template <class T>
std::vector<RegionPos> GridLayer<T>::regions() const {
  std::vector<RegionPos> all;
  const auto add = [&](const openvdb::CoordBBox& box) {
    const RegionPos a = region_from_voxel(voxel(box.min())), b = region_from_voxel(voxel(box.max()));
    for (int x = a.x; x <= b.x; ++x)
      for (int y = a.y; y <= b.y; ++y)
        for (int z = a.z; z <= b.z; ++z)
          if (all.empty() || all.back() != RegionPos{x, y, z}) all.push_back({x, y, z});
  };
  for_each_active<T>(grid_->grid->constTree(), add);
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

template <class T>
Result<std::string> GridLayer<T>::encode_region(RegionPos r, StreamCompression compression) const {
  initialize_openvdb();
  try {
    // Only the values belong to the stream, not where they came from.
    auto grid = Grid::Type::create(T{0});
    copy_region<T>(grid_->grid->constTree(), r, grid->tree());
    grid->setName("values");
    return stream_bytes(grid, compression);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    return input_error(std::string("OpenVDB could not write a region: ") + e.what());
  }
}

template <class T>
Status GridLayer<T>::decode_region(std::span<const char> bytes, RegionPos r) {
  TreeOf<T> tree(T{0});
  const auto tile = [&](VoxelPos origin, int size, T value, bool active) -> Status {
    if (!active) return {};
    if (!is_finite(value)) return input_error("the layer holds a value that is not finite");
    tree.addTile(size == kLeafSize ? 1 : 2, coord(origin), value, true);
    return {};
  };
  const auto leaf = [&](LeafPos l, std::span<const T, kLeafVoxels> values,
                        std::span<const uint64_t, 8> active) -> Status {
    auto made = std::make_unique<LeafOf<T>>(coord(voxel_from_leaf(l)), T{0}, false);
    for (openvdb::Index v = 0; v < kLeafVoxels; ++v) {
      if (!(active[v / 64] >> v % 64 & 1)) continue;
      if (!is_finite(values[v])) return input_error("the layer holds a value that is not finite");
      made->setValueOn(v, values[v]);
    }
    tree.addLeaf(made.release());
    return {};
  };
  TRY_STATUS(read_region_grid<T>(bytes, r, {tile, leaf}));
  grid_->grid->tree().merge(tree);
  forget_changes();
  unsaved_.insert(r);
  last_unsaved_.reset();
  return {};
}

template class GridLayer<float>;
template class GridLayer<int32_t>;

}  // namespace world
