/// OpenVDB .vdb files <-> worlds; the mapping is described in vdb.cpp. No OpenVDB header here.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "world/formats/format.h"

namespace world {

struct VdbGridFacts {
  std::string name, type, grid_class, map;  // "density", "Tree_float_5_4_3", "fog volume", "UniformScaleMap"
  bool half = false;                        // 16-bit floats in the file
  uint64_t active_voxels = 0;               // voxels of tiles included
  uint64_t leaf_nodes = 0, active_tiles = 0;
  VoxelBox bounds;                     // of active voxels, index space
  Vec3d voxel_size{0.0}, origin{0.0};  // m; the world place of index (0, 0, 0)
  uint64_t points = 0;                 // of point grids
  /// Of active voxels; grids of one number a voxel only.
  struct Values {
    double background = 0, min = 0, max = 0, sum = 0;
  };
  std::optional<Values> values;
};

struct VdbFacts {
  uint32_t file_version = 0, library_major = 0, library_minor = 0;
  std::string uuid;
  std::vector<VdbGridFacts> grids;
};

/// Reads and checks all grids. OpenVDB trusts what it reads, so a child process with limits tries it first: a damaged
/// file that crashes, hangs or asks for too much memory is an error here. Values that are not finite are errors too.
Result<VdbFacts> inspect_vdb(std::span<const uint8_t> bytes, std::string_view name);
Result<VdbFacts> inspect_vdb(const std::filesystem::path& path);

Result<World> world_from_vdb(std::span<const uint8_t> bytes, const std::string& name, ImportReport& report,
                             const ImportOptions& options = {});
const Format& vdb_format();

}  // namespace world
