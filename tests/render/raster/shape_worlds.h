/// Small worlds of blocks with a shape of their own: every shape in a garden; a row of some before a mirror, beyond a
/// pool and in it, with bodies.
#pragma once

#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "render/backend.h"
#include "tests/render/raster/small_worlds.h"
#include "world/proxies/proxy.h"

namespace render {

/// Every shape twice on a floor of stone, beside each other and beside walls; a garden of plants, a fence round it.
inline world::World garden(world::VoxelPos offset = {}) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  batch.fill(box_at(offset, {-20, -1, -20}, {30, -1, 20}), block(w, "stone"));
  int x = 0;
  for (const world::Proxy& proxy : world::proxies()) {
    const float shade = 0.2f + 0.008f * static_cast<float>(x);
    const world::BlockId id = shaped(w, proxy.name, {shade, 0.5f, 0.8f - shade});
    const int column = x % 12 * 2, row = x / 12 * 3;
    batch.set(offset + world::VoxelPos{column, 0, row}, id);
    batch.set(offset + world::VoxelPos{column + 1, 0, row}, id);
    if (x % 3 == 0) batch.set(offset + world::VoxelPos{column, 0, row + 1}, block(w, "brick_red"));
    if (x % 4 == 0) batch.set(offset + world::VoxelPos{column, 1, row}, block(w, "glass"));
    ++x;
  }
  const char* plants[] = {"flower_red", "reed", "tall_grass", "fern", "torch"};
  for (int i = 0; i < 120; ++i) {
    const uint64_t h = world::mix64(static_cast<uint64_t>(i + 5));
    batch.set(offset + world::VoxelPos{static_cast<int>(h % 14) - 16, 0, static_cast<int>(h / 14 % 24) - 12},
              block(w, plants[h / 1000 % 5]));
  }
  apply(w, batch);
  return w;
}

inline std::vector<NamedCamera> garden_cameras(world::VoxelPos offset = {}) {
  return {{"along", camera_at(offset, {-3.3, 2.1, -4.2}, {0.7, -0.3, 0.6})},
          {"above", camera_at(offset, {8.4, 9.2, 6.3}, {0.1, -1, 0.3})},
          {"in the plants", camera_at(offset, {-9.4, 0.6, 0.3}, {1, -0.1, 0.2})}};
}

/// A row of things along x: a torch, a fence of three, a flower, stairs, a slab, a pane of two, a ladder.
inline void set_row(world::World& w, world::EditBatch& batch, world::VoxelPos first) {
  const std::vector<std::pair<int, world::BlockId>> row = {{0, block(w, "torch")},
                                                           {2, block(w, "shaped_fence")},
                                                           {3, block(w, "shaped_fence")},
                                                           {4, block(w, "shaped_fence")},
                                                           {6, block(w, "flower_red")},
                                                           {8, block(w, "shaped_stairs_south_bottom")},
                                                           {10, block(w, "shaped_slab_bottom")},
                                                           {12, block(w, "shaped_pane")},
                                                           {13, block(w, "shaped_pane")},
                                                           {15, block(w, "shaped_ladder_north")}};
  for (const auto& [x, id] : row) batch.set(first + world::VoxelPos{x, 0, 0}, id);
}

inline void set_rows(world::World& w, std::initializer_list<world::VoxelPos> rows) {
  world::EditBatch batch;
  for (const world::VoxelPos& first : rows) set_row(w, batch, first);
  apply(w, batch);
}

inline world::World ground() {
  world::World w(world::standard_blocks());
  for (const char* proxy : {"fence", "stairs_south_bottom", "slab_bottom", "pane", "ladder_north"})
    shaped(w, proxy, {0.6f, 0.35f, 0.2f});
  world::EditBatch batch;
  batch.fill({{-24, -4, -20}, {24, -1, 20}}, block(w, "plaster"));
  apply(w, batch);
  return w;
}
/// A wall of mercury.
inline world::World mirror() {
  world::World w = ground();
  world::EditBatch batch;
  batch.fill({{-10, 0, -16}, {10, 7, -16}}, block(w, "mercury"));
  apply(w, batch);
  return w;
}
inline void fill_pool(world::World& w, const char* liquid) {
  world::EditBatch batch;
  batch.fill({{-10, -3, -8}, {10, -1, 4}}, block(w, liquid));
  apply(w, batch);
}
inline world::World pool() {
  world::World w = ground();
  fill_pool(w, "water");
  return w;
}
inline constexpr world::VoxelPos kBeforeTheMirror{-8, 0, -13}, kBeyondThePool{-8, 0, -9}, kUnderWater{-8, -3, -2};

/// Before the mirror, above the pool, on its bottom, and half in it.
inline const std::vector<BodyRecord> kBodies = {{-3.5f, 1.2f, -13.4f, 0.4f, 0.9f, 0.4f, {0.2f, 0.5f, 0.7f}},
                                                {3.5f, 1.6f, -6.4f, 0.6f, 0.5f, 0.6f, {0.7f, 0.2f, 0.3f}},
                                                {-4.3f, -2.2f, 1.4f, 0.7f, 0.7f, 0.7f, {0.2f, 0.7f, 0.2f}},
                                                {5.2f, 0.1f, 0.3f, 0.5f, 0.8f, 0.5f, {0.6f, 0.6f, 0.1f}}};

inline const std::vector<NamedCamera> kMirrorViews = {
    {"in the mirror", camera_at({}, {-1.3, 3.2, -8.4}, {0.05, -0.1, -1}, 80)},
    {"along the mirror", camera_at({}, {8.4, 2.3, -10.2}, {-1, -0.15, -0.35}, 70)}};
inline const std::vector<NamedCamera> kPoolViews = {
    {"over the pool", camera_at({}, {0.4, 5.2, 12.3}, {0.02, -0.5, -1}, 70)},
    {"into the pool", camera_at({}, {-3.4, 7.3, 2.2}, {0.1, -1, -0.4}, 70)},
    {"along the water", camera_at({}, {1.2, 0.7, 9.3}, {-0.05, -0.12, -1}, 60)}};

}  // namespace render
