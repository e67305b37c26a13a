#include "render/extract/greedy.h"

#include <gtest/gtest.h>

#include "tests/render/extract/worlds.h"

namespace render {
namespace {

TEST(FaceRecord, PacksEveryFieldAndItsLimits) {
  const FaceRecord r = make_face_record(63, 1, 62, 64, 1, 5, 65535);
  EXPECT_EQ(face_voxel(r.word0), uvec3(63, 1, 62));
  EXPECT_EQ(face_width(r.word0), 64u);
  EXPECT_EQ(face_height(r.word0), 1u);
  EXPECT_EQ(face_direction(r.word1), 5u);
  EXPECT_EQ(face_block(r.word1), 65535u);
}

TEST(FaceRecord, CornersGoCounterClockwiseSeenFromOutside) {
  for (int f = 0; f < kFaces; ++f) {
    const FaceRecord r = make_face_record(10, 20, 30, 2, 5, static_cast<uint32_t>(f), 1);
    VoxelPos c[4];
    for (uint32_t i = 0; i < 4; ++i) {
      const uvec3 p = face_corner(r.word0, r.word1, i);
      c[i] = {static_cast<int>(p.x), static_cast<int>(p.y), static_cast<int>(p.z)};
      EXPECT_EQ(c[i][face_axis(f)], 10 * (face_axis(f) + 1) + (f & 1));
    }
    const VoxelPos a = c[1] - c[0], b = c[2] - c[1];
    const VoxelPos normal{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    VoxelPos expected = face_step(f);
    for (int axis = 0; axis < 3; ++axis) expected[axis] *= 2 * 5;
    EXPECT_EQ(normal, expected) << "face " << f;
    EXPECT_EQ(c[3], c[0] + b);
  }
}

struct Case {
  const char* name;
  BlockAt blocks;
};

std::vector<Case> cases() {
  return {
      {"one block", [](VoxelPos) { return kStone; }},
      {"random, sparse", random_blocks(11, 0.1f, 5)},
      {"random, one kind", random_blocks(12, 0.5f, 1)},
      {"random, five kinds", random_blocks(13, 0.8f, 5)},
      {"large patches", [](VoxelPos v) -> BlockId { return static_cast<BlockId>(1 + ((v.x >> 3) + (v.z / 5)) % 3); }},
      {"stripes along x", [](VoxelPos v) -> BlockId { return static_cast<BlockId>(1 + (v.y & 1)); }},
      {"stripes along z", [](VoxelPos v) -> BlockId { return static_cast<BlockId>(1 + (v.x & 1)); }},
      {"terrain", terrain_blocks({0, 0, 0}, 30)}};
}

TEST(Greedy, CoversExactlyTheUnitFacesWithTheSameBlocks) {
  for (const Case& c : cases()) {
    World w = small_world();
    const VoxelBox box = box_at({-70, -3, 60}, 140, 66, 70);
    fill(w, box, c.blocks);
    const WorldView view(w);
    Extractor merged, single;
    const ExtractReport a = merged.rebuild(view, {true, true}), b = single.rebuild(view, {false, true});
    EXPECT_EQ(unit_faces(merged), unit_faces(single)) << c.name;
    EXPECT_EQ(a.faces, b.faces);
    EXPECT_EQ(b.quads, b.faces);
    EXPECT_LE(a.quads, b.quads);
  }
}

TEST(Greedy, AWallOfOneBlockIsOneRectangleAChunk) {
  World w = small_world();
  fill(w, box_at({0, 0, 0}, 128, 64, 64), [](VoxelPos) { return kDirt; });
  const WorldView view(w);
  Extractor extractor;
  EXPECT_EQ(extractor.rebuild(view, {true, true}).quads, 2u * 5);
}

TEST(Greedy, BoundsAreExact) {
  for (const bool merge : {true, false}) {
    World w = small_world();
    fill(w, box_at({-40, -40, -40}, 70, 90, 60), random_blocks(17, 0.02f, 5));
    const WorldView view(w);
    Extractor extractor;
    extractor.rebuild(view, {merge, true});
    ASSERT_FALSE(extractor.chunks().empty());
    for (const ExtractedChunk* chunk : extractor.chunks()) {
      CornerBox all;
      for (int f = 0; f < kFaces; ++f) {
        CornerBox box;
        for (const FaceRecord& r : chunk->of_direction(f))
          for (uint32_t i = 0; i < 4; ++i) {
            const uvec3 p = face_corner(r.word0, r.word1, i);
            const std::array<uint8_t, 3> corner{static_cast<uint8_t>(p.x), static_cast<uint8_t>(p.y),
                                                static_cast<uint8_t>(p.z)};
            box.include({corner, corner});
          }
        EXPECT_EQ(chunk->bounds[static_cast<size_t>(f)], box);
        all.include(box);
      }
      EXPECT_EQ(chunk->all_bounds, all);
    }
  }
}

}  // namespace
}  // namespace render
