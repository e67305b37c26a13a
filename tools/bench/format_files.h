/// Files that Loam reads and does not write, for benchmarks: parts of a world, and surfaces and points by formula.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "world/world.h"

namespace tools {

using Bytes = std::vector<uint8_t>;

struct FormatFile {
  std::string bytes = {};          // of the file; empty of a map, which is written at once
  std::vector<Bytes> packed = {};  // its zlib, gzip or Zstandard streams
  size_t largest_content = 0;      // bytes of what the largest of them holds
  double work = 0;                 // voxels, air too; posts, triangles or points
};

/// The box in few blocks of the other program: what a block is named costs nothing by the voxel.
FormatFile litematic_file(const world::Store& store, const world::VoxelBox& box);
FormatFile mts_file(const world::Store& store, const world::VoxelBox& box);  // each side at most 65535
/// Map blocks of 16^3 in Zstandard frames, as Luanti 5.5 and later write them. `box`: of whole map blocks.
world::Result<FormatFile> write_luanti_map(const world::Store& store, const world::VoxelBox& box,
                                           const std::filesystem::path& path);
FormatFile hgt_file(int posts_a_side);  // 1201 or 3601
/// A wavy square of 2 (points_a_side - 1)^2 triangles over as many metres.
FormatFile obj_file(int points_a_side);
FormatFile ply_mesh_file(int points_a_side);
FormatFile ply_points_file(int count);  // binary, at random in 256^3 m
FormatFile pcd_file(int count);         // the same

/// Unpacks all of the file's streams into one buffer, and looks at nothing; false where one is damaged.
bool unpack_alone(const FormatFile& file);

}  // namespace tools
