/// Triangles that a picture has beside the faces of voxels, on the device: drawn by meshes_pass.h, and walked by rays
/// to lights (shading/mesh_rays.glsl.h). One buffer of texels, as raster.shared.h lays it out; corners are a voxel and
/// a place in it, so that a picture doesn't depend on the distance from the origin.
///
/// cost   48 bytes a vertex, 16 a triangle, some 20 of its tree; made anew where the list changes
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "render/camera.h"
#include "render/extract/isosurface.h"
#include "render/gpu/owned.h"
#include "render/raster/raster.shared.h"
#include "render/raster/triangle_tree.h"
#include "world/world.h"

namespace render::raster {

/// What they look like before they are laid out for the device.
struct TriangleList {
  struct Vertex {
    world::WorldPoint position;
    glm::vec3 normal{0};    // shaded with, of any length; 0: the triangle's own
    glm::vec2 checkers{0};  // squares of a checkerboard
  };
  struct Material {
    world::BlockId block = world::kAir, second = world::kAir;  // of the even squares, of the others
    glm::vec3 emitted{0};                                      // W/(m^2 sr), of the front side
    bool smooth = false;  // of a level set: glows as its block, and throws no shadow on itself by its corners
  };
  struct Triangle {
    std::array<uint32_t, 3> corners;  // counter-clockwise seen from the front
    uint32_t material;
  };
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
  std::vector<Material> materials;
};

/// Appends the meshes of a world that are seen: all but null surfaces. What has no area is left out. Fails where one
/// reaches outside the world.
world::Status add_meshes(const world::World& world, TriangleList& list);

/// Appends the surface of a world's level set, or of its density at `iso` where that is above 0, in the blocks that it
/// is made of. Nothing where the world has neither.
world::Status add_smooth_surface(const world::WorldView& view, SurfaceMethod method, float iso, TriangleList& list);

class DrawnTriangles {
 public:
  /// Returns the bytes sent. Where they are more than the device holds in a buffer, there are none, and dropped() says
  /// so.
  world::Result<uint64_t> set(gpu::Device& device, const TriangleList& list, const std::string& what);
  void clear();

  bool empty() const { return tree_.nodes.empty(); }
  uint64_t size() const { return tree_.order.size(); }
  /// Differs between any two lists that were set.
  uint64_t version() const { return version_; }
  uint64_t bytes() const { return bytes_; }
  const gpu::Buffer& texels() const { return texels_; }
  const std::vector<std::string>& dropped() const { return dropped_; }

  struct Run {
    uint32_t first, count;
  };
  /// Runs of triangles that may lie in the picture.
  void cull(const Camera& camera, const PixelRays& rays, double view_distance, std::vector<Run>& out) const;
  /// How far the nearest is, at least; `most` where none is nearer than that, m.
  double distance(const world::WorldPoint& from, double most) const;
  void describe(PictureConstants& picture) const;
  /// Leaves of these regions whose light shading may ask for: all within a metre of a triangle, and some more. Sorted.
  std::vector<world::LeafPos> leaves_around(std::span<const world::RegionPos> regions) const;
  /// Bytes that the buffer may have, at most the device's limit; tests lower it.
  uint64_t binding_limit = ~uint64_t{0};

 private:
  world::VoxelPos base_;  // boxes of the tree are relative to it
  float reach_ = 0;       // the largest coordinate of a box
  TriangleTree tree_;
  std::vector<std::array<glm::vec3, 3>> corners_;                   // in the tree's order, relative to the base
  uint32_t triangles_at_ = 0, vertices_at_ = 0, materials_at_ = 0;  // texels
  uint64_t bytes_ = 0, version_ = 0;
  gpu::Buffer texels_;
  std::vector<std::string> dropped_;
};

}  // namespace render::raster
