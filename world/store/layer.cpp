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

openvdb::CoordBBox region_box(RegionPos r) {
  return openvdb::CoordBBox::createCube(coord(voxel_from_region(r)), kRegionSize);
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
void FloatLayer::set(VoxelPos v, float value) { grid().grid->tree().setValueOn(coord(v), value); }
bool FloatLayer::active(VoxelPos v) const { return grid_->grid->tree().isValueOn(coord(v)); }
uint64_t FloatLayer::active_voxels() const { return grid_->grid->activeVoxelCount(); }
size_t FloatLayer::bytes() const { return grid_->grid->memUsage(); }

FloatLayer::Grid& FloatLayer::grid() {
  ++version_;
  if (grid_->grid.use_count() > 1) grid_->grid = grid_->grid->deepCopy();
  return *grid_;
}

FloatLayer FloatLayer::snapshot() const {
  FloatLayer shared;
  shared.grid_->grid = grid_->grid;
  shared.version_ = version_;
  return shared;
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
    auto part = grid_->grid->deepCopy();
    part->clip(region_box(r));
    // Only the values belong to the stream, not where they came from.
    auto grid = openvdb::FloatGrid::create(part->treePtr());
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
  grid().grid->tree().merge(tree);
  return {};
}

}  // namespace world
