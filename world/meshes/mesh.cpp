#include "world/meshes/mesh.h"

#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include "world/base/file.h"
#include "world/meshes/builder.h"
#include "world/meshes/placement.h"

namespace world {
namespace {

constexpr uint64_t kMostBytes = uint64_t{1} << 31;
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
  read_placement(table, offset, "mesh", mesh.position, mesh.transform);
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
