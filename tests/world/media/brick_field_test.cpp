// Densities in bricks: the samples of a voxel grid, between voxels and over the edges of bricks and regions.
#include "world/media/brick_field.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "world/base/jobs.h"
#include "world/numbers/robust.h"

namespace world {
namespace {

/// Sparse leaves around a corner of regions, and one far away.
std::vector<FieldLeaf> sparse_leaves() {
  std::mt19937 random(1);
  std::vector<FieldLeaf> leaves;
  for (int n = 0; n < 40; ++n) {
    const auto at = [&] { return static_cast<int32_t>(random() % 6) - 3; };
    FieldLeaf leaf{{at(), at(), at()}, {}};
    if (n == 0) leaf.leaf = {1000, -2000, 3000};
    for (const FieldLeaf& other : leaves)
      if (other.leaf == leaf.leaf) leaf.leaf.x += 100 + n;
    for (float& v : leaf.values) v = random() % 4 == 0 ? static_cast<float>(random() % 1000) / 256 : 0;
    leaves.push_back(leaf);
  }
  return leaves;
}

float voxel_value(const std::vector<FieldLeaf>& leaves, VoxelPos v) {
  for (const FieldLeaf& leaf : leaves)
    if (leaf.leaf == leaf_from_voxel(v)) return leaf.values[static_cast<size_t>(index_in_leaf(v))];
  return 0;
}

TEST(BrickField, SamplesAreThoseOfTheVoxelGridEverywhere) {
  const std::vector<FieldLeaf> leaves = sparse_leaves();
  const auto nearest = BrickField::make(leaves, FieldSampling::nearest, "test").value();
  const auto trilinear = BrickField::make(leaves, FieldSampling::trilinear, "test").value();
  std::mt19937 bits(2);
  std::uniform_real_distribution<double> coordinate(-28, 28);
  int above = 0;
  for (int i = 0; i < 20000; ++i) {
    Vec3d p(coordinate(bits), coordinate(bits), coordinate(bits));
    if (i % 10 == 0) p += Vec3d(8004, -15996, 24004) - 0.8 * p;
    if (i % 7 == 0) p = floor(p);  // on faces between voxels, bricks and regions
    const VoxelPos v{floor_to_int(p.x), floor_to_int(p.y), floor_to_int(p.z)};
    EXPECT_EQ(nearest->density(p), voxel_value(leaves, v));
    const Vec3d q = p - 0.5, low = floor(q), f = q - low;
    double expected = 0;
    for (int c = 0; c < 8; ++c) {
      const VoxelPos corner{static_cast<int32_t>(low.x) + (c >> 2), static_cast<int32_t>(low.y) + (c >> 1 & 1),
                            static_cast<int32_t>(low.z) + (c & 1)};
      expected += (c & 4 ? f.x : 1 - f.x) * (c & 2 ? f.y : 1 - f.y) * (c & 1 ? f.z : 1 - f.z) *
                  double{voxel_value(leaves, corner)};
    }
    EXPECT_NEAR(trilinear->density(p), expected, 5e-7);  // a float's rounding of at most 4
    above += expected > 0;
  }
  EXPECT_GT(above, 2000);
}

TEST(BrickField, OnlyBricksThatHoldAnythingTakeMemory) {
  std::vector<FieldLeaf> leaves;
  for (int x = 0; x < 20; ++x)
    for (int y = 0; y < 20; ++y) leaves.push_back({{x, y, 0}, {}});
  leaves[21].values[5] = 2;
  const auto field = BrickField::make(leaves, FieldSampling::nearest, "test").value();
  EXPECT_EQ(field->bricks(), 1u);
  EXPECT_EQ(field->max(), 2);
  EXPECT_LT(field->bytes(), 40000u);
  leaves[21].values[5] = 0;
  const auto empty = BrickField::make(leaves, FieldSampling::nearest, "test").value();
  EXPECT_EQ(empty->bricks(), 0u);
  EXPECT_EQ(empty->max(), 0);
  EXPECT_EQ(empty->density({12, 8.5, 0.5}), 0);
  EXPECT_EQ(empty->depth({12, 8.5, -5}, {0, 0, 1}, 0, 100), 0);
}

TEST(BrickField, NegativeAndNaNDensitiesAreRefused) {
  for (const float wrong : {-0.001f, std::nanf(""), INFINITY}) {
    FieldLeaf leaf{{1, 2, 3}, {}};
    leaf.values[static_cast<size_t>(index_in_leaf({1, 2, 3}))] = wrong;
    const auto field = BrickField::make({leaf}, FieldSampling::nearest, "smoke");
    ASSERT_FALSE(field.ok());
    EXPECT_EQ(field.error().message.find("smoke: the density at voxel (9, 18, 27) is "), 0u) << field.error().message;
  }
}

TEST(BrickField, DepthAcrossOneVoxelIsItsClosedForm) {
  FieldLeaf leaf{{0, 0, 0}, {}};
  leaf.values[static_cast<size_t>(index_in_leaf({3, 3, 3}))] = 2;
  // Nearest: 2 over 1 m. Trilinear: a hat of base 2 and height 2 along the axis through the centre.
  for (const FieldSampling sampling : {FieldSampling::nearest, FieldSampling::trilinear}) {
    const auto field = BrickField::make({leaf}, sampling, "test").value();
    EXPECT_DOUBLE_EQ(field->depth({-10, 3.5, 3.5}, {1, 0, 0}, 0, 100), 2);
    EXPECT_DOUBLE_EQ(field->depth({3.5, 3.5, 50}, {0, 0, -2}, 0, 100), 1);
  }
  // Along the diagonal through the centre: nearest 2 sqrt(3); trilinear the integral of 2 (1 - |s|)^3 ds sqrt(3).
  const Vec3d d = normalize(Vec3d(1, 1, 1));
  EXPECT_NEAR(BrickField::make({leaf}, FieldSampling::nearest, "test").value()->depth({0, 0, 0}, d, 0, 100),
              2 * std::sqrt(3), 1e-14);
  EXPECT_NEAR(BrickField::make({leaf}, FieldSampling::trilinear, "test").value()->depth({0, 0, 0}, d, 0, 100),
              std::sqrt(3), 1e-14);
}

TEST(BrickField, ReadingFromManyThreadsGivesTheSame) {
  const auto field = BrickField::make(sparse_leaves(), FieldSampling::trilinear, "test").value();
  std::vector<double> alone(4000), together(4000);
  const auto at = [&](size_t i) {
    const Vec3d origin(-30, static_cast<double>(i % 50) - 25, static_cast<double>(i / 100) - 20);
    return field->depth(origin, normalize(Vec3d(1, 0.1, -0.05)), 0, 100) + field->density(origin * 0.5);
  };
  for (size_t i = 0; i < alone.size(); ++i) alone[i] = at(i);
  parallel_for(together.size(), [&](size_t i) { together[i] = at(i); });
  EXPECT_EQ(alone, together);
}

}  // namespace
}  // namespace world
