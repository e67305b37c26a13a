// Writing a world as NanoVDB: the grids of world/formats/vdb/write.cpp, Blosc in one segment each.
#include "world/formats/vdb/nvdb.h"

#include <cstring>
#include <fstream>

#define NANOVDB_USE_BLOSC
#include <blosc.h>
#include <fmt/format.h>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>

#include "world/formats/vdb/grids.h"
#include "world/formats/vdb/nano.h"

namespace world {
namespace {

using Handle = nanovdb::GridHandle<nanovdb::HostBuffer>;

/// The grid with its text metadata behind its tree.
Handle with_text(const Handle& plain, const openvdb::GridBase& grid) {
  std::string text;
  for (auto entry = grid.beginMeta(); entry != grid.endMeta(); ++entry) {
    if (const auto value = grid.getMetadata<openvdb::StringMetadata>(entry->first)) {
      text += entry->first + '\0';
      text += value->value() + '\0';
    }
  }
  const uint64_t tree = plain.size(), head = sizeof(nanovdb::GridBlindMetaData);
  const uint64_t size =
      (tree + head + text.size() + NANOVDB_DATA_ALIGNMENT - 1) / NANOVDB_DATA_ALIGNMENT * NANOVDB_DATA_ALIGNMENT;
  Handle handle(nanovdb::HostBuffer::create(size));
  std::memset(handle.data(), 0, size);
  std::memcpy(handle.data(), plain.data(), tree);
  auto* data = reinterpret_cast<nanovdb::GridData*>(handle.data());
  data->mGridSize = size;
  data->mBlindMetadataOffset = static_cast<int64_t>(tree);
  data->mBlindMetadataCount = 1;
  auto* blind = reinterpret_cast<nanovdb::GridBlindMetaData*>(handle.data() + tree);
  blind->mByteOffset = static_cast<int64_t>(head);
  blind->mElementCount = text.size();
  blind->mDataType = nanovdb::GridType::Unknown;
  blind->mDataClass = nanovdb::GridBlindDataClass::Unknown;
  blind->mSemantic = nanovdb::GridBlindDataSemantic::Unknown;
  std::strncpy(blind->mName, vdb::kTextBlindData, sizeof blind->mName - 1);
  std::memcpy(handle.data() + tree + head, text.data(), text.size());
  nanovdb::updateChecksum(*reinterpret_cast<nanovdb::NanoGrid<int32_t>*>(handle.data()),
                          nanovdb::ChecksumMode::Partial);
  return handle;
}

}  // namespace

Status write_nvdb(const World& world, const std::filesystem::path& path) {
  initialize_openvdb();
  try {
    std::vector<Handle> handles;
    for (const openvdb::GridBase::ConstPtr& grid : vdb::grids_from_world(world)) {
      if (grid->isType<openvdb::Int32Grid>())
        handles.push_back(with_text(nanovdb::openToNanoVDB(static_cast<const openvdb::Int32Grid&>(*grid)), *grid));
      else
        handles.push_back(nanovdb::openToNanoVDB(static_cast<const openvdb::FloatGrid&>(*grid)));
    }
    std::ofstream out(path, std::ios::binary);
    if (!out) return input_error(fmt::format("{}: cannot write: {}", path.string(), std::strerror(errno)));
    nanovdb::io::writeGrids(out, handles, nanovdb::io::Codec::BLOSC);
    out.close();
    if (!out) return input_error(fmt::format("{}: cannot write all of it: {}", path.string(), std::strerror(errno)));
  } catch (const std::exception& e) {
    return input_error(fmt::format("{}: NanoVDB cannot write it: {}", path.string(), e.what()));
  }
  return {};
}

}  // namespace world
