// Points as balls that overlap into a surface: splats.
//
//   kind = "points"
//   file = "scan.ply"          .ply or .pcd
//   radius_m                   of the balls; half the diagonal of a voxel where missing, so that each point fills at
//                              least the voxel it lies in
//
// source Hanspeter Pfister, Matthias Zwicker, Jeroen van Baar, Markus Gross. Surfels. 2000 (splats; ours are balls)
#include <cmath>

#include "world/meshes/points.h"
#include "world/sources/mesh/mesh_shape.h"
#include "world/sources/source.h"

namespace world {
namespace {

std::shared_ptr<const Shape> read_points(TomlTable& table, const SourceContext& context) {
  std::string file;
  double radius = 0.5 * std::sqrt(3.0) * context.voxel_m;
  table.read("radius_m", radius, {.min = 0, .max = 1e9, .open_min = true});
  if (!table.require("file", file)) return nullptr;
  std::filesystem::path path = file;
  if (path.is_relative()) path = context.folder / path;
  const Result<PointSet> points = read_point_file(path);
  if (!points) {
    table.fail("file", points.error().message);
    return nullptr;
  }
  return point_shape(points->positions, radius);
}

}  // namespace

SourceKind points_source() { return {.name = "points", .what = "points as overlapping balls", .read = read_points}; }

}  // namespace world
