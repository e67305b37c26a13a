/// Small worlds that show a rasterizer its hard places: edges of every kind, thin things, water and glass, caves,
/// distant detail. The same at any offset.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "render/camera.h"
#include "world/base/random.h"
#include "world/world.h"

namespace render {

inline world::BlockId block(const world::World& w, const char* name) {
  const auto id = w.palette->find(name);
  CHECK(id.has_value());
  return *id;
}

/// A block of the shape, not opaque.
inline world::BlockId shaped(world::World& w, const std::string& proxy, world::Ratio3 albedo) {
  world::Block block;
  block.name = "shaped_" + proxy;
  block.albedo = albedo;
  block.opaque = false;
  block.proxy = proxy;
  auto id = w.palette->add(block);
  CHECK(id.ok());
  return *id;
}

inline world::VoxelBox box_at(world::VoxelPos offset, world::VoxelPos low, world::VoxelPos high) {
  return {offset + low, offset + high};
}

inline void apply(world::World& w, const world::EditBatch& batch) { CHECK(w.store.apply(batch).ok()); }

/// Rolling ground of 128 x 128 voxels in two materials, a lake, posts, a floating slab, a glass wall, a tunnel.
inline world::World hills(world::VoxelPos offset = {}) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  const world::BlockId stone = block(w, "stone"), grass = block(w, "grass"), sand = block(w, "sand");
  for (int x = -64; x < 64; ++x)
    for (int z = -64; z < 64; ++z) {
      const int top = static_cast<int>(12 + 7 * std::sin(x * 0.11) + 6 * std::cos(z * 0.13 + x * 0.02));
      batch.fill(box_at(offset, {x, 0, z}, {x, top - 1, z}), stone);
      batch.set(offset + world::VoxelPos{x, top, z}, (x ^ z) & 1 ? grass : sand);
      if (top < 8) batch.fill(box_at(offset, {x, top + 1, z}, {x, 8, z}), block(w, "water"));
      if (world::mix64(static_cast<uint64_t>(x * 1000 + z + 100000)) % 97 == 0)
        batch.fill(box_at(offset, {x, top + 1, z}, {x, top + 5, z}), block(w, "oak_log"));
    }
  batch.fill(box_at(offset, {-10, 30, -40}, {20, 30, -20}), block(w, "brick_red"));
  batch.fill(box_at(offset, {-30, 10, 10}, {-30, 25, 40}), block(w, "glass"));
  batch.set(offset + world::VoxelPos{30, 24, -30}, block(w, "lamp_warm"));
  batch.fill(box_at(offset, {-64, 4, 5}, {63, 6, 7}), world::kAir);
  apply(w, batch);
  return w;
}

/// One voxel in twenty of a cube of 64, in many materials: edges everywhere.
inline world::World dust(world::VoxelPos offset = {}) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  for (int x = 0; x < 64; ++x)
    for (int y = 0; y < 64; ++y)
      for (int z = 0; z < 64; ++z) {
        const uint64_t h = world::mix64(static_cast<uint64_t>((x * 64 + y) * 64 + z) + 77);
        if (h % 20 == 0)
          batch.set(offset + world::VoxelPos{x - 32, y - 32, z - 32},
                    static_cast<world::BlockId>(1 + (h >> 20) % (w.palette->size() - 1)));
      }
  apply(w, batch);
  return w;
}

/// A closed room of 12 x 6 x 12 with a lamp and a pillar, walls one voxel thick.
inline world::World room(world::VoxelPos offset = {}) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill(box_at(offset, {-1, -1, -1}, {12, 6, 12}), block(w, "plaster"));
  batch.fill(box_at(offset, {0, -1, 0}, {11, -1, 11}), block(w, "oak_planks"));
  batch.fill(box_at(offset, {0, 0, 0}, {11, 5, 11}), world::kAir);
  batch.fill(box_at(offset, {4, 0, 4}, {4, 5, 4}), block(w, "marble"));
  batch.set(offset + world::VoxelPos{8, 5, 8}, block(w, "lamp_white"));
  apply(w, batch);
  return w;
}

inline Camera camera_at(world::VoxelPos offset, Vec3d position, Vec3d look_along, double fov_deg = 60) {
  Camera camera;
  camera.position = world::WorldPoint::from(position.x, position.y, position.z);
  camera.position.voxel = camera.position.voxel + offset;
  camera.forward = glm::normalize(look_along);
  camera.vertical_fov = fov_deg * 3.14159265358979323846 / 180;
  return camera;
}

struct NamedCamera {
  std::string name;
  Camera camera;
};

inline std::vector<NamedCamera> hill_cameras(world::VoxelPos offset = {}) {
  return {{"overview", camera_at(offset, {-70.3, 60.2, 80.7}, {0.6, -0.45, -0.7})},
          {"eye level", camera_at(offset, {2.37, 27.6, 50.11}, {0.1, -0.2, -1})},
          {"along the ground", camera_at(offset, {-60.21, 24.73, -3.4}, {1, -0.08, 0.05})},
          {"in the tunnel", camera_at(offset, {-20.5, 5.5, 6.4}, {1, 0.02, 0.03}, 75)},
          {"straight down", camera_at(offset, {5.5, 70.25, 3.125}, {0, -1, 0})}};
}

}  // namespace render
