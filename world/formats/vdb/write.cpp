// Writing a world as a grid of block ids and one for each further layer.
#include "world/formats/vdb/grids.h"

#include <cmath>
#include <cstring>
#include <fstream>

#include <fmt/format.h>

#include "world/base/random.h"
#include "world/store/grid_stream.h"

namespace world::vdb {
namespace {

openvdb::Int32Tree::Ptr int32_from_store(const Store& store) {
  auto tree = std::make_shared<openvdb::Int32Tree>(kAir);
  for (const RegionPos r : store.regions()) add_region_ids(*tree, r, RegionLeaves(store.nodes().regions.at(r)));
  tree->prune();
  return tree;
}

/// A UUID that says the same for the same content.
std::string uuid_of(const Store& store) {
  const uint64_t a = store.content_hash(), b = mix64(a);
  return fmt::format("{:08x}-{:04x}-{:04x}-{:04x}-{:012x}", a >> 32, a >> 16 & 0xffff, a & 0xffff, b >> 48,
                     b & 0xffffffffffff);
}

/// Indices to metres: what the file that the world came from said, else voxels that begin at their low corner.
openvdb::math::Transform::Ptr transform_of(const World& world) {
  double size = 1;
  if (const auto known = world.metadata.find("voxel_size_m"); known != world.metadata.end()) {
    const double value = std::strtod(known->second.c_str(), nullptr);
    if (std::isfinite(value) && value > 1e-9 && value < 1e9) size = value;
  }
  const auto transform = openvdb::math::Transform::createLinearTransform(size);
  // OpenVDB's index points are the middles of voxels.
  openvdb::Vec3d origin(0.5 * size);
  if (const auto known = world.metadata.find(kOriginKey); known != world.metadata.end()) {
    openvdb::Vec3d read;
    if (std::sscanf(known->second.c_str(), "%lf %lf %lf", &read[0], &read[1], &read[2]) == 3 && read.isFinite())
      origin = read;
  }
  transform->postTranslate(origin);
  return transform;
}

}  // namespace

openvdb::GridCPtrVec grids_from_world(const World& world) {
  const auto transform = transform_of(world);
  auto grid = openvdb::Int32Grid::create(int32_from_store(world.store));
  grid->setName(kBlockGrid);
  grid->setCreator("Loam");
  grid->setTransform(transform);
  for (size_t id = 0; id < world.palette->size(); ++id) {
    grid->insertMeta(kBlockKey + std::to_string(id),
                     openvdb::StringMetadata(toml_from_block((*world.palette)[static_cast<BlockId>(id)])));
  }
  for (const auto& [key, value] : world.metadata) grid->insertMeta(kAboutKey + key, openvdb::StringMetadata(value));
  grid->addStatsMetadata();
  openvdb::GridCPtrVec grids{grid};
  for (const LayerRow& row : layer_rows()) {
    const Layer layer = *layer_from_name(row.name);
    const AnyLayer* any = layer == Layer::block ? nullptr : world.store.find_any_layer(layer);
    if (!any) continue;
    const openvdb::GridBase::Ptr of_layer =
        std::visit([](const auto& values) -> openvdb::GridBase::Ptr { return values.grid().grid->deepCopy(); }, *any);
    of_layer->setName(std::string(row.name));
    of_layer->setTransform(transform);
    if (layer == Layer::density) of_layer->setGridClass(openvdb::GRID_FOG_VOLUME);
    of_layer->addStatsMetadata();
    grids.push_back(of_layer);
  }
  return grids;
}

Status write_vdb(const World& world, const std::filesystem::path& path) {
  initialize_openvdb();
  try {
    const openvdb::GridCPtrVec grids = grids_from_world(world);
    openvdb::MetaMap about_file;
    about_file.insertMeta("creator", openvdb::StringMetadata("Loam"));

    // Our own stream, because OpenVDB's file writer does not say when a disk is full.
    std::ofstream out(path, std::ios::binary);
    if (!out) return input_error(fmt::format("{}: cannot write: {}", path.string(), std::strerror(errno)));
    openvdb::io::Stream stream(out);
    stream.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    stream.write(grids, about_file);
    out.seekp(static_cast<std::streamoff>(kUuidOffset));
    out << uuid_of(world.store);
    out.close();
    if (!out) return input_error(fmt::format("{}: cannot write all of it: {}", path.string(), std::strerror(errno)));
  } catch (const std::exception& e) {
    return input_error(fmt::format("{}: OpenVDB cannot write it: {}", path.string(), e.what()));
  }
  return {};
}

}  // namespace world::vdb
