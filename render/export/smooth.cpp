// Isosurfaces of a world for files.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>

#include "render/export/export.h"
#include "world/base/file.h"

namespace render {

namespace {

using world::BlockId;
using world::kAir;
using world::Vec3d;
using world::VoxelPos;

/// The block whose voxel holds the place, else the nearest of those around.
BlockId block_at(const world::Store& store, const Vec3d& place, BlockId otherwise) {
  const VoxelPos at{static_cast<int32_t>(std::floor(place.x)), static_cast<int32_t>(std::floor(place.y)),
                    static_cast<int32_t>(std::floor(place.z))};
  BlockId best = store.get(at);
  if (best != kAir) return best;
  best = otherwise;
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 27; ++i) {
    const VoxelPos near = at + VoxelPos{i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1};
    const double apart = glm::length(Vec3d(near.x, near.y, near.z) + 0.5 - place);
    if (apart >= nearest) continue;
    if (const BlockId block = store.get(near); block != kAir) best = block, nearest = apart;
  }
  return best;
}

float largest_value(const world::FloatLayer& layer) {
  float largest = 0;
  std::vector<float> values(world::kLeafVoxels);
  for (const world::LeafPos& l : layer.leaves()) {
    layer.read_cube(voxel_from_leaf(l), world::kLeafSize, 0, values);
    for (const float v : values) largest = std::max(largest, v);
  }
  return largest;
}

}  // namespace

world::Result<SmoothSurface> smooth_surface_of(const world::World& world, const SmoothOptions& options) {
  const std::unique_ptr<world::SurfaceField> field = world::surface_field(world.store, options.iso);
  if (!field)
    return world::input_error(
        "the world has no level set and no density to follow: leave --surface out to write the faces of its blocks");
  SmoothSurface surface;
  surface.palette = world.palette.get();
  surface.voxel_size_m = voxel_size_of(world);
  const world::SolidField solid(*field, &world.store.masks(world::MaskKind::occupied));
  TRY(surface.mesh, isosurface(solid, options.method, options.adaptivity));
  if (surface.mesh.triangles.empty()) {
    const world::FloatLayer* density = world.store.find_layer(world::Layer::density);
    if (field->fog() && density)
      return world::input_error(
          fmt::format("the density is nowhere above {:g}; its largest value is {:g}: give another "
                      "--iso",
                      options.iso, largest_value(*density)));
    return world::input_error("the level set passes 0 nowhere; there is no surface to write");
  }
  if (options.method != SurfaceMethod::blocks) surface.normals = vertex_normals(surface.mesh);
  const world::Census census = world.store.census();
  BlockId any = kAir;
  for (const auto& [id, count] : census) any = std::max(any, id);
  surface.blocks.reserve(surface.mesh.vertices.size());
  for (const Vec3d& v : surface.mesh.vertices) surface.blocks.push_back(block_at(world.store, v, any));
  return surface;
}

std::vector<std::pair<BlockId, std::vector<glm::uvec3>>> triangles_by_block(const SmoothSurface& surface) {
  std::map<BlockId, std::vector<glm::uvec3>> sorted;
  for (const glm::uvec3& t : surface.mesh.triangles) sorted[surface.blocks[t.x]].push_back(t);
  return {std::make_move_iterator(sorted.begin()), std::make_move_iterator(sorted.end())};
}

world::Status write_smooth_surface(const world::World& world, const SmoothOptions& options, const SurfaceFormat& format,
                                   const std::filesystem::path& path) {
  TRY(const SmoothSurface surface, smooth_surface_of(world, options));
  TRY(const std::string bytes, format.encode_smooth(surface));
  return world::write_bytes_atomically(path, bytes);
}

}  // namespace render
