// Wavefront .obj -> world: the surface as a solid or a shell. Writing surfaces is render/export's.
#include "world/base/file.h"
#include "world/formats/surfaces/geometry.h"
#include "world/meshes/builder.h"

namespace world {

const Format& obj_format() {
  static const Format format = {
      .name = "obj",
      .extensions = {".obj"},
      .what = "triangle meshes, as solids",
      .recognizes = nullptr,
      .read = [](const std::filesystem::path& path, const ImportOptions& options,
                 ImportReport& report) -> Result<World> {
        TRY(const std::vector<uint8_t> bytes, read_file(path, uint64_t{1} << 31));
        MeshReport read;
        MeshFileFacts facts;
        TRY(const TriangleMesh mesh, read_obj(bytes, path.string(), read, &facts));
        return world_from_mesh(mesh, facts, read, path.string(), path.stem().string(), options, report);
      },
      .write = nullptr,
  };
  return format;
}

}  // namespace world
