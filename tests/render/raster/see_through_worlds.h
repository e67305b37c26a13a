/// Small worlds of what is seen through: panes, a hall under coloured glass, a basin of liquids that aren't full.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <string>
#include <vector>

#include "tests/render/raster/small_worlds.h"
#include "world/proxies/proxy.h"

namespace render {

/// Panes of glass, one voxel thick and one apart, before a wall of stone.
inline world::World panes(int count, std::initializer_list<const char*> kinds) {
  world::World w(world::standard_blocks());
  world::Block lace;
  lace.name = "lace", lace.bsdf = "coverage", lace.coverage = 0.4f;
  lace.albedo = {0.7f, 0.3f, 0.5f}, lace.opaque = false;
  CHECK(w.palette->add(lace).ok());
  world::EditBatch batch;
  for (int i = 0; i < count; ++i)
    batch.fill({{-12, -12, -4 - 2 * i}, {12, 12, -4 - 2 * i}},
               block(w, kinds.begin()[static_cast<size_t>(i) % kinds.size()]));
  batch.fill({{-64, -64, -8 - 2 * count}, {64, 64, -6 - 2 * count}}, block(w, "plaster"));
  apply(w, batch);
  return w;
}

inline world::Luminaire lamp_at(world::WorldPoint position, float power_w) {
  world::Luminaire lamp;
  lamp.name = lamp.kind = "omni";
  lamp.position = position;
  lamp.power = {power_w, 0.9f * power_w, 0.6f * power_w};
  return lamp;
}

inline world::Medium fog_box(world::Vec3f half_extent) {
  world::Medium fog;
  fog.name = fog.kind = "box_fog";
  fog.absorption = {0.04f, 0.06f, 0.09f};
  fog.emission = {20, 25, 35};
  fog.position = world::WorldPoint::from(0, 0, -6);
  fog.half_extent = half_extent;
  return fog;
}

inline world::BlockId see_through_block(world::World& w, const char* name, const char* bsdf, bool thin) {
  world::Block block;
  block.name = name, block.bsdf = bsdf, block.opaque = false;
  block.albedo = {0.2f, 0.1f, 0.1f};
  if (thin)
    block.transmission = {0.5f, 0.4f, 0.1f};
  else
    block.coverage = 0.4f;
  auto id = w.palette->add(block);
  CHECK(id.ok());
  return *id;
}

/// A floor under panes of coloured glass, a sheet, a screen with holes and a pool; fences, plants and stairs on it.
inline world::World window_hall() {
  world::World w(world::standard_blocks());
  w.environment.sun_direction = glm::normalize(Vec3d(0.35, 1, 0.2));
  world::EditBatch batch;
  batch.fill({{-40, 0, -40}, {40, 3, 40}}, block(w, "plaster"));
  const char* panes[] = {"glass_red", "glass_green", "glass_yellow", "glass_cyan"};
  for (int i = 0; i < 4; ++i) batch.fill({{-20 + 8 * i, 12 + i, -10}, {-14 + 8 * i, 12 + i, -2}}, block(w, panes[i]));
  batch.fill({{-20, 20, 0}, {-13, 20, 6}}, see_through_block(w, "stained_sheet", "thin", true));
  batch.fill({{-10, 20, 0}, {-3, 20, 6}}, see_through_block(w, "screen", "coverage", false));
  batch.fill({{0, 20, 0}, {2, 20, 2}},
             see_through_block(w, "dull", "lambert", false));  // neither opaque nor seen through
  batch.fill({{4, 1, 0}, {14, 3, 8}}, block(w, "water"));
  batch.fill({{-10, 10, -16}, {-6, 14, -16}}, block(w, "glass_red"));  // upright, two kinds deep
  batch.fill({{-10, 10, -17}, {-6, 14, -17}}, block(w, "glass_cyan"));
  int x = -24;
  for (const world::Proxy& proxy : world::proxies()) {
    world::Block shaped;
    shaped.name = "shaped_" + proxy.name, shaped.proxy = proxy.name, shaped.opaque = false;
    shaped.albedo = {0.5f, 0.5f, 0.4f};
    const auto id = w.palette->add(shaped);
    CHECK(id.ok());
    batch.set({x, 4, 14}, *id);
    batch.set({x, 4, 15}, *id);
    batch.set({x, 8, 18}, *id);  // in the air, above its shadow
    ++x;
  }
  apply(w, batch);
  return w;
}

inline const std::vector<NamedCamera>& hall_cameras() {
  static const std::vector<NamedCamera> cameras = {
      {"over the panes", camera_at({}, {-2.3, 30.2, -40.7}, {0.1, -0.8, 1})},
      {"the shapes", camera_at({}, {-8.4, 11.2, 30.3}, {0.1, -0.6, -1})},
      {"the pool", camera_at({}, {9.1, 9.3, 16.2}, {-0.03, -0.5, -0.6})},
      {"down", camera_at({}, {-6.3, 60.1, -3.2}, {0.01, -1, 0.02})}};
  return cameras;
}

/// A basin of 24 x 24 m: water that slopes down from a full voxel to a film, with a film of oil beyond it; a waterfall
/// from a ledge; lava that slopes across; panes and posts that stand in them.
inline world::World spill(world::VoxelPos at = {}) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill(box_at(at, {-1, -2, -1}, {24, 3, 24}), block(w, "stone"));
  batch.fill(box_at(at, {0, 0, 0}, {23, 3, 23}), world::kAir);
  batch.fill(box_at(at, {0, 0, 0}, {11, 0, 23}), block(w, "water"));
  batch.fill(box_at(at, {12, 0, 0}, {15, 0, 11}), block(w, "oil"));
  batch.fill(box_at(at, {16, 0, 0}, {23, 0, 23}), block(w, "lava"));
  batch.fill(box_at(at, {12, 0, 12}, {15, 2, 23}), block(w, "brick_red"));  // a wall, and the ledge
  batch.fill(box_at(at, {0, 0, 20}, {11, 2, 23}), block(w, "brick_red"));
  batch.fill(box_at(at, {3, 3, 19}, {5, 3, 23}), block(w, "water"));  // along the ledge and over it
  batch.fill(box_at(at, {3, 1, 19}, {5, 2, 19}), block(w, "water"));
  batch.fill(box_at(at, {8, 0, 4}, {8, 2, 7}), block(w, "glass"));
  batch.fill(box_at(at, {20, 0, 6}, {20, 2, 6}), block(w, "marble"));
  batch.set(at + world::VoxelPos{6, 0, 12}, block(w, "fence_oak"));
  apply(w, batch);
  world::IntLayer& amounts = w.store.make_int_layer(world::Layer::liquid);
  for (int x = 0; x < 24; ++x)
    for (int z = 0; z < 24; ++z) {
      if (x < 12 && z < 20) amounts.set(at + world::VoxelPos{x, 0, z}, std::max(4096 - 350 * x, 40));
      if (x >= 12 && x < 16 && z < 12) amounts.set(at + world::VoxelPos{x, 0, z}, 60);
      if (x >= 16) amounts.set(at + world::VoxelPos{x, 0, z}, std::max(4000 - 170 * z, 100));
    }
  for (int x = 3; x < 6; ++x)
    for (int z = 19; z < 24; ++z) amounts.set(at + world::VoxelPos{x, 3, z}, 900);
  return w;
}

inline std::vector<NamedCamera> spill_cameras(world::VoxelPos at = {}) {
  return {{"overview", camera_at(at, {-4.3, 9.2, -6.7}, {0.7, -0.5, 0.8})},
          {"along the water", camera_at(at, {10.4, 1.13, 1.6}, {-0.5, -0.08, 1})},
          {"over a film", camera_at(at, {11.3, 0.42, 3.2}, {-1, -0.02, 0.35})},
          {"before the fall", camera_at(at, {4.6, 1.9, 11.3}, {0.03, -0.1, 1})},
          {"over lava", camera_at(at, {19.7, 1.4, 22.2}, {0.1, -0.3, -1})},
          {"in the film's voxel above it", camera_at(at, {9.5, 0.61, 8.4}, {-0.8, -0.1, 0.6})},
          {"under water", camera_at(at, {0.6, 0.35, 6.4}, {0.9, 0.15, 0.4})},
          {"straight down", camera_at(at, {12.5, 21.3, 12.1}, {0, -1, 0}, 70)}};
}

}  // namespace render
