/// Small meshes for tests: a ball, a sheet, how they are placed, and one of each kind over the hills.
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

/// The hills without glass and water, which hold light back from the ray caster's shadow rays alone.
inline world::World dry_hills(world::VoxelPos offset = {}) {
  world::World w = hills(offset);
  const world::BlockId water = block(w, "water"), glass = block(w, "glass");
  world::EditBatch batch;
  for (int x = -64; x < 64; ++x)
    for (int y = 0; y < 32; ++y)
      for (int z = -64; z < 64; ++z) {
        const world::VoxelPos at = offset + world::VoxelPos{x, y, z};
        const world::BlockId id = w.store.get(at);
        if (id == water || id == glass) batch.set(at, block(w, "sand"));
      }
  apply(w, batch);
  return w;
}

/// One of each kind over the hills: round and faceted, mirrored, checkered, seen from behind, glowing, and one that
/// only bounds a medium.
inline std::vector<world::MeshInstance> meshes_of_each_kind(const world::World& w, world::VoxelPos offset = {}) {
  std::vector<world::MeshInstance> all;
  world::MeshInstance smooth = instance(w, ball(5, 48), "brick_red", offset, {2.3, 30.4, 20.7});
  smooth.smooth = true;
  all.push_back(smooth);
  all.push_back(instance(w, ball(4, 10), "marble", offset, {-9.6, 26.1, 12.2},
                         glm::dmat3({1, 0.3, 0}, {0, 1.4, 0.2}, {0.1, 0, 0.8})));
  world::MeshInstance mirrored = instance(w, ball(4, 32), "gold_block", offset, {14.1, 25.2, 14.4},
                                          glm::dmat3({-1.1, 0, 0.2}, {0, 0.8, 0}, {0.3, 0, 1}));
  mirrored.smooth = true;
  all.push_back(mirrored);
  world::MeshInstance checkered =
      instance(w, sheet(7), "marble", offset, {-2.2, 22.4, 24.1}, glm::dmat3(1, 0.1, 0, 0, 1, 0.2, 0, 0, 1));
  checkered.checker_block = "obsidian", checkered.checker_id = block(w, "obsidian");
  checkered.checkers = {6, 9};
  all.push_back(checkered);
  all.push_back(
      instance(w, sheet(5), "grass", offset, {20.2, 38.1, 5.3}, glm::dmat3({1, 0.4, 0}, {0, -1, 0}, {0, 0.3, 1})));
  world::MeshInstance glowing =
      instance(w, sheet(2), "air", offset, {-14.5, 31.2, 20.6}, glm::dmat3({1, 0, 0}, {0, 0, 1}, {0, -1, 0}));
  glowing.block = "", glowing.radiance = {60, 40, 20};
  all.push_back(glowing);
  world::MeshInstance null = instance(w, ball(3, 16), "air", offset, {3.1, 26.2, 34.4});
  null.block = "", null.null_surface = true;
  all.push_back(null);
  return all;
}

inline Camera over_the_hills(world::VoxelPos offset = {}) {
  return camera_at(offset, {4.3, 36.2, 52.4}, {-0.07, -0.3, -1});
}

}  // namespace render
