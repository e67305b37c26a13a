#include "world/meshes/mesh.h"

#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include "world/base/file.h"
#include "world/meshes/builder.h"

namespace world {
namespace {

constexpr uint64_t kMostBytes = uint64_t{1} << 31;
constexpr double kBorder = kWorldBorder - 1;

glm::dmat3 rotation(int axis, double degrees) {
  const double angle = degrees * 3.14159265358979323846 / 180;
  // Quarter turns are exact, so that what stood on the grid still does.
  double c = std::cos(angle), s = std::sin(angle);
  if (std::fmod(degrees, 90) == 0) c = std::round(c), s = std::round(s);
  glm::dmat3 m(1.0);
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  m[u][u] = c, m[u][v] = s, m[v][u] = -s, m[v][v] = c;
  return m;
}

/// Whether it squeezes no direction to nothing, beside the others.
bool invertible(const glm::dmat3& m) {
  const double size = length(m[0]) * length(m[1]) * length(m[2]);
  return std::abs(dot(m[0], cross(m[1], m[2]))) > 1e-9 * size;
}

void read_transform(TomlTable& table, MeshInstance& mesh, VoxelPos offset) {
  double position[3] = {0, 0, 0}, rows[12], scale[3] = {1, 1, 1}, rotate[3] = {0, 0, 0};
  const NumberRange inside{-kBorder, kBorder}, factor{-1e6, 1e6};
  table.read("position", std::span<double>(position), inside);
  Vec3d moved(position[0], position[1], position[2]);
  if (table.has_array("scale"))
    table.read("scale", std::span<double>(scale), factor);
  else if (table.read("scale", scale[0], factor))
    scale[1] = scale[2] = scale[0];
  if (scale[0] == 0 || scale[1] == 0 || scale[2] == 0) table.fail("scale", "'scale' must not be 0");
  table.read("rotate_deg", std::span<double>(rotate), {-3600, 3600});
  for (int a = 0; a < 3; ++a) mesh.transform[a][a] = scale[a];
  for (int a = 0; a < 3; ++a) mesh.transform = rotation(a, rotate[a]) * mesh.transform;
  if (table.read("matrix", std::span<double>(rows), inside)) {
    if (table.has("scale") || table.has("rotate_deg"))
      table.fail("matrix", "'matrix' excludes 'scale' and 'rotate_deg'");
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) mesh.transform[column][row] = rows[row * 4 + column];
      moved[row] += rows[row * 4 + 3];
    }
    if (!invertible(mesh.transform)) table.fail("matrix", "'matrix' has no inverse: it makes the mesh flat");
  }
  for (int a = 0; a < 3; ++a)
    if (!(std::abs(moved[a]) <= kBorder)) return table.fail("position", "the mesh lies outside the world");
  mesh.position = WorldPoint::from(moved.x, moved.y, moved.z);
  mesh.position.voxel = mesh.position.voxel + offset;
}

void read_material(TomlTable& table, MeshInstance& mesh) {
  table.read("block", mesh.block);
  table.read("null_surface", mesh.null_surface);
  table.read("interior_medium", mesh.interior_medium);
  float radiance[3], checkers[2];
  const bool emits = table.read("radiance", std::span<float>(radiance), {.min = 0, .max = 1e9});
  if (emits) mesh.radiance = {radiance[0], radiance[1], radiance[2]};
  table.read("smooth", mesh.smooth);
  table.read("checker_block", mesh.checker_block);
  if (table.read("checkers", std::span<float>(checkers), {.min = 0, .max = 1e6, .open_min = true}))
    mesh.checkers = {checkers[0], checkers[1]};
  if (mesh.null_surface && (!mesh.block.empty() || emits))
    table.fail("null_surface", "a null surface lets everything pass: it can have no 'block' and no 'radiance'");
  if (!mesh.null_surface && mesh.block.empty() && !emits)
    table.fail({}, "a mesh needs block = \"...\" (its material), radiance = [r, g, b] or null_surface = true");
  if (mesh.checker_block.empty() != (mesh.checkers.x == 0))
    table.fail(mesh.checker_block.empty() ? "checkers" : "checker_block",
               "a checkerboard needs both checker_block = \"...\" and checkers = [u, v]");
}

}  // namespace

Result<TriangleMesh> read_mesh_file(const std::filesystem::path& path, MeshReport& report) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension != ".obj" && extension != ".ply")
    return input_error(fmt::format("{}: a mesh is an .obj or a .ply file", path.string()));
  TRY(const std::vector<uint8_t> bytes, read_file(path, kMostBytes));
  return extension == ".obj" ? read_obj(bytes, path.string(), report) : read_ply(bytes, path.string(), report);
}

MeshInstance read_mesh(TomlTable& table, VoxelPos offset, const std::filesystem::path& folder) {
  MeshInstance mesh;
  mesh.where = table.where();
  table.read("name", mesh.name);
  const bool named = table.require("file", mesh.file);
  read_transform(table, mesh, offset);
  read_material(table, mesh);
  if (!named) return mesh;
  std::filesystem::path path = mesh.file;
  if (mesh.name.empty()) mesh.name = path.stem().string();
  if (path.is_relative()) path = folder / path;
  MeshReport report;
  Result<TriangleMesh> triangles = read_mesh_file(path, report);
  if (!triangles.ok()) {
    table.fail("file", triangles.error().message);
    return mesh;
  }
  mesh.degenerate = report.degenerate;
  if (mesh.smooth && triangles->normals.empty())
    table.fail("smooth", mesh.file + " has no normals to shade smoothly with");
  if (!mesh.checker_block.empty() && triangles->texture_coordinates.empty())
    table.fail("checker_block", mesh.file + " has no texture coordinates for a checkerboard");
  mesh.mesh = std::make_shared<const TriangleMesh>(std::move(*triangles));
  return mesh;
}

}  // namespace world
