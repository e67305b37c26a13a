// Writing a world as one grid of block ids.
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
  for (const RegionPos r : store.regions()) add_region_ids(*tree, *store.nodes().regions.at(r));
  tree->prune();
  return tree;
}

/// A UUID that says the same for the same content.
std::string uuid_of(const Store& store) {
  const uint64_t a = store.content_hash(), b = mix64(a);
  return fmt::format("{:08x}-{:04x}-{:04x}-{:04x}-{:012x}", a >> 32, a >> 16 & 0xffff, a & 0xffff, b >> 48,
                     b & 0xffffffffffff);
}

}  // namespace

Status write_vdb(const World& world, const std::filesystem::path& path) {
  initialize_openvdb();
  try {
    auto grid = openvdb::Int32Grid::create(int32_from_store(world.store));
    grid->setName(kBlockGrid);
    grid->setCreator("Loam");
    // OpenVDB's index points are the middles of voxels; ours begin at their low corner.
    double size = 1;
    if (const auto known = world.metadata.find("voxel_size_m"); known != world.metadata.end()) {
      const double value = std::strtod(known->second.c_str(), nullptr);
      if (std::isfinite(value) && value > 1e-9 && value < 1e9) size = value;
    }
    grid->setTransform(openvdb::math::Transform::createLinearTransform(size));
    grid->transform().postTranslate(openvdb::Vec3d(0.5 * size));
    for (size_t id = 0; id < world.palette->size(); ++id) {
      grid->insertMeta(kBlockKey + std::to_string(id),
                       openvdb::StringMetadata(toml_from_block((*world.palette)[static_cast<BlockId>(id)])));
    }
    for (const auto& [key, value] : world.metadata) grid->insertMeta(kAboutKey + key, openvdb::StringMetadata(value));
    grid->addStatsMetadata();
    openvdb::MetaMap about_file;
    about_file.insertMeta("creator", openvdb::StringMetadata("Loam"));

    // Our own stream, because OpenVDB's file writer does not say when a disk is full.
    std::ofstream out(path, std::ios::binary);
    if (!out) return input_error(fmt::format("{}: cannot write: {}", path.string(), std::strerror(errno)));
    openvdb::io::Stream stream(out);
    stream.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    stream.write(openvdb::GridCPtrVec{grid}, about_file);
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
