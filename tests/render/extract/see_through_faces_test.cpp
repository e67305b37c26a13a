/// Faces of see-through blocks against a count voxel by voxel.
#include "render/extract/see_through_faces.h"

#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "world/base/random.h"

namespace render {
namespace {

using namespace world;

/// A face of one voxel: voxel, direction, kind, kind beyond.
using Face = std::tuple<int, int, int, int, uint32_t, uint32_t>;

std::set<Face> listed(const SeeThroughFaces& faces) {
  std::set<Face> all;
  for (const ExtractedChunk* chunk : faces.chunks())
    for (const FaceRecord& r : chunk->records) {
      const int face = static_cast<int>(face_direction(r.word1)), axis = face >> 1;
      const int u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
      const glm::uvec3 first = face_voxel(r.word0);
      for (uint32_t i = 0; i < face_width(r.word0); ++i)
        for (uint32_t k = 0; k < face_height(r.word0); ++k) {
          VoxelPos voxel =
              chunk->origin + VoxelPos{static_cast<int>(first.x), static_cast<int>(first.y), static_cast<int>(first.z)};
          voxel[u] += static_cast<int>(i), voxel[v] += static_cast<int>(k);
          const bool fresh = all.insert({voxel.x, voxel.y, voxel.z, face, face_block(r.word1), r.word1 >> 19}).second;
          EXPECT_TRUE(fresh) << "a face is covered twice";
        }
    }
  return all;
}

/// The rule, by itself.
std::set<Face> expected(const World& w, VoxelBox box) {
  const SeeThroughKinds kinds(*w.palette);
  std::set<Face> all;
  for (int x = box.min.x - 1; x <= box.max.x + 1; ++x)
    for (int y = box.min.y - 1; y <= box.max.y + 1; ++y)
      for (int z = box.min.z - 1; z <= box.max.z + 1; ++z) {
        const BlockId own = w.store.get({x, y, z});
        if (!kinds.contains(own)) continue;
        for (int f = 0; f < kFaces; ++f) {
          const BlockId other = w.store.get(VoxelPos{x, y, z} + face_step(f));
          const bool open = other == kAir || !(*w.palette)[other].proxy.empty();
          if (open || (kinds.contains(other) && other < own))
            all.insert({x, y, z, f, kinds.kind(own), open ? 0u : kinds.kind(other)});
        }
      }
  return all;
}

constexpr VoxelBox kBox{{-20, -12, 40}, {30, 20, 90}};  // over chunk seams on each axis

World random_world(uint64_t seed) {
  World w(standard_blocks());
  const auto id = [&](const char* name) { return *w.palette->find(name); };
  const BlockId blocks[] = {kAir,       id("water"), id("glass"), id("stone"),
                            id("kelp"), id("ice"),   id("water"), id("glass_red")};
  EditBatch batch;
  batch.fill({{-18, -10, 44}, {-3, 5, 59}}, id("water"));  // whole leaves of one block
  batch.fill({{0, 0, 64}, {7, 7, 71}}, id("glass"));
  for (int x = kBox.min.x; x <= kBox.max.x; ++x)
    for (int y = kBox.min.y; y <= kBox.max.y; ++y)
      for (int z = kBox.min.z; z <= kBox.max.z; ++z) {
        const uint64_t h = mix64(seed ^ static_cast<uint64_t>(((x + 64) * 128 + y + 64) * 128 + z));
        if (h % 5 == 0) batch.set({x, y, z}, blocks[(h >> 20) % 8]);
      }
  CHECK(w.store.apply(batch).ok());
  return w;
}

TEST(SeeThroughFaces, AreThoseOfTheRuleMergedOrNot) {
  const World w = random_world(7);
  const WorldView view(w);
  const SeeThroughKinds kinds(*w.palette);
  const std::set<Face> right = expected(w, kBox);
  ASSERT_GT(right.size(), 5000u);
  for (const bool merge : {false, true}) {
    SeeThroughFaces faces;
    faces.rebuild(view, kinds, merge);
    EXPECT_EQ(listed(faces), right) << merge;
    EXPECT_EQ(faces.faces(), right.size());
    if (!merge) {
      EXPECT_EQ(faces.quads(), right.size());
    } else {
      EXPECT_LT(faces.quads(), right.size());
    }
  }
}

TEST(SeeThroughFaces, OfALakeAreOneRectangleAChunk) {
  World w(standard_blocks());
  EditBatch batch;
  batch.fill({{0, 0, 0}, {127, 15, 127}}, *w.palette->find("stone"));
  batch.fill({{1, 8, 1}, {126, 15, 126}}, *w.palette->find("water"));
  CHECK(w.store.apply(batch).ok());
  SeeThroughFaces faces;
  faces.rebuild(WorldView(w), SeeThroughKinds(*w.palette), true);
  EXPECT_EQ(faces.quads(), 4u);
  EXPECT_EQ(faces.faces(), 126u * 126u);
}

TEST(SeeThroughFaces, FollowEditsAsIfMadeAnew) {
  World w = random_world(8);
  SeeThroughFaces followed;
  const int subscriber = w.store.subscribe();
  followed.rebuild(WorldView(w), SeeThroughKinds(*w.palette), true);
  w.store.take_dirty(subscriber);
  for (uint64_t step = 0; step < 8; ++step) {
    EditBatch batch;
    for (uint64_t i = 0; i < 30; ++i) {
      const uint64_t h = mix64(step * 100 + i);
      const VoxelPos at{kBox.min.x + static_cast<int>(h % 50), kBox.min.y + static_cast<int>((h >> 8) % 32),
                        kBox.min.z + static_cast<int>((h >> 16) % 50)};
      batch.set(at, i % 3 == 0 ? kAir : *w.palette->find(i % 3 == 1 ? "water" : "stone"));
    }
    CHECK(w.store.apply(batch).ok());
    const std::vector<LeafPos> dirty = w.store.take_dirty(subscriber);
    followed.update(WorldView(w), SeeThroughKinds(*w.palette), dirty);
    EXPECT_EQ(listed(followed), expected(w, kBox)) << step;
  }
}

}  // namespace
}  // namespace render
