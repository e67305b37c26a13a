/// Faces of see-through blocks against a count voxel by voxel.
#include "render/extract/see_through_faces.h"

#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "world/base/random.h"

namespace render {
namespace {

using namespace world;

/// A face of one voxel, or a part of one: voxel, direction, kind, kind beyond, from and to which sixteenth.
using Face = std::tuple<int, int, int, int, uint32_t, uint32_t, uint32_t, uint32_t>;

std::set<Face> listed(const SeeThroughFaces& faces) {
  std::set<Face> all;
  for (const ExtractedChunk* chunk : faces.chunks())
    for (const FaceRecord& r : chunk->records) {
      const int face = static_cast<int>(face_direction(r.word1)), axis = face >> 1;
      const int u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
      const glm::uvec3 first = face_voxel(r.word0);
      const uint32_t width = part_in_width(r.word0, r.word1) ? 1 : face_width(r.word0);
      const uint32_t height = part_in_height(r.word0, r.word1) ? 1 : face_height(r.word0);
      const uint32_t top = part_top(see_through_part_upper(r.word1)), bottom = part_bottom(r.word0, r.word1);
      for (uint32_t i = 0; i < width; ++i)
        for (uint32_t k = 0; k < height; ++k) {
          VoxelPos voxel =
              chunk->origin + VoxelPos{static_cast<int>(first.x), static_cast<int>(first.y), static_cast<int>(first.z)};
          voxel[u] += static_cast<int>(i), voxel[v] += static_cast<int>(k);
          const bool fresh = all.insert({voxel.x, voxel.y, voxel.z, face, see_through_kind(r.word1),
                                         see_through_beyond(r.word1), bottom, top})
                                 .second;
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
            all.insert({x, y, z, f, kinds.kind(own), open ? 0u : kinds.kind(other), 0u, 16u});
        }
      }
  return all;
}

/// What fills a voxel at a height, in sixteenths: a kind, 0 for air, -1 for what no ray sees through.
int filling(const World& w, const SeeThroughKinds& kinds, const LiquidLevels& levels, VoxelPos v, int at) {
  const BlockId id = w.store.get(v);
  if (id == kAir || at >= levels.at(v)) return 0;
  if (kinds.contains(id)) return kinds.kind(id);
  return (*w.palette)[id].proxy.empty() ? -1 : 0;
}

/// The same rule, sixteenth by sixteenth: sides are cut into 16 parts, tops and bottoms lie where the filling changes.
std::set<Face> expected_parts(const World& w, const LiquidLevels& levels, VoxelBox box) {
  const SeeThroughKinds kinds(*w.palette);
  std::set<Face> all;
  const auto owns = [](int own, int other) { return own > 0 && (other == 0 || (other > 0 && own > other)); };
  const auto unsigned_of = [](int i) { return static_cast<uint32_t>(i); };
  for (int x = box.min.x - 1; x <= box.max.x + 1; ++x)
    for (int y = box.min.y - 1; y <= box.max.y + 1; ++y)
      for (int z = box.min.z - 1; z <= box.max.z + 1; ++z) {
        const VoxelPos v{x, y, z};
        if (!kinds.contains(w.store.get(v))) continue;
        for (const int f : {kFaceNegX, kFacePosX, kFaceNegZ, kFacePosZ})
          for (int at = 0; at < 16; ++at) {
            const int own = filling(w, kinds, levels, v, at), other = filling(w, kinds, levels, v + face_step(f), at);
            if (owns(own, other))
              all.insert({x, y, z, f, unsigned_of(own), unsigned_of(other), unsigned_of(at), unsigned_of(at + 1)});
          }
        const int own = filling(w, kinds, levels, v, 0), level = levels.at(v);
        const int below = filling(w, kinds, levels, v + face_step(kFaceNegY), 15);
        if (owns(own, below)) all.insert({x, y, z, kFaceNegY, unsigned_of(own), unsigned_of(below), 0u, 16u});
        const int above = level < 16 ? 0 : filling(w, kinds, levels, v + face_step(kFacePosY), 0);
        if (owns(own, above))
          all.insert({x, y, z, kFacePosY, unsigned_of(own), unsigned_of(above), 0u, unsigned_of(level)});
      }
  return all;
}

std::set<Face> in_sixteenths(const std::set<Face>& faces) {
  std::set<Face> all;
  for (const auto& [x, y, z, f, kind, beyond, bottom, top] : faces) {
    if (f == kFaceNegY || f == kFacePosY) {
      all.insert({x, y, z, f, kind, beyond, bottom, top});
      continue;
    }
    for (uint32_t at = bottom; at < top; ++at)
      EXPECT_TRUE(all.insert({x, y, z, f, kind, beyond, at, at + 1}).second) << "a part is covered twice";
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

/// Any amount in every second voxel.
void pour(World& w, uint64_t seed) {
  IntLayer& amounts = w.store.make_int_layer(Layer::liquid);
  for (int x = kBox.min.x; x <= kBox.max.x; ++x)
    for (int y = kBox.min.y; y <= kBox.max.y; ++y)
      for (int z = kBox.min.z; z <= kBox.max.z; ++z) {
        const uint64_t h = mix64(seed ^ static_cast<uint64_t>(((x + 64) * 128 + y + 64) * 128 + z));
        if (h % 2) amounts.set({x, y, z}, static_cast<int32_t>(1 + (h >> 20) % 4096));
      }
}

TEST(SeeThroughFaces, OfLiquidsEndAtTheirLevelsMergedOrNot) {
  World w = random_world(9);
  pour(w, 10);
  const WorldView view(w);
  const SeeThroughKinds kinds(*w.palette);
  LiquidLevels levels;
  levels.follow(view);
  const std::set<Face> right = expected_parts(w, levels, kBox);
  for (const bool merge : {false, true}) {
    SeeThroughFaces faces;
    faces.rebuild(view, kinds, merge, &levels);
    EXPECT_EQ(in_sixteenths(listed(faces)), right) << merge;
    EXPECT_EQ(faces.faces(), listed(faces).size());
  }
}

TEST(SeeThroughFaces, OfAStepAreTwoTopsAndTheWallBetween) {
  World w(standard_blocks());
  EditBatch batch;
  batch.fill({{0, 0, 0}, {9, 0, 9}}, *w.palette->find("stone"));
  batch.fill({{1, 0, 1}, {8, 0, 8}}, *w.palette->find("water"));
  CHECK(w.store.apply(batch).ok());
  IntLayer& amounts = w.store.make_int_layer(Layer::liquid);
  for (int x = 1; x <= 8; ++x)
    for (int z = 1; z <= 8; ++z) amounts.set({x, 0, z}, x < 5 ? 3072 : 1024);
  const uint32_t water = SeeThroughKinds(*w.palette).kind(*w.palette->find("water"));
  LiquidLevels levels;
  levels.follow(WorldView(w));
  SeeThroughFaces faces;
  faces.rebuild(WorldView(w), SeeThroughKinds(*w.palette), true, &levels);
  // Its bottom looks at air.
  EXPECT_EQ(faces.quads(), 4u);
  const std::set<Face> all = listed(faces);
  for (int z = 1; z <= 8; ++z) {
    EXPECT_TRUE(all.contains({4, 0, z, kFacePosX, water, 0u, 4u, 12u})) << z;
    for (int x = 1; x <= 8; ++x)
      EXPECT_TRUE(all.contains({x, 0, z, kFacePosY, water, 0u, 0u, x < 5 ? 12u : 4u})) << x << " " << z;
  }
}

TEST(SeeThroughFaces, FollowAmountsAndLeaveChunksAloneWhereNoLevelMoves) {
  World w = random_world(11);
  pour(w, 12);
  LiquidLevels levels;
  levels.follow(WorldView(w));
  const SeeThroughKinds kinds(*w.palette);
  SeeThroughFaces followed;
  followed.rebuild(WorldView(w), kinds, true, &levels);
  IntLayer& amounts = w.store.make_int_layer(Layer::liquid);
  for (uint64_t step = 0; step < 6; ++step) {
    for (uint64_t i = 0; i < 20; ++i) {
      const uint64_t h = mix64(step * 100 + i);
      amounts.set({kBox.min.x + static_cast<int>(h % 50), kBox.min.y + static_cast<int>((h >> 8) % 32),
                   kBox.min.z + static_cast<int>((h >> 16) % 50)},
                  static_cast<int32_t>(1 + (h >> 32) % 4096));
    }
    followed.update(WorldView(w), kinds, levels.follow(WorldView(w)), &levels);
    EXPECT_EQ(in_sixteenths(listed(followed)), expected_parts(w, levels, kBox)) << step;
  }
  const auto versions = [&] {
    std::vector<uint64_t> all;
    for (const ExtractedChunk* chunk : followed.chunks()) all.push_back(chunk->version);
    return all;
  };
  const std::vector<uint64_t> before = versions();
  followed.update(WorldView(w), kinds, levels.follow(WorldView(w)), &levels);
  EXPECT_EQ(versions(), before);
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
