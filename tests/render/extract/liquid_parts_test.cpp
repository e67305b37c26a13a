/// Faces of liquids that let no light through and end within their voxels, against a count sixteenth by sixteenth.
#include "render/extract/liquid_parts.h"

#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "render/extract/extractor.h"
#include "world/base/random.h"

namespace render {
namespace {

using namespace world;

/// Voxel, direction, block, sixteenth of a side (of a top or bottom: where it lies).
using Part = std::tuple<int, int, int, int, BlockId, uint32_t>;
constexpr VoxelBox kBox{{-12, -10, 50}, {14, 12, 76}};  // over chunk seams on each axis

std::set<Part> listed(const Extractor& extractor) {
  std::set<Part> all;
  for (const ExtractedChunk* chunk : extractor.chunks())
    for (const FaceRecord& r : chunk->records) {
      const int face = static_cast<int>(face_direction(r.word1)), axis = face >> 1;
      const int u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
      const uint32_t width = part_in_width(r.word0, r.word1) ? 1 : face_width(r.word0);
      const uint32_t height = part_in_height(r.word0, r.word1) ? 1 : face_height(r.word0);
      const uint32_t top = part_top(opaque_part_upper(r.word1)), bottom = part_bottom(r.word0, r.word1);
      const glm::uvec3 first = face_voxel(r.word0);
      for (uint32_t i = 0; i < width; ++i)
        for (uint32_t k = 0; k < height; ++k) {
          VoxelPos at =
              chunk->origin + VoxelPos{static_cast<int>(first.x), static_cast<int>(first.y), static_cast<int>(first.z)};
          at[u] += static_cast<int>(i), at[v] += static_cast<int>(k);
          const auto block = static_cast<BlockId>(face_block(r.word1));
          if (axis == 1) {
            EXPECT_TRUE(all.insert({at.x, at.y, at.z, face, block, face == kFacePosY ? top : 0}).second);
            continue;
          }
          for (uint32_t s = bottom; s < top; ++s)
            EXPECT_TRUE(all.insert({at.x, at.y, at.z, face, block, s}).second) << "a part is covered twice";
        }
    }
  return all;
}

std::set<Part> expected(const World& w, const LiquidLevels& levels) {
  const SeeThroughKinds kinds(*w.palette);
  std::set<Part> all;
  const auto opaque = [&](VoxelPos v) { return (*w.palette)[w.store.get(v)].opaque; };
  for (int x = kBox.min.x; x <= kBox.max.x; ++x)
    for (int y = kBox.min.y; y <= kBox.max.y; ++y)
      for (int z = kBox.min.z; z <= kBox.max.z; ++z) {
        const VoxelPos v{x, y, z};
        const BlockId own = w.store.get(v);
        if (own == kAir || kinds.contains(own)) continue;
        const auto level = static_cast<uint32_t>(levels.at(v));
        for (int f = 0; f < kFaces; ++f) {
          const VoxelPos there = v + face_step(f);
          // A cube's side is one face, however much of it a liquid beside it hides.
          const uint32_t hides = !opaque(there)              ? 0
                                 : levels.at(there) == 16    ? 16
                                 : level < 16 && f >> 1 != 1 ? static_cast<uint32_t>(levels.at(there))
                                                             : 0;
          if (f == kFacePosY) {
            if (level < 16 || hides < 16) all.insert({x, y, z, f, own, level});
          } else if (f == kFaceNegY) {
            if (hides < 16) all.insert({x, y, z, f, own, 0});
          } else {
            for (uint32_t s = hides; s < level; ++s) all.insert({x, y, z, f, own, s});
          }
        }
      }
  return all;
}

World random_world(uint64_t seed) {
  World w(standard_blocks());
  const auto id = [&](const char* name) { return *w.palette->find(name); };
  const BlockId blocks[] = {kAir, id("lava"), id("lava"), id("stone"), id("water"), id("mercury")};
  EditBatch batch;
  for (int x = kBox.min.x; x <= kBox.max.x; ++x)
    for (int y = kBox.min.y; y <= kBox.max.y; ++y)
      for (int z = kBox.min.z; z <= kBox.max.z; ++z) {
        const uint64_t h = mix64(seed ^ static_cast<uint64_t>(((x + 64) * 128 + y + 64) * 128 + z));
        if (h % 3) batch.set({x, y, z}, blocks[(h >> 20) % 6]);
      }
  CHECK(w.store.apply(batch).ok());
  return w;
}

void pour(World& w, uint64_t seed, int some) {
  IntLayer& amounts = w.store.make_int_layer(Layer::liquid);
  for (int i = 0; i < some; ++i) {
    const uint64_t h = mix64(seed * 100'000 + static_cast<uint64_t>(i));
    amounts.set({kBox.min.x + static_cast<int>(h % 27), kBox.min.y + static_cast<int>((h >> 8) % 23),
                 kBox.min.z + static_cast<int>((h >> 16) % 27)},
                static_cast<int32_t>(1 + (h >> 32) % 4096));
  }
}

TEST(LiquidParts, StandAtTheirLevelsMergedOrNot) {
  World w = random_world(3);
  pour(w, 4, 12'000);
  const WorldView view(w);
  LiquidLevels levels;
  levels.follow(view);
  for (const bool merge : {false, true}) {
    Extractor extractor;
    extractor.levels = &levels;
    const ExtractReport report = extractor.rebuild(view, {.merge_faces = merge, .see_through = true});
    EXPECT_TRUE(extractor.any_part());
    EXPECT_EQ(listed(extractor), expected(w, levels)) << merge;
    if (merge) {
      EXPECT_LT(report.quads, report.faces);
    }
  }
}

TEST(LiquidParts, FollowBlocksAndAmountsAsIfMadeAnew) {
  World w = random_world(5);
  LiquidLevels levels;
  levels.follow(WorldView(w));
  const int subscriber = w.store.subscribe();
  Extractor followed;
  followed.levels = &levels;
  followed.rebuild(WorldView(w), {.see_through = true});
  EXPECT_FALSE(followed.any_part());
  for (uint64_t step = 0; step < 8; ++step) {
    if (step > 0) pour(w, step, 60);
    EditBatch batch;
    for (uint64_t i = 0; i < 20; ++i) {
      const uint64_t h = mix64(step * 100 + i);
      batch.set({kBox.min.x + static_cast<int>(h % 27), kBox.min.y + static_cast<int>((h >> 8) % 23),
                 kBox.min.z + static_cast<int>((h >> 16) % 27)},
                *w.palette->find(i % 3 == 0   ? "stone"
                                 : i % 3 == 1 ? "lava"
                                              : "water"));
    }
    CHECK(w.store.apply(batch).ok());
    if (step == 6) w.store.drop_layer(Layer::liquid);
    const WorldView view(w);
    const std::vector<LeafPos> dirty = w.store.take_dirty(subscriber);
    const std::vector<LeafPos> moved = levels.follow(view);
    followed.update(view, dirty, moved);
    EXPECT_EQ(listed(followed), expected(w, levels)) << step;
  }
}

TEST(LiquidParts, OfWaterThatMovesLeaveTheFacesOfSolidsAlone) {
  World w(standard_blocks());
  EditBatch batch;
  batch.fill({{0, 0, 0}, {20, 0, 20}}, *w.palette->find("stone"));
  batch.fill({{0, 1, 0}, {20, 1, 20}}, *w.palette->find("water"));
  CHECK(w.store.apply(batch).ok());
  IntLayer& amounts = w.store.make_int_layer(Layer::liquid);
  LiquidLevels levels;
  levels.follow(WorldView(w));
  Extractor followed;
  followed.levels = &levels;
  followed.rebuild(WorldView(w), {.see_through = true});
  amounts.set({3, 1, 3}, 1000);
  const std::vector<LeafPos> moved = levels.follow(WorldView(w));
  EXPECT_EQ(moved.size(), 1u);
  const ExtractReport report = followed.update(WorldView(w), {}, moved);
  EXPECT_EQ(report.leaves_extracted, 0u);
  EXPECT_EQ(report.chunks_merged, 0u);
}

}  // namespace
}  // namespace render
