#include "render/extract/faces.h"

#include <cmath>

#include <gtest/gtest.h>

#include "render/bsdf/directions.shared.h"
#include "tests/render/extract/worlds.h"
#include "world/base/random.h"

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

TEST(HardCaseG12, ASlabOfAnyNumberOfGlassVoxelsBendsARayTwiceAndLetsItGoAsItCame) {
  // The walls between the voxels are no interfaces, so 64 voxels refract exactly as one does: on the way in, and out.
  for (const int voxels : {1, 2, 7, 8, 9, 64}) {
    World w = small_world();
    EditBatch batch;
    batch.fill({{100, 5, 5}, {100 + voxels - 1, 5, 5}}, kGlass);  // across leaves, and a region's border at 128
    ASSERT_TRUE(w.store.apply(batch).ok());
    size_t across = 0;
    for (const auto& [v, face, block] : extracted(w)) across += world::face_axis(face) == 0;
    EXPECT_EQ(across, 2u) << voxels;
  }
  // Out of the second face a ray goes as it came into the first: 4 ulp of 1, times 1 / (2 cos) beyond 60 degrees, since
  // the cosine is the root of what is left of its square.
  const glm::vec3 outward(-1, 0, 0);
  for (int i = 0; i < 20000; ++i) {
    const auto at = [&](uint64_t stream) { return world::uniform01(world::random_bits(12, i, 0, 0, 0, stream)); };
    const float cosine = 0.05f + 0.95f * at(0), turn = 6.2831853f * at(1), sine = std::sqrt(1 - cosine * cosine);
    const glm::vec3 wi = glm::normalize(glm::vec3(-cosine, sine * std::cos(turn), sine * std::sin(turn)));
    const glm::vec3 inside = shared::refracted_direction(wi, outward, 1.5f);
    // Beyond the far face the outward side is +x: the path comes from -inside there, seen from within the glass.
    const glm::vec3 beyond = shared::refracted_direction(-inside, outward, 1 / 1.5f);
    const float bound = 4 * 0x1p-23f * std::max(1.0f, 0.5f / cosine);
    for (int axis = 0; axis < 3; ++axis) ASSERT_NEAR(beyond[axis], -wi[axis], bound) << "cosine " << cosine;
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
