// Catmull-Clark subdivision surfaces of a cage of polygons.
//
//   kind = "subdivision"
//   file = "cage.obj"          its creases are lines "t crease 2/1/0 a b sharpness" (vertices counted from 0)
//   levels = 4                 0..8; each makes four quadrilaterals of one, and the triangles 4 times nearer to the
//   limit crease_angle_deg, crease_sharpness = 10      edges at which the cage bends by at least this angle are creases
//   too fill, thickness_m          as of a mesh
#include <array>
#include <cmath>
#include <map>

#include "world/base/file.h"
#include "world/sources/mesh/mesh_shape.h"
#include "world/sources/mesh/subdivide.h"
#include "world/sources/source.h"

namespace world {
namespace {

constexpr uint64_t kMostFileBytes = uint64_t{1} << 30;

/// Adds a crease at each edge between faces whose normals differ by at least the angle.
void add_creases(PolygonMesh& cage, double angle_deg, float sharpness) {
  std::vector<Vec3d> normals;
  std::map<std::pair<uint32_t, uint32_t>, size_t> face_of_edge;  // directed
  size_t first = 0;
  for (size_t face = 0; face < cage.face_sizes.size(); ++face) {
    const uint32_t size = cage.face_sizes[face];
    Vec3d normal(0.0);
    for (uint32_t k = 0; k < size; ++k) {
      const uint32_t a = cage.face_corners[first + k], b = cage.face_corners[first + (k + 1) % size];
      normal += glm::cross(Vec3d(cage.positions[a]), Vec3d(cage.positions[b]));
      face_of_edge[{a, b}] = face;
    }
    normals.push_back(glm::length(normal) > 0 ? glm::normalize(normal) : normal);
    first += size;
  }
  const double limit = std::cos(angle_deg * 3.14159265358979323846 / 180);
  for (const auto& [edge, face] : face_of_edge) {
    if (edge.first > edge.second) continue;
    const auto other = face_of_edge.find({edge.second, edge.first});
    if (other != face_of_edge.end() && glm::dot(normals[face], normals[other->second]) <= limit + 1e-9)
      cage.creases.push_back({edge.first, edge.second, sharpness});
  }
}

std::shared_ptr<const Shape> read_subdivision(TomlTable& table, const SourceContext& context) {
  std::string file;
  int32_t levels = 4;
  double angle = 0;
  float sharpness = 10;
  int kind = 0;
  constexpr std::array<std::string_view, 2> kFills{"solid", "shell"};
  table.read("levels", levels, {0, 8});
  const bool creased = table.read("crease_angle_deg", angle, {0, 180});
  table.read("crease_sharpness", sharpness, {0, 10});
  table.read_choice("fill", kind, kFills);
  MeshFill fill{.shell = kind == 1};
  table.read("thickness_m", fill.thickness, {.min = 0, .max = 1e9});
  if (fill.shell && fill.thickness == 0) fill.thickness = context.voxel_m;
  if (!table.require("file", file)) return nullptr;
  std::filesystem::path path = file;
  if (path.is_relative()) path = context.folder / path;
  const auto mesh = [&]() -> Result<TriangleMesh> {
    TRY(const std::vector<uint8_t> bytes, read_file(path, kMostFileBytes));
    TRY(PolygonMesh cage, read_obj_polygons(bytes, path.string()));
    if (creased) add_creases(cage, angle, sharpness);
    return subdivided(cage, levels, path.string());
  }();
  if (!mesh) {
    table.fail("file", mesh.error().message);
    return nullptr;
  }
  MeshShapeReport report;
  return mesh_shape(*mesh, fill, report);
}

}  // namespace

SourceKind subdivision_source() {
  return {.name = "subdivision", .what = "Catmull-Clark surfaces of a cage, with creases", .read = read_subdivision};
}

}  // namespace world
