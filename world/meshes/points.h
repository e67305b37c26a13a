/// Sets of points, from scanners and elsewhere.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "world/base/errors.h"
#include "world/space/world_point.h"

namespace world {

struct PointSet {
  std::vector<Vec3d> positions;   // in the file's units; all finite
  std::vector<uint32_t> colours;  // 0xRRGGBB, sRGB, of each; or none
  uint64_t not_finite = 0;        // points that were left out: scanners mark "no return" with NaN
};

/// .ply or .pcd, by content. Memory is bounded by the file's size.
Result<PointSet> read_point_file(const std::filesystem::path& path);

/// The vertices of a .ply file, and whether it has faces on them.
Result<PointSet> read_ply_points(std::span<const uint8_t> bytes, std::string_view file);
Result<bool> ply_has_faces(std::span<const uint8_t> bytes, std::string_view file);
Result<PointSet> read_pcd(std::span<const uint8_t> bytes, std::string_view file);

}  // namespace world
