/// Small meshes for tests: a ball, a sheet, and how they are placed.
#pragma once

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "tests/render/raster/small_worlds.h"
#include "world/meshes/builder.h"

namespace render {

inline std::shared_ptr<const world::TriangleMesh> ball(double radius, int steps) {
  std::vector<double> profile;
  for (int i = 0; i <= steps / 2; ++i) {
    const double angle = 3.14159265358979 * (2.0 * i / steps - 0.5);
    profile.insert(profile.end(), {i % (steps / 2) ? radius * std::cos(angle) : 0.0, radius * std::sin(angle)});
  }
  world::MeshReport report;
  auto mesh = world::revolved_mesh(profile, steps, "ball", report);
  CHECK(mesh.ok());
  return std::make_shared<const world::TriangleMesh>(std::move(*mesh));
}

/// A sheet of two triangles in the plane y = 0, its front up.
inline std::shared_ptr<const world::TriangleMesh> sheet(float half) {
  world::TriangleMesh mesh;
  mesh.positions = {{-half, 0, -half}, {-half, 0, half}, {half, 0, half}, {half, 0, -half}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.texture_coordinates = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
  return std::make_shared<const world::TriangleMesh>(std::move(mesh));
}

inline world::MeshInstance instance(const world::World& w, std::shared_ptr<const world::TriangleMesh> mesh,
                                    const char* material, world::VoxelPos offset, Vec3d at,
                                    glm::dmat3 transform = glm::dmat3(1)) {
  world::MeshInstance m;
  m.name = material;
  m.mesh = std::move(mesh);
  m.position = world::WorldPoint::from(at.x, at.y, at.z);
  m.position.voxel = m.position.voxel + offset;
  m.transform = transform;
  m.block = material;
  m.block_id = block(w, material);
  return m;
}

}  // namespace render
