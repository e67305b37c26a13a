#include "world/meshes/mesh.h"

#include <cctype>
#include <cmath>
#include <optional>

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

/// The triangles of whichever key says the shape; none where what is wrong has been noted.
std::optional<Result<TriangleMesh>> read_shape(TomlTable& table, MeshInstance& mesh,
                                               const std::filesystem::path& folder, MeshReport& report) {
  const NumberRange length{-1e6, 1e6};
  std::vector<double> quads, profile;
  int32_t steps = 96;
  const bool named = table.read("file", mesh.file), flat = table.read("quads", quads, length),
             round = table.read("revolve", profile, length);
  const bool stepped = table.read("steps", steps, {3, 4096});
  const int keys = table.has("file") + table.has("quads") + table.has("revolve");
  if (keys != 1) {
    table.fail({}, "a mesh needs one of file = \"...\", quads = [x, y, z, ...] and revolve = [r, y, ...]");
    return std::nullopt;
  }
  if (stepped && !round) table.fail("steps", "'steps' needs 'revolve'");
  if (named) {
    std::filesystem::path path = mesh.file;
    if (mesh.name.empty()) mesh.name = path.stem().string();
    return read_mesh_file(path.is_relative() ? folder / path : path, report);
  }
  if (flat) {
    if (mesh.name.empty()) mesh.name = "quads";
    if (!quads.empty() && quads.size() % 12 == 0) return quads_mesh(quads, mesh.name, report);
    table.fail("quads",
               fmt::format("'quads' has {} numbers, but must have 12 for each quad, at least one", quads.size()));
  }
  if (round) {
    if (mesh.name.empty()) mesh.name = "revolve";
    bool fine = profile.size() >= 4 && profile.size() % 2 == 0;
    if (!fine)
      table.fail("revolve", fmt::format("'revolve' has {} numbers, but must have two for each of at least two points",
                                        profile.size()));
    for (size_t i = 0; fine && i < profile.size(); i += 2) {
      if (profile[i] >= 0) continue;
      table.fail("revolve", fmt::format("'revolve[{}]' is {}, but a radius must be at least 0", i, profile[i]));
      fine = false;
    }
    if (fine) return revolved_mesh(profile, steps, mesh.name, report);
  }
  return std::nullopt;
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
  MeshReport report;
  std::optional<Result<TriangleMesh>> triangles = read_shape(table, mesh, folder, report);
  read_placement(table, offset, "mesh", mesh.position, mesh.transform);
  read_material(table, mesh);
  if (!triangles) return mesh;
  const std::string shape = !mesh.file.empty() ? mesh.file : table.has("quads") ? "a mesh of quads" : "revolve";
  if (!triangles->ok()) {
    // A file's own message names the file.
    table.fail(!mesh.file.empty() ? "file" : table.has("quads") ? "quads" : "revolve", triangles->error().message);
    return mesh;
  }
  mesh.degenerate = report.degenerate;
  if (mesh.smooth && (*triangles)->normals.empty())
    table.fail("smooth", shape + " has no normals to shade smoothly with");
  if (!mesh.checker_block.empty() && (*triangles)->texture_coordinates.empty())
    table.fail("checker_block", shape + " has no texture coordinates for a checkerboard");
  mesh.mesh = std::make_shared<const TriangleMesh>(std::move(**triangles));
  return mesh;
}

}  // namespace world
