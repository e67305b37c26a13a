// A triangle mesh from a file, or written out.
//
//   kind = "mesh"
//   file = "bunny.obj"         .obj or .ply
// or
//   vertices = 4, positions = [x, y, z, ...]
//   order = "list"             or "strip" or "fan": how `indices` list triangles, see world/meshes/topology.h
//   count = 12, indices = [...]
// and
//   fill = "solid"             what it encloses, holes closed by fans; or "shell"
//   thickness_m = 0            of a shell; 0: one voxel
#include "world/sources/mesh/mesh_shape.h"

#include <array>
#include <cmath>

#include "world/meshes/topology.h"
#include "world/sources/source.h"

namespace world {
namespace {

constexpr int32_t kMostInline = 1 << 20;

/// The mesh that the table writes out; empty where something is wrong.
TriangleMesh read_inline(TomlTable& table) {
  TriangleMesh mesh;
  int32_t vertices = 0, count = 0;
  const bool sized = table.require("vertices", vertices, NumberRange{3, kMostInline}),
             counted = table.require("count", count, NumberRange{3, kMostInline});
  int order = 0;
  constexpr std::array<std::string_view, 3> kOrders{"list", "strip", "fan"};
  table.read_choice("order", order, kOrders);
  if (!sized || !counted) return mesh;
  std::vector<float> numbers(3 * static_cast<size_t>(vertices));
  std::vector<int32_t> given(static_cast<size_t>(count));
  const bool placed = table.require("positions", std::span<float>(numbers), NumberRange{-1e9, 1e9}),
             listed = table.require("indices", std::span<int32_t>(given), NumberRange{0, vertices - 1.0});
  if (!placed || !listed) return mesh;
  for (size_t i = 0; i < numbers.size(); i += 3)
    mesh.positions.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  const std::vector<uint32_t> indices(given.begin(), given.end());
  mesh.triangles = order == 0   ? triangles_from_list(indices)
                   : order == 1 ? triangles_from_strip(indices)
                                : triangles_from_fan(indices);
  if (mesh.triangles.empty()) table.fail("indices", "'indices' list no triangle");
  return mesh;
}

std::shared_ptr<const Shape> read_mesh_source(TomlTable& table, const SourceContext& context) {
  int kind = 0;
  constexpr std::array<std::string_view, 2> kFills{"solid", "shell"};
  table.read_choice("fill", kind, kFills);
  MeshFill fill{.shell = kind == 1};
  table.read("thickness_m", fill.thickness, {.min = 0, .max = 1e9});
  if (fill.shell && fill.thickness == 0) fill.thickness = context.voxel_m;
  std::string file;
  MeshShapeReport report;
  if (!table.read("file", file)) {
    const TriangleMesh mesh = read_inline(table);
    return mesh.triangles.empty() ? nullptr : mesh_shape(mesh, fill, report);
  }
  std::filesystem::path path = file;
  if (path.is_relative()) path = context.folder / path;
  MeshReport read;
  const Result<TriangleMesh> mesh = read_mesh_file(path, read);
  if (!mesh) {
    table.fail("file", mesh.error().message);
    return nullptr;
  }
  return mesh_shape(*mesh, fill, report);
}

}  // namespace

SourceKind mesh_source() {
  return {.name = "mesh", .what = "a triangle mesh, filled or as a shell", .read = read_mesh_source};
}

}  // namespace world
