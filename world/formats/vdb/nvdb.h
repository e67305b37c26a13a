/// NanoVDB .nvdb files <-> worlds. No NanoVDB header here.
#pragma once

#include "world/formats/vdb.h"

namespace world {

struct NvdbGridFacts {
  std::string name, type, grid_class;     // "density", "Float", "FogVolume", as NanoVDB names them
  uint64_t active_voxels = 0, bytes = 0;  // as the file's table says; bytes in memory
  VoxelBox bounds;                        // of active voxels, index space
  Vec3d world_min{0.0}, world_max{0.0};   // m
  Vec3d voxel_size{0.0};                  // m
  uint32_t leaf_nodes = 0, lower_nodes = 0, upper_nodes = 0, root_nodes = 0;
  uint32_t active_tiles[3] = {0, 0, 0};  // lower, upper, root
};

struct NvdbFacts {
  std::string version;  // "32.4.2"
  std::string codec;    // "NONE", "ZIP" or "BLOSC", of the first segment
  std::vector<NvdbGridFacts> grids;
};

/// What the tables of the file say, without unpacking any grid.
Result<NvdbFacts> inspect_nvdb(std::span<const uint8_t> bytes, std::string_view name);

Result<World> world_from_nvdb(std::span<const uint8_t> bytes, const std::string& name, ImportReport& report,
                              const ImportOptions& options = {});
Status write_nvdb(const World& world, const std::filesystem::path& path);

}  // namespace world
