/// The surface of a world as a mesh in a file: .obj, .ply, .glb.
///
/// One file a format in render/export/; it lies here because the faces are those that are drawn (render/extract, merged
/// into rectangles). Faces between two opaque voxels, and of cavities that nothing can see, are not there unless kept.
/// Units are metres: the world's voxel_size_m a voxel.
#pragma once

#include <array>
#include <bit>
#include <filesystem>
#include <string>
#include <vector>

#include "render/extract/isosurface.h"
#include "world/world.h"

namespace render {

/// Rectangles of voxel faces, block by block.
struct BlockSurface {
  world::BlockId block = 0;
  std::vector<std::array<uint32_t, 4>> quads;  // vertices, counter-clockwise seen from outside
  std::vector<uint8_t> faces;                  // by quad: its direction, world::Face
};
struct SurfaceMesh {
  const world::BlockPalette* palette = nullptr;  // the world's, which must live as long
  std::vector<world::VoxelPos> vertices;         // corners of voxels, each once a block
  std::vector<BlockSurface> blocks;              // by id
  double voxel_size_m = 1;
};
/// `merged`: rectangles as large as they go; else a square a voxel face.
SurfaceMesh surface_of(const world::World& world, bool merged = true);

/// The isosurface of a world's level set or density.
struct SmoothSurface {
  const world::BlockPalette* palette = nullptr;  // the world's, which must live as long
  world::VoxelMesh mesh;
  std::vector<world::Vec3f> normals;   // by vertex; empty: faceted
  std::vector<world::BlockId> blocks;  // by vertex: what lies there
  double voxel_size_m = 1;
};
struct SmoothOptions {
  SurfaceMethod method = SurfaceMethod::marching_cubes;
  float iso = 0.5f;       // of a density: denser is inside; > 0
  double adaptivity = 0;  // of openvdb: 0..1
};
/// Fails where the world has neither a level set nor a density, or the surface lies nowhere.
world::Result<SmoothSurface> smooth_surface_of(const world::World& world, const SmoothOptions& options);

struct SurfaceFormat {
  std::string name;
  std::string extension;  // ".obj"
  std::string what;       // one line for help
  world::Result<std::string> (*encode)(const SurfaceMesh& surface);
  world::Result<std::string> (*encode_smooth)(const SmoothSurface& surface);
  bool materials = false;  // says that blocks shine or let light pass; else their colour is all that it holds
};
/// What of a world a file of this format doesn't hold beside what lies inside, a sentence each.
std::vector<std::string> surface_losses(const world::World& world, const SurfaceFormat& format);
/// One a file of render/export/, sorted by name.
const std::vector<SurfaceFormat>& surface_formats();
/// By extension; null where it is none of these.
const SurfaceFormat* surface_format_for(const std::filesystem::path& path);
/// Writes beside the target, syncs, and renames over it.
world::Status write_surface(const world::World& world, const SurfaceFormat& format, const std::filesystem::path& path);

world::Status write_smooth_surface(const world::World& world, const SmoothOptions& options, const SurfaceFormat& format,
                                   const std::filesystem::path& path);

/// Metres a voxel, as the world's metadata say; else 1.
double voxel_size_of(const world::World& world);
/// Triangles by the block of their first corner, sorted by block.
std::vector<std::pair<world::BlockId, std::vector<glm::uvec3>>> triangles_by_block(const SmoothSurface& surface);
/// The block's colour as displays want it: sRGB, 0..255. What emits without an albedo has the colour of its light.
std::array<uint8_t, 3> display_colour(const world::Block& block);

/// Appends the value's bytes, little-endian, as binary formats want them.
template <class T>
void put(std::string& out, T value) {
  static_assert(std::endian::native == std::endian::little);
  out.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

}  // namespace render
