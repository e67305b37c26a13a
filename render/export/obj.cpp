// Wavefront .obj: quads in a group a block, with `usemtl` for its name; each vertex with the colour of its block behind
// its coordinates (a common extension: v x y z r g b).
#include <iterator>

#include <fmt/format.h>

#include "render/export/export.h"

namespace render {

namespace {

world::Result<std::string> encode_smooth(const SmoothSurface& surface) {
  std::string text = "# Loam: a smooth surface of a world, in metres\n";
  auto out = std::back_inserter(text);
  for (size_t v = 0; v < surface.mesh.vertices.size(); ++v) {
    const world::Vec3d p = surface.mesh.vertices[v] * surface.voxel_size_m;
    const auto colour = display_colour((*surface.palette)[surface.blocks[v]]);
    fmt::format_to(out, "v {:.9g} {:.9g} {:.9g} {:.4g} {:.4g} {:.4g}\n", p.x, p.y, p.z, colour[0] / 255.0,
                   colour[1] / 255.0, colour[2] / 255.0);
  }
  for (const world::Vec3f& n : surface.normals) fmt::format_to(out, "vn {:.6g} {:.6g} {:.6g}\n", n.x, n.y, n.z);
  for (const auto& [block, triangles] : triangles_by_block(surface)) {
    const std::string& name = (*surface.palette)[block].name;
    fmt::format_to(out, "g {}\nusemtl {}\n", name, name);
    for (const glm::uvec3& t : triangles) {
      if (surface.normals.empty()) {
        fmt::format_to(out, "f {} {} {}\n", t.x + 1, t.y + 1, t.z + 1);
      } else {
        fmt::format_to(out, "f {0}//{0} {1}//{1} {2}//{2}\n", t.x + 1, t.y + 1, t.z + 1);
      }
    }
  }
  return text;
}

}  // namespace

SurfaceFormat obj_surface_format() {
  return {.name = "obj",
          .extension = ".obj",
          .what = "faces as quads with colours",
          .encode = [](const SurfaceMesh& surface) -> world::Result<std::string> {
            std::string text = "# Loam: the faces of a world, in metres\n";
            std::vector<world::BlockId> block_of(surface.vertices.size());
            for (const BlockSurface& block : surface.blocks)
              for (const auto& quad : block.quads)
                for (const uint32_t v : quad) block_of[v] = block.block;
            auto out = std::back_inserter(text);
            const double size = surface.voxel_size_m;
            for (size_t v = 0; v < surface.vertices.size(); ++v) {
              const world::VoxelPos& p = surface.vertices[v];
              const auto colour = display_colour((*surface.palette)[block_of[v]]);
              fmt::format_to(out, "v {:.9g} {:.9g} {:.9g} {:.4g} {:.4g} {:.4g}\n", p.x * size, p.y * size, p.z * size,
                             colour[0] / 255.0, colour[1] / 255.0, colour[2] / 255.0);
            }
            for (const BlockSurface& block : surface.blocks) {
              const std::string& name = (*surface.palette)[block.block].name;
              fmt::format_to(out, "g {}\nusemtl {}\n", name, name);
              for (const auto& q : block.quads)
                fmt::format_to(out, "f {} {} {} {}\n", q[0] + 1, q[1] + 1, q[2] + 1, q[3] + 1);
            }
            return text;
          },
          .encode_smooth = encode_smooth};
}

}  // namespace render
