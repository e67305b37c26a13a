// Stanford .ply -> world: a mesh where it has faces, else points.
#include "world/base/file.h"
#include "world/formats/surfaces/geometry.h"
#include "world/meshes/builder.h"

namespace world {

const Format& ply_format() {
  static const Format format = {
      .name = "ply",
      .extensions = {".ply"},
      .what = "triangle meshes, as solids, and points",
      .recognizes =
          [](const std::vector<uint8_t>& head) {
            return head.size() >= 4 && head[0] == 'p' && head[1] == 'l' && head[2] == 'y' &&
                   (head[3] == '\n' || head[3] == '\r');
          },
      .read = [](const std::filesystem::path& path, const ImportOptions& options,
                 ImportReport& report) -> Result<World> {
        TRY(const std::vector<uint8_t> bytes, read_file(path, uint64_t{1} << 32));
        const std::string name = path.string(), stem = path.stem().string();
        TRY(const bool faces, ply_has_faces(bytes, name));
        const auto read = [&]() -> Result<World> {
          if (!faces) {
            TRY(const PointSet points, read_ply_points(bytes, name));
            return world_from_points(points, bytes.size(), name, stem, options, report);
          }
          MeshReport mesh_report;
          MeshFileFacts facts;
          MeshColours colours;
          TRY(const TriangleMesh mesh, read_ply(bytes, name, mesh_report, &facts, &colours));
          return world_from_mesh(mesh, facts, mesh_report, colours, {}, name, stem, options, report);
        };
        return read();
      },
      .write = nullptr,
  };
  return format;
}

}  // namespace world
