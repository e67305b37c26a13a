// Stanford .ply, binary: vertices with colours, quads or triangles.

#include <fmt/format.h>

#include "render/export/export.h"

namespace render {
namespace {

world::Result<std::string> encode_smooth(const SmoothSurface& surface) {
  const bool normals = !surface.normals.empty();
  std::string out = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment Loam: a smooth surface of a world, in metres\nelement vertex {}\n"
      "property double x\nproperty double y\nproperty double z\n{}property uchar red\nproperty uchar green\n"
      "property uchar blue\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
      surface.mesh.vertices.size(), normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "",
      surface.mesh.triangles.size());
  out.reserve(out.size() + 39 * surface.mesh.vertices.size() + 13 * surface.mesh.triangles.size());
  for (size_t v = 0; v < surface.mesh.vertices.size(); ++v) {
    for (int axis = 0; axis < 3; ++axis) put(out, surface.mesh.vertices[v][axis] * surface.voxel_size_m);
    for (int axis = 0; normals && axis < 3; ++axis) put(out, surface.normals[v][axis]);
    for (const uint8_t band : display_colour((*surface.palette)[surface.blocks[v]])) put(out, band);
  }
  for (const glm::uvec3& t : surface.mesh.triangles) {
    put(out, uint8_t{3});
    for (int k = 0; k < 3; ++k) put(out, t[k]);
  }
  return out;
}

}  // namespace

SurfaceFormat ply_surface_format() {
  return {
      .name = "ply",
      .extension = ".ply",
      .what = "faces as quads with colours",
      .encode = [](const SurfaceMesh& surface) -> world::Result<std::string> {
        size_t quads = 0;
        std::vector<world::BlockId> block_of(surface.vertices.size());
        for (const BlockSurface& block : surface.blocks) {
          quads += block.quads.size();
          for (const auto& quad : block.quads)
            for (const uint32_t v : quad) block_of[v] = block.block;
        }
        std::string out = fmt::format(
            "ply\nformat binary_little_endian 1.0\ncomment Loam: the faces of a world, in metres\nelement vertex {}\n"
            "property double x\nproperty double y\nproperty double z\nproperty uchar red\nproperty uchar green\n"
            "property uchar blue\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
            surface.vertices.size(), quads);
        out.reserve(out.size() + 27 * surface.vertices.size() + 17 * quads);
        for (size_t v = 0; v < surface.vertices.size(); ++v) {
          const world::VoxelPos& p = surface.vertices[v];
          for (int axis = 0; axis < 3; ++axis) put(out, p[axis] * surface.voxel_size_m);
          for (const uint8_t band : display_colour((*surface.palette)[block_of[v]])) put(out, band);
        }
        for (const BlockSurface& block : surface.blocks) {
          for (const auto& quad : block.quads) {
            put(out, uint8_t{4});
            for (const uint32_t v : quad) put(out, v);
          }
        }
        return out;
      },
      .encode_smooth = encode_smooth};
}

}  // namespace render
