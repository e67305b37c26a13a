// Point Cloud Library .pcd -> world: each voxel that a point lies in, or balls around the points.
#include "world/base/file.h"
#include "world/formats/surfaces/geometry.h"

namespace world {

const Format& pcd_format() {
  static const Format format = {
      .name = "pcd",
      .extensions = {".pcd"},
      .what = "points of scanners: ascii, binary, binary_compressed",
      .recognizes = nullptr,
      .read = [](const std::filesystem::path& path, const ImportOptions& options,
                 ImportReport& report) -> Result<World> {
        TRY(const std::vector<uint8_t> bytes, read_file(path, uint64_t{1} << 32));
        TRY(const PointSet points, read_pcd(bytes, path.string()));
        return world_from_points(points, bytes.size(), path.string(), path.stem().string(), options, report);
      },
      .write = nullptr,
  };
  return format;
}

}  // namespace world
