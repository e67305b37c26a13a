#include "world/formats/surfaces/geometry.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "world/formats/archive/budget.h"
#include "world/formats/collector.h"
#include "world/formats/surfaces/paint.h"
#include "world/sources/mesh/mesh_shape.h"
#include "world/sources/sampler.h"

namespace world {
namespace {

constexpr double kMostWork = 4e9;  // triangles asked about

/// (x, y, z) with z upwards -> (x, z, -y).
glm::dmat3 y_up_from_z_up() {
  glm::dmat3 m(0.0);
  m[0] = {1, 0, 0}, m[1] = {0, 0, -1}, m[2] = {0, 1, 0};
  return m;
}

Result<BlockId> white_block(World& world, const std::string& name) {
  Block block;
  block.name = name;
  block.albedo = {0.8f, 0.8f, 0.8f};
  return world.palette->add(block);
}

std::string text_of(const Vec3d& v) { return fmt::format("{:g} {:g} {:g}", v.x, v.y, v.z); }

Status check_size(const ShapeBox& bounds, double size, const std::string& name) {
  const double furthest = std::max(glm::length(bounds.min), glm::length(bounds.max)) / size;
  if (furthest < kWorldBorder / 2) return {};
  return input_error(
      fmt::format("{}: at {:g} m a voxel it reaches {:.3g} voxels from its origin, past the world's border; "
                  "give a larger --metres-per-voxel",
                  name, size, furthest));
}

/// Whether sampling ends in some seconds. A voxel near the surface is asked which triangles lie before it; where a few
/// damaged ones span the whole box, that is all of them for each voxel of the box.
Status check_work(const TriangleMesh& mesh, const ShapeBox& bounds, double size, const std::string& name) {
  const auto cells = [size](const Vec3d& extent) { return extent / size + 2.0; };
  const Vec3d whole = cells(bounds.max - bounds.min);
  double boxes = 0, across = 0;
  for (const glm::uvec3& t : mesh.triangles) {
    ShapeBox box;
    for (int k = 0; k < 3; ++k) box.include(Vec3d(mesh.positions[t[k]]));
    const Vec3d n = cells(box.max - box.min);
    boxes += n.x * n.y * n.z;
    across += n.y * n.z;
  }
  const double voxels = std::min(boxes, whole.x * whole.y * whole.z), depth = across / (whole.y * whole.z);
  if (voxels * std::max(1.0, depth) < kMostWork) return {};
  return input_error(
      fmt::format("{}: its triangles are so large and so many that sampling them does not end; the file may "
                  "be damaged, or give a larger --metres-per-voxel",
                  name));
}

Result<World> sampled_world(const Shape& shape, const std::string& block, const glm::dmat3& turn,
                            const Sampling& sampling, const std::string& name) {
  World world;
  TRY(const BlockId id, white_block(world, block));
  const Result<SamplingReport> sampled =
      sample_shape(world.store, shape, {.position = {}, .transform = turn}, sampling, id);
  if (!sampled) return Error{sampled.error().kind, name + ": " + sampled.error().message};
  return world;
}

}  // namespace

double voxel_size_for(const ShapeBox& bounds, const ImportOptions& options) {
  if (options.metres_per_voxel > 0) return options.metres_per_voxel;
  const Vec3d size = bounds.max - bounds.min;
  const double longest = std::max({size.x, size.y, size.z});
  if (!(longest > 0) || !std::isfinite(longest)) return 1;
  const double wanted = longest / 100, power = std::pow(10.0, std::floor(std::log10(wanted)));
  return wanted >= 5 * power ? 5 * power : wanted >= 2 * power ? 2 * power : power;
}

Result<World> world_from_mesh(const TriangleMesh& mesh, const MeshFileFacts& facts, const MeshReport& read,
                              const MeshColours& colours, std::span<const ColourPicture> textures,
                              const std::string& name, const std::string& stem, const ImportOptions& options,
                              ImportReport& report) {
  ShapeBox bounds;
  for (const Vec3f& p : mesh.positions) bounds.include(Vec3d(p));
  Sampling sampling{.voxel_size_m = voxel_size_for(bounds, options),
                    .supersampling = options.supersampling,
                    .coverage = options.coverage};
  TRY_STATUS(check_size(bounds, sampling.voxel_size_m, name));
  TRY_STATUS(check_work(mesh, bounds, sampling.voxel_size_m, name));
  MeshShapeReport shape_report;
  const auto shape =
      mesh_shape(mesh, {.shell = options.shell, .thickness = options.shell ? sampling.voxel_size_m : 0}, shape_report);
  const bool z_up = options.up == ImportOptions::Up::z;
  const glm::dmat3 turn = z_up ? y_up_from_z_up() : glm::dmat3(1.0);
  const std::string block = "mesh:" + stem;
  TRY(World world, sampled_world(*shape, block, turn, sampling, name));
  set_origin(world, "mesh", name, sampling.voxel_size_m);
  report.fact("voxel size", fmt::format("{:g}", sampling.voxel_size_m));
  report.fact("vertices", std::to_string(facts.vertices));
  report.fact("faces", std::to_string(facts.faces));
  report.fact("triangles", std::to_string(shape_report.triangles));
  report.fact("edges", std::to_string(shape_report.edges));
  report.fact("bounds", text_of(bounds.min) + " .. " + text_of(bounds.max));
  report.fact("filled as", options.shell ? "shell" : "solid");
  if (colours.any())
    TRY_STATUS(
        paint_mesh(world, *world.palette->find(block), mesh, colours, textures, turn, sampling.voxel_size_m, report));
  if (read.degenerate)
    report.warnings.push_back(fmt::format("{} triangles have no area and were left out", read.degenerate));
  if (shape_report.holes_closed)
    report.warnings.push_back(fmt::format("the surface has {} holes (border edges: {}), which were closed by fans",
                                          shape_report.holes_closed, shape_report.border_edges));
  if (shape_report.conflicts)
    report.warnings.push_back(
        fmt::format("at {} edges more than two faces meet, or two disagree on what is outside: an odd "
                    "number of crossings was taken for inside",
                    shape_report.conflicts));
  if (world.store.voxel_count() == 0)
    report.warnings.push_back(
        "no voxel's middle lies inside: give a smaller --metres-per-voxel, --coverage 0 or --shell");
  return world;
}

Result<World> world_from_points(const PointSet& points, uint64_t file_bytes, const std::string& name,
                                const std::string& stem, const ImportOptions& options, ImportReport& report) {
  ShapeBox bounds;
  Vec3d sum(0.0);
  for (const Vec3d& p : points.positions) bounds.include(p), sum += p;
  const double size = voxel_size_for(bounds, options);
  TRY_STATUS(check_size(bounds, size, name));
  const bool z_up = options.up != ImportOptions::Up::y;
  const std::string block = "points:" + stem;
  World world;
  if (options.point_radius_m > 0) {
    const Sampling sampling{.voxel_size_m = size, .supersampling = options.supersampling, .coverage = options.coverage};
    const auto shape = point_shape(points.positions, options.point_radius_m);
    TRY(world, sampled_world(*shape, block, z_up ? y_up_from_z_up() : glm::dmat3(1.0), sampling, name));
  } else {
    TRY(const BlockId id, white_block(world, block));
    MemoryBudget budget(file_bytes);
    (void)budget.take(file_bytes + points.positions.capacity() * sizeof(Vec3d));
    VoxelCollector collector(&budget);
    for (const Vec3d& p : points.positions) {
      const Vec3d f = glm::floor(p / size);
      const VoxelPos v{static_cast<int32_t>(f.x), static_cast<int32_t>(z_up ? f.z : f.y),
                       static_cast<int32_t>(z_up ? -f.y - 1 : f.z)};
      if (!collector.set(v, id))
        return input_error(
            fmt::format("{}: its points are scattered over more voxels than a file of its size may take; give "
                        "a larger --metres-per-voxel",
                        name));
    }
    collector.move_into(world.store);
  }
  set_origin(world, "points", name, size);
  report.fact("voxel size", fmt::format("{:g}", size));
  if (!points.colours.empty())
    TRY_STATUS(paint_points(world, *world.palette->find(block), points.positions, points.colours,
                            z_up ? y_up_from_z_up() : glm::dmat3(1.0), size, report));
  report.fact("points", std::to_string(points.positions.size() + points.not_finite));
  report.fact("finite", std::to_string(points.positions.size()));
  report.fact("centroid", text_of(sum / static_cast<double>(points.positions.size())));
  report.fact("bounds", text_of(bounds.min) + " .. " + text_of(bounds.max));
  return world;
}

}  // namespace world
