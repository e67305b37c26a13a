#include "world/store/layer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

#include "world/store/grid_stream.h"
#include "world/store/region_grid.h"

namespace world {

namespace {

constexpr LayerRow kRows[] = {
#define LAYER(name, type, background, unit, what) {#name, #type, unit, what},
#include "world/store/layers.def"
#undef LAYER
};

using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using FloatRegion = openvdb::FloatTree::RootNodeType::ChildNodeType::ChildNodeType;
static_assert(FloatRegion::DIM == kRegionSize);

/// Adds what is active of the region to another tree.
void copy_region(const openvdb::FloatTree& from, RegionPos r, openvdb::FloatTree& to) {
  const openvdb::Coord at = coord(voxel_from_region(r));
  const FloatRegion* node = from.probeConstNode<FloatRegion>(at);
  if (!node) {
    if (from.isValueOn(at)) to.addTile(2, at, from.getValue(at), true);
    return;
  }
  for (openvdb::Index n = 0; n < FloatRegion::NUM_VALUES; ++n) {
    if (node->isChildMaskOn(n)) {
      const FloatLeaf& leaf = *node->getTable()[n].getChild();
      if (!leaf.getValueMask().isOff()) to.addLeaf(new FloatLeaf(leaf));
    } else if (node->isValueMaskOn(n)) {
      to.addTile(1, node->offsetToGlobalCoord(n), node->getTable()[n].getValue(), true);
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

FloatLayer::FloatLayer() : grid_(std::make_unique<Grid>()) {}
FloatLayer::~FloatLayer() = default;
FloatLayer::FloatLayer(FloatLayer&&) noexcept = default;
FloatLayer& FloatLayer::operator=(FloatLayer&&) noexcept = default;

float FloatLayer::get(VoxelPos v) const { return grid_->grid->tree().getValue(coord(v)); }
void FloatLayer::set(VoxelPos v, float value) {
  grid_->grid->tree().setValueOn(coord(v), value);
  const RegionPos r = region_from_voxel(v);
  if (last_unsaved_ == r) return;
  unsaved_.insert(r);
  last_unsaved_ = r;
}
bool FloatLayer::active(VoxelPos v) const { return grid_->grid->tree().isValueOn(coord(v)); }
uint64_t FloatLayer::active_voxels() const { return grid_->grid->activeVoxelCount(); }
size_t FloatLayer::bytes() const { return grid_->grid->memUsage(); }

FloatLayer::Grid& FloatLayer::grid() {
  for (const RegionPos& r : regions()) unsaved_.insert(r);
  all_unsaved_ = true;
  return *grid_;
}

// ---- by region ---------------------------------------------------------------------------------------------------

std::vector<RegionPos> FloatLayer::unsaved() const {
  std::vector<RegionPos> all(unsaved_.begin(), unsaved_.end());
  if (all_unsaved_) {
    const std::vector<RegionPos> there = regions();
    all.insert(all.end(), there.begin(), there.end());
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

bool FloatLayer::is_unsaved(RegionPos r) const { return unsaved_.contains(r) || (all_unsaved_ && holds(r)); }

void FloatLayer::mark_saved() {
  unsaved_.clear();
  last_unsaved_.reset();
  all_unsaved_ = false;
}

void FloatLayer::mark_unsaved(std::span<const RegionPos> regions) { unsaved_.insert(regions.begin(), regions.end()); }

FloatLayer FloatLayer::copy_of(std::span<const RegionPos> regions) const {
  FloatLayer copy;
  for (const RegionPos& r : regions) copy_region(grid_->grid->constTree(), r, copy.grid_->grid->tree());
  return copy;
}

bool FloatLayer::holds(RegionPos r) const {
  const auto& tree = grid_->grid->constTree();
  const openvdb::Coord at = coord(voxel_from_region(r));
  if (const FloatRegion* node = tree.probeConstNode<FloatRegion>(at)) {
    if (!node->getValueMask().isOff()) return true;
    for (auto leaf = node->cbeginChildOn(); leaf; ++leaf)
      if (!leaf->getValueMask().isOff()) return true;
    return false;
  }
  return tree.isValueOn(at);
}

size_t FloatLayer::region_bytes(RegionPos r) const {
  const FloatRegion* node = grid_->grid->constTree().probeConstNode<FloatRegion>(coord(voxel_from_region(r)));
  if (!node) return 0;
  return sizeof(FloatRegion) + node->getChildMask().countOn() * (sizeof(FloatLeaf) + kLeafVoxels * sizeof(float));
}

void FloatLayer::install(RegionPos r, FloatLayer&& part) {
  evict(r);
  grid_->grid->tree().merge(part.grid_->grid->tree());  // nodes change their owner, no value is copied
}

void FloatLayer::evict(RegionPos r) {
  auto& tree = grid_->grid->tree();
  const openvdb::Coord at = coord(voxel_from_region(r));
  if (tree.probeConstNode<FloatRegion>(at) || tree.isValueOn(at)) tree.addTile(2, at, 0.0f, false);
  unsaved_.erase(r);
  if (last_unsaved_ == r) last_unsaved_.reset();
}

VoxelBox FloatLayer::bounds() const {
  const openvdb::CoordBBox box = grid_->grid->evalActiveVoxelBoundingBox();
  return box.empty() ? VoxelBox{} : VoxelBox{voxel(box.min()), voxel(box.max())};
}

void FloatLayer::read_cube(VoxelPos low, int size, std::span<float> values) const {
  openvdb::FloatGrid::ConstUnsafeAccessor reader(grid_->grid->tree());
  size_t i = 0;
  for (int x = 0; x < size; ++x)
    for (int y = 0; y < size; ++y)
      for (int z = 0; z < size; ++z, ++i)
        if (!reader.probeValue(coord(low + VoxelPos{x, y, z}), values[i]))
          values[i] = std::numeric_limits<float>::quiet_NaN();
}

std::vector<LeafPos> FloatLayer::leaves() const {
  std::vector<LeafPos> all;
  const auto& tree = grid_->grid->tree();
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf)
    if (!leaf->getValueMask().isOff()) all.push_back(leaf_from_voxel(voxel(leaf->origin())));
  auto tile = tree.cbeginValueOn();
  tile.setMaxDepth(openvdb::FloatTree::ValueOnCIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    openvdb::CoordBBox box;
    tile.getBoundingBox(box);
    const LeafPos a = leaf_from_voxel(voxel(box.min())), b = leaf_from_voxel(voxel(box.max()));
    for (int x = a.x; x <= b.x; ++x)
      for (int y = a.y; y <= b.y; ++y)
        for (int z = a.z; z <= b.z; ++z) all.push_back({x, y, z});
  }
  std::sort(all.begin(), all.end());
  return all;
}

std::vector<RegionPos> FloatLayer::regions() const {
  std::vector<RegionPos> all;
  for (auto value = grid_->grid->tree().cbeginValueOn(); value; ++value) {
    // One step a leaf or tile is enough: within a leaf the region is the same.
    openvdb::CoordBBox box;
    value.getBoundingBox(box);
    const RegionPos a = region_from_voxel(voxel(box.min())), b = region_from_voxel(voxel(box.max()));
    for (int x = a.x; x <= b.x; ++x)
      for (int y = a.y; y <= b.y; ++y)
        for (int z = a.z; z <= b.z; ++z)
          if (all.empty() || all.back() != RegionPos{x, y, z}) all.push_back({x, y, z});
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

Result<std::string> FloatLayer::encode_region(RegionPos r, StreamCompression compression) const {
  initialize_openvdb();
  try {
    // Only the values belong to the stream, not where they came from.
    auto grid = openvdb::FloatGrid::create(0.0f);
    copy_region(grid_->grid->constTree(), r, grid->tree());
    grid->setName("values");
    return stream_bytes(grid, compression);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    return input_error(std::string("OpenVDB could not write a region: ") + e.what());
  }
}

Status FloatLayer::decode_region(std::span<const char> bytes, RegionPos r) {
  openvdb::FloatTree tree(0.0f);
  const auto tile = [&](VoxelPos origin, int size, float value, bool active) -> Status {
    if (!active) return {};
    if (!std::isfinite(value)) return input_error("the layer holds a value that is not finite");
    tree.addTile(size == kLeafSize ? 1 : 2, coord(origin), value, true);
    return {};
  };
  const auto leaf = [&](LeafPos l, std::span<const float, kLeafVoxels> values,
                        std::span<const uint64_t, 8> active) -> Status {
    auto made = std::make_unique<openvdb::FloatTree::LeafNodeType>(coord(voxel_from_leaf(l)), 0.0f, false);
    for (openvdb::Index v = 0; v < kLeafVoxels; ++v) {
      if (!(active[v / 64] >> v % 64 & 1)) continue;
      if (!std::isfinite(values[v])) return input_error("the layer holds a value that is not finite");
      made->setValueOn(v, values[v]);
    }
    tree.addLeaf(made.release());
    return {};
  };
  TRY_STATUS(read_region_grid<float>(bytes, r, {tile, leaf}));
  grid_->grid->tree().merge(tree);
  unsaved_.insert(r);
  last_unsaved_.reset();
  return {};
}

}  // namespace world
