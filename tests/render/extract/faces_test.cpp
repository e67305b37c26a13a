#include "render/extract/faces.h"

#include <gtest/gtest.h>

#include "tests/render/extract/worlds.h"

namespace render {
namespace {

constexpr ExtractKnobs kUnmerged{false, true};

UnitFaces extracted(const World& w, const ExtractKnobs& knobs = kUnmerged) {
  Extractor extractor;
  const WorldView view(w);
  extractor.rebuild(view, knobs);
  return unit_faces(extractor);
}

struct Case {
  const char* name;
  BlockAt blocks;
};

std::vector<Case> cases() {
  const auto checkerboard = [](VoxelPos v) -> BlockId { return (v.x + v.y + v.z) & 1 ? kStone : kAir; };
  return {{"random", random_blocks(1, 0.5f, 3)},
          {"random with glass and water", random_blocks(2, 0.7f, 5)},
          {"nearly full", random_blocks(3, 0.99f, 5)},
          {"nearly empty", random_blocks(4, 0.01f, 5)},
          {"checkerboard", checkerboard},
          {"full", [](VoxelPos) { return kStone; }},
          {"full of water", [](VoxelPos) { return kWater; }},
          {"terrain", terrain_blocks({0, 0, 0}, 20)}};
}

TEST(Faces, EqualBruteForceAcrossLeafChunkAndRegionBorders) {
  for (const Case& c : cases()) {
    World w = small_world();
    const VoxelBox box = box_at({-21, -5, 107}, 42, 40, 42);
    fill(w, box, c.blocks);
    EXPECT_EQ(extracted(w), brute_force_faces(w, box)) << c.name;
  }
}

TEST(Faces, EqualBruteForceTenMillionMetresAway) {
  for (const VoxelPos origin : {VoxelPos{10'000'000, 0, -10'000'000}, VoxelPos{-10'000'019, 77, 9'999'990}}) {
    World w = small_world();
    const VoxelBox box = box_at(origin, 30, 20, 30);
    fill(w, box, random_blocks(5, 0.6f, 5));
    EXPECT_EQ(extracted(w), brute_force_faces(w, box));
  }
}

TEST(HardCaseG7, EachFaceIsFoundOnceWhateverTheAlignment) {
  // The same content, moved: leaves, chunks and regions cut it elsewhere. Faces move with it.
  const VoxelBox box = box_at({0, 0, 0}, 64, 64, 64);
  UnitFaces expected;
  for (const VoxelPos shift :
       {VoxelPos{0, 0, 0}, VoxelPos{1, 2, 3}, VoxelPos{-37, 64, 100}, VoxelPos{-64, -1, 127}, VoxelPos{7, -129, -8}}) {
    World w = small_world();
    const BlockAt blocks = random_blocks(7, 0.5f, 5);
    fill(w, {box.min + shift, box.max + shift}, [&](VoxelPos v) { return blocks(v - shift); });
    UnitFaces faces = extracted(w);
    for (auto& [v, face, block] : faces) v = v - shift;
    std::sort(faces.begin(), faces.end());
    EXPECT_EQ(std::adjacent_find(faces.begin(), faces.end()), faces.end()) << "a face was found twice";
    if (expected.empty()) expected = brute_force_faces(w, box);
    EXPECT_EQ(faces, expected) << shift.x << ' ' << shift.y << ' ' << shift.z;
  }
}

TEST(HardCaseG8, TransparentBlocksShareExactlyOneInterface) {
  // A row along each axis, once inside a leaf and once across the border of two regions.
  for (int axis = 0; axis < 3; ++axis)
    for (const int at : {3, 127}) {
      const auto interfaces = [&](BlockId a, BlockId b) {
        World w = small_world();
        VoxelPos first{5, 5, 5}, second{5, 5, 5};
        first[axis] = at, second[axis] = at + 1;
        EditBatch batch;
        batch.set(first, a), batch.set(second, b);
        EXPECT_TRUE(w.store.apply(batch).ok());
        size_t n = 0;
        for (const auto& [v, face, block] : extracted(w))
          n += (v == first && face == axis * 2 + 1) || (v == second && face == axis * 2);
        return n;
      };
      EXPECT_EQ(interfaces(kGlass, kGlass), 0u);
      EXPECT_EQ(interfaces(kWater, kWater), 0u);
      EXPECT_EQ(interfaces(kGlass, kWater), 1u);
      EXPECT_EQ(interfaces(kWater, kGlass), 1u);
      EXPECT_EQ(interfaces(kWater, kAir), 1u);
      EXPECT_EQ(interfaces(kAir, kGlass), 1u);
      EXPECT_EQ(interfaces(kStone, kWater), 1u);
      EXPECT_EQ(interfaces(kWater, kStone), 1u);
      EXPECT_EQ(interfaces(kStone, kDirt), 0u);
    }
}

TEST(Faces, AFullLeafInFullLeavesIsSkipped) {
  World w = small_world();
  const VoxelBox box = box_at({0, 0, 0}, 128, 128, 128);
  fill(w, box, [](VoxelPos) { return kStone; });
  const WorldView view(w);
  const FaceTotals totals =
      count_visible_faces({&w.store, &view.masks(MaskKind::occupied), &view.masks(MaskKind::opaque), nullptr});
  EXPECT_EQ(totals.faces, 6u * 128 * 128);
  EXPECT_EQ(totals.leaves, 16u * 16 * 16 - 14u * 14 * 14);
  EXPECT_EQ(totals.voxels_dense, 128u * 128 * 128);
}

}  // namespace
}  // namespace render
