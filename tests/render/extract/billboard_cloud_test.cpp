/// Billboard clouds keep every face within their error, and show it.
#include "render/extract/billboard_cloud.h"

#include <cmath>
#include <set>
#include <tuple>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "world/base/random.h"

namespace render {
namespace {

/// A trunk with a ball of leaves, ragged at its surface.
std::vector<FaceRecord> tree_records(int radius, uint64_t seed, glm::ivec3 at = glm::ivec3(20)) {
  std::set<std::tuple<int, int, int>> leaves, logs;
  for (int y = -2 * radius; y < 0; ++y) logs.insert({0, y, 0});
  for (int x = -radius; x <= radius; ++x)
    for (int y = -radius; y <= radius; ++y)
      for (int z = -radius; z <= radius; ++z) {
        const uint64_t h = world::mix64(seed + static_cast<uint64_t>((x + 50) * 10000 + (y + 50) * 100 + z + 50));
        if (x * x + y * y + z * z <= radius * radius + static_cast<int>(h % 3) && !logs.count({x, y, z}))
          leaves.insert({x, y, z});
      }
  std::vector<FaceRecord> records;
  const auto add = [&](const std::set<std::tuple<int, int, int>>& of, uint32_t block) {
    for (const auto& [x, y, z] : of)
      for (uint32_t direction = 0; direction < 6; ++direction) {
        glm::ivec3 beside(x, y, z);
        beside[static_cast<int>(direction) >> 1] += direction & 1 ? 1 : -1;
        const std::tuple<int, int, int> key{beside.x, beside.y, beside.z};
        if (leaves.count(key) || logs.count(key)) continue;
        const glm::uvec3 voxel(at + glm::ivec3(x, y, z));
        records.push_back(make_face_record(voxel.x, voxel.y, voxel.z, 1, 1, direction, block));
      }
  };
  add(logs, 7);
  add(leaves, 9);
  return records;
}

glm::dvec3 corner_of(const UnitFace& f, int k) {
  const int axis = f.direction >> 1;
  glm::dvec3 p(f.voxel);
  p[axis] += f.direction & 1;
  p[(axis + 1) % 3] += k & 1;
  p[(axis + 2) % 3] += k >> 1;
  return p;
}

TEST(BillboardCloud, KeepsEveryFaceWithinTheErrorOfItsPlane) {
  for (const double error : {0.25, 0.5, 1.0, 2.0})
    for (const uint64_t seed : {1u, 2u, 3u}) {
      const auto trees = trees_of(tree_records(4, seed));
      ASSERT_EQ(trees.size(), 1u);
      const auto& faces = trees[0].faces;
      const BillboardCloud cloud = billboard_cloud(faces, error);
      ASSERT_EQ(cloud.plane_of.size(), faces.size());
      for (size_t i = 0; i < faces.size(); ++i) {
        ASSERT_LT(cloud.plane_of[i], cloud.planes.size());
        const CloudPlane& plane = cloud.planes[cloud.plane_of[i]];
        EXPECT_GE(std::abs(plane.normal[faces[i].direction >> 1]), 0.5 - 1e-6);
        for (int k = 0; k < 4; ++k)
          EXPECT_LE(std::abs(glm::dot(corner_of(faces[i], k), plane.normal) - plane.offset), error + 1e-9);
      }
    }
}

TEST(BillboardCloud, ShowsTheMiddleOfEveryFaceOnItsPlane) {
  const auto trees = trees_of(tree_records(4, 1));
  const auto& faces = trees.at(0).faces;
  const BillboardCloud cloud = billboard_cloud(faces, 1);
  for (size_t i = 0; i < faces.size(); ++i) {
    const CloudPlane& plane = cloud.planes[cloud.plane_of[i]];
    const glm::dvec3 middle = 0.5 * (corner_of(faces[i], 0) + corner_of(faces[i], 3));
    const int x = static_cast<int>((glm::dot(middle, plane.u) - plane.low_u) / kCloudTexel);
    const int y = static_cast<int>((glm::dot(middle, plane.v) - plane.low_v) / kCloudTexel);
    ASSERT_TRUE(x >= 0 && x < plane.width && y >= 0 && y < plane.height);
    for (int side = 0; side < 2; ++side)
      EXPECT_NE(cloud.texels.at(plane.first + static_cast<size_t>((side * plane.height + y) * plane.width + x)), 0u);
  }
}

TEST(BillboardCloud, TakesFewerPlanesWhereTheErrorIsLarger) {
  const auto trees = trees_of(tree_records(4, 1));
  size_t last = ~size_t{0};
  for (const double error : {0.25, 0.5, 1.0, 2.0}) {
    const size_t planes = billboard_cloud(trees.at(0).faces, error).planes.size();
    EXPECT_LT(planes, last);
    last = planes;
  }
  EXPECT_LT(last * 10, trees[0].faces.size());
}

TEST(BillboardCloud, HasAPlaneOfItsOwnForASingleFaceAtAnyError) {
  for (uint8_t direction = 0; direction < 6; ++direction) {
    const UnitFace face{{3, 2, 1}, direction, 5};
    const BillboardCloud cloud = billboard_cloud({&face, 1}, 1e-3);
    ASSERT_EQ(cloud.planes.size(), 1u);
    EXPECT_NEAR(std::abs(cloud.planes[0].normal[direction >> 1]), 1, 1e-12);
    for (const uint32_t texel : cloud.texels) EXPECT_EQ(texel & 0x7ffffu, 5u | uint32_t{direction} << 16);
  }
}

TEST(Trees, AreTheSameWhereverTheyStand) {
  const auto here = trees_of(tree_records(3, 5, glm::ivec3(20))), there = trees_of(tree_records(3, 5, {33, 40, 11}));
  ASSERT_EQ(here.size(), 1u);
  ASSERT_EQ(there.size(), 1u);
  EXPECT_EQ(here[0].faces, there[0].faces);
  EXPECT_EQ(there[0].low - here[0].low, glm::ivec3(13, 20, -9));
}

TEST(Trees, HoldEachFaceOnceAndReachNoFartherThanTheyMay) {
  std::vector<FaceRecord> records{make_face_record(0, 5, 0, 64, 64, 3, 9)};
  size_t faces = 0;
  for (const TreeFaces& tree : trees_of(records)) {
    faces += tree.faces.size();
    for (const UnitFace& f : tree.faces)
      for (int a = 0; a < 3; ++a) EXPECT_TRUE(f.voxel[a] >= 0 && f.voxel[a] < kTreeCells);
  }
  EXPECT_EQ(faces, 64u * 64u);
}

}  // namespace
}  // namespace render
