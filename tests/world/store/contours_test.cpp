#include "world/store/contours.h"

#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "world/base/random.h"
#include "world/store/contour_walk.h"
#include "world/store/store.h"

namespace world {
namespace {

/// A ball in voxels: its level set, its blocks, its contours.
struct Ball {
  Vec3d centre;
  double radius;
  MaskVolume blocks;
  std::unique_ptr<Contours> contours;

  float value(VoxelPos v) const {
    return static_cast<float>(glm::length(Vec3d(v.x + 0.5, v.y + 0.5, v.z + 0.5) - centre) - radius);
  }
  Ball(const Vec3d& middle, double r, bool keep_values = true) : centre(middle), radius(r) {
    const Vec3d low = centre - (radius + 2), high = centre + (radius + 2);
    const VoxelBox box{WorldPoint::from(low.x, low.y, low.z).voxel, WorldPoint::from(high.x, high.y, high.z).voxel};
    const LeafPos a = leaf_from_voxel(box.min), b = leaf_from_voxel(box.max);
    for (int x = a.x; x <= b.x; ++x)
      for (int y = a.y; y <= b.y; ++y)
        for (int z = a.z; z <= b.z; ++z) {
          LeafMask mask;
          for (int i = 0; i < kLeafVoxels; ++i)
            if (value(voxel_from_leaf({x, y, z}) + offset_in_leaf(i)) <= 0) mask.set(i);
          blocks.set_leaf({x, y, z}, mask);
        }
    contours =
        std::make_unique<Contours>(blocks, function_surface([this](VoxelPos v) { return value(v); }, box), keep_values);
  }
  Ball(const Ball&) = delete;
};

double uniform(uint64_t i, uint32_t stream) { return uniform01_double(random_bits(7, i, stream, 0)); }
Vec3d unit_vector(uint64_t i, uint32_t stream) {
  const double y = 2 * uniform(i, stream) - 1, turn = 6.283185307179586 * uniform(i, stream + 1);
  const double r = std::sqrt(1 - y * y);
  return {r * std::cos(turn), y, r * std::sin(turn)};
}

/// A ray from three radii away through a point `depth` below the surface.
GridRay ray_to_depth(const Ball& ball, uint64_t i, double depth) {
  const Vec3d from = ball.centre + 3 * ball.radius * unit_vector(i, 0);
  const Vec3d aim = ball.centre + (ball.radius - depth) * unit_vector(i, 2);
  return {WorldPoint::from(from.x, from.y, from.z), glm::normalize(aim - from)};
}
Vec3d place(const GridRay& ray, double t) {
  return Vec3d(ray.voxel.x, ray.voxel.y, ray.voxel.z) + ray.fraction + t * ray.direction;
}
double degrees_between(const Vec3d& a, const Vec3d& b) {
  return 57.29577951308232 * std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

TEST(ContourPlane, RoundsNoFurtherThanItsStatedErrorsAndKeepsAxesExact) {
  double normal_error = 0, offset_error = 0;
  for (uint64_t i = 0; i < 200000; ++i) {
    const ContourPlane plane{unit_vector(i, 0), (2 * uniform(i, 2) - 1) * kLargestOffset};
    const uint32_t word = pack_plane(plane);
    ASSERT_TRUE(is_plane(word));
    const ContourPlane back = unpack_plane(word);
    normal_error = std::max(normal_error, degrees_between(plane.normal, back.normal) / 57.29577951308232);
    offset_error = std::max(offset_error, std::abs(plane.offset - back.offset));
  }
  EXPECT_LE(normal_error, kNormalError);
  EXPECT_LE(offset_error, kOffsetError * (1 + 1e-12));
  for (int face = 0; face < kFaces; ++face) {
    Vec3d axis(0.0);
    axis[face_axis(face)] = face_sign(face);
    const ContourPlane back = unpack_plane(pack_plane({axis, 0}));
    EXPECT_EQ(back.normal, axis);
    EXPECT_EQ(back.offset, 0);
  }
}

TEST(Contours, OfAnInclinedHalfSpaceAreThatPlaneWithinRounding) {
  const Vec3d normal = glm::normalize(Vec3d(0.3, 0.8, -0.5));
  const auto height = [&](VoxelPos v) {
    return static_cast<float>(glm::dot(normal, Vec3d(v.x + 0.5, v.y + 0.5, v.z + 0.5)) - 8.2);
  };
  const VoxelBox box{{0, 0, 0}, {15, 15, 15}};
  MaskVolume blocks;
  for (int x = -1; x < 3; ++x)
    for (int y = -1; y < 3; ++y)
      for (int z = -1; z < 3; ++z) {
        LeafMask mask;
        for (int i = 0; i < kLeafVoxels; ++i)
          if (height(voxel_from_leaf({x, y, z}) + offset_in_leaf(i)) <= 0) mask.set(i);
        blocks.set_leaf({x, y, z}, mask);
      }
  const Contours contours(blocks, function_surface(height, box), false);
  int seen = 0;
  for (int i = 0; i < 4096; ++i) {
    const VoxelPos v{i >> 8, i >> 4 & 15, i & 15};
    const double middle = glm::dot(normal, Vec3d(v.x + 0.5, v.y + 0.5, v.z + 0.5)) - 8.2;
    const double reach = 0.5 * (std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z));
    if (std::abs(std::abs(middle) - reach) < 1e-5) continue;
    const uint32_t word = contours.plane(v);
    ASSERT_EQ(is_plane(word), std::abs(middle) < reach) << v.x << ' ' << v.y << ' ' << v.z;
    if (!is_plane(word)) continue;
    const ContourPlane plane = unpack_plane(word);
    EXPECT_LE(degrees_between(plane.normal, normal) / 57.29577951308232, kNormalError);
    // The mean of the crossings, up to 0.87 from the middle, holds still while the normal is rounded.
    EXPECT_NEAR(plane.offset, -middle, 0.87 * kNormalError + kOffsetError + 1e-5);
    ++seen;
  }
  EXPECT_GT(seen, 200);
}

TEST(Contours, CostNothingWithoutAField) {
  MaskVolume blocks;
  blocks.set_leaf({0, 0, 0}, kAllMask);
  const Contours none(blocks, nullptr, true);
  EXPECT_EQ(none.bytes(), 0u);
  EXPECT_EQ(none.plane({3, 3, 3}), kNoContour);

  BlockPalette palette;
  Block block;
  block.name = "fog";
  const BlockId fog = palette.add(block).value();
  Store store(palette);
  EditBatch batch;
  batch.set({0, 0, 0}, fog);
  ASSERT_TRUE(store.apply(batch).ok());
  StoreContours followed;
  EXPECT_EQ(followed.follow(store, ContourShape::planes, 0.5f), nullptr);
  store.make_layer(Layer::density).set({0, 0, 0}, 1);
  EXPECT_EQ(followed.follow(store, ContourShape::off, 0.5f), nullptr);
  EXPECT_EQ(followed.follow(store, ContourShape::field, 0), nullptr);
  EXPECT_EQ(followed.bytes(), 0u);
  EXPECT_NE(followed.follow(store, ContourShape::field, 0.5f), nullptr);
  EXPECT_GT(followed.bytes(), 0u);
  EXPECT_EQ(followed.follow(store, ContourShape::off, 0.5f), nullptr);
  EXPECT_EQ(followed.bytes(), 0u);
}

TEST(Contours, OnABallKeepTheStatedErrorOfPlaceAndNormal) {
  for (const double radius : {4.0, 9.0, 30.0, 100.0}) {
    const Ball ball({0.3, -0.2, 0.45}, radius, false);
    const ContourWalker walker(*ball.contours, ContourShape::planes);
    double worst_place = 0, worst_normal = 0;
    for (uint64_t i = 0; i < 20000; ++i) {
      const GridRay ray = ray_to_depth(ball, i, 0.3 * ball.radius);
      const ContourHit hit = walker.first_hit(ray);
      ASSERT_TRUE(hit.hit());
      ASSERT_TRUE(hit.smooth) << i;
      const Vec3d out = place(ray, hit.grid.t) - ball.centre;
      worst_place = std::max(worst_place, std::abs(glm::length(out) - radius));
      worst_normal = std::max(worst_normal, degrees_between(hit.normal, out));
    }
    std::printf("radius %g: place %.5f voxel, normal %.3f degrees\n", radius, worst_place, worst_normal);
    EXPECT_LE(worst_place, 0.4 / radius + 0.0025) << radius;
    EXPECT_LE(worst_normal, 60 / radius + 0.3) << radius;
  }
}

TEST(Contours, LetNoRayIntoABallThroughACrack) {
  // Deeper than the planes' error, a point is solid by its own voxel's plane: any ray to it has hit before.
  for (const ContourShape shape : {ContourShape::planes, ContourShape::field})
    for (const double radius : {3.0, 9.0, 30.0}) {
      const Ball ball({0.3, -0.2, 0.45}, radius);
      const ContourWalker walker(*ball.contours, shape);
      const double error = 0.4 / radius + 0.0025;
      int passed = 0, deep = 0;
      for (uint64_t i = 0; i < 100000; ++i) {
        const double depth = error + (radius - error) * std::pow(uniform(i, 9), 6);  // mostly just below the surface
        const GridRay ray = ray_to_depth(ball, i, depth);
        const ContourHit hit = walker.first_hit(ray);
        const Vec3d aim = ball.centre + (ball.radius - depth) * unit_vector(i, 2);
        const double t_aim = glm::dot(aim - place(ray, 0), ray.direction);
        passed += !hit.hit() || hit.grid.t > t_aim + 1e-9;
        deep += hit.hit() && glm::length(place(ray, hit.grid.t) - ball.centre) < radius - 2 * error;
      }
      EXPECT_EQ(passed, 0) << "radius " << radius;
      EXPECT_EQ(deep, 0) << "radius " << radius;
    }
}

TEST(ContourField, MeetsASphereOfALevelSetWhereOpenVdbDoes) {
  // ../shared/data/FACTS.md, "Level-set sphere hits": the middle of voxel i is OpenVDB's index i. Tolerance 1e-6 m.
  struct Row {
    int axis;
    double voxel_size, half_width, eye, t;
  };
  for (const Row& row : {Row{0, 0.5, 2, 2, 13}, Row{1, 1.5, 2, -2, 17}, Row{2, 1.0, 3, 4, 11}}) {
    FloatLayer distance;
    MaskVolume blocks;
    Vec3d centre(0.0);
    centre[row.axis] = 20 / row.voxel_size;
    const int reach = static_cast<int>(5 / row.voxel_size + row.half_width + 2);
    const LeafPos middle = leaf_from_voxel(WorldPoint::from(centre.x, centre.y, centre.z).voxel);
    for (int x = middle.x - reach / 8 - 1; x <= middle.x + reach / 8 + 1; ++x)
      for (int y = middle.y - reach / 8 - 1; y <= middle.y + reach / 8 + 1; ++y)
        for (int z = middle.z - reach / 8 - 1; z <= middle.z + reach / 8 + 1; ++z) {
          LeafMask mask;
          for (int i = 0; i < kLeafVoxels; ++i) {
            const VoxelPos v = voxel_from_leaf({x, y, z}) + offset_in_leaf(i);
            const float d = static_cast<float>(glm::length(Vec3d(v.x, v.y, v.z) - centre) - 5 / row.voxel_size);
            if (std::abs(d) < row.half_width) distance.set(v, d);
            if (d <= 0) mask.set(i);
          }
          blocks.set_leaf({x, y, z}, mask);
        }
    const Contours contours(blocks, level_set_surface(distance), true);
    const ContourWalker walker(contours, ContourShape::field);
    for (const double zero : {0.0, -0.0}) {
      Vec3d eye(0.5), direction(zero);
      eye[row.axis] = row.eye / row.voxel_size + 0.5;
      direction[row.axis] = 1;
      const GridRay ray(WorldPoint::from(eye.x, eye.y, eye.z), direction);
      const ContourHit hit = walker.first_hit(ray);
      ASSERT_TRUE(hit.hit());
      EXPECT_NEAR(hit.grid.t * row.voxel_size, row.t, 1e-6);
      EXPECT_LE(degrees_between(hit.normal, -direction), 1e-4);
    }
  }
}

TEST(ContourField, MeetsTheTrilinearFieldAtItsZero) {
  const Ball ball({0.3, -0.2, 0.45}, 9);
  const ContourWalker walker(*ball.contours, ContourShape::field);
  const auto trilinear = [&](const Vec3d& p) {
    const Vec3d q = p - 0.5, low = glm::floor(q), f = q - low;
    double sum = 0;
    for (int i = 0; i < 8; ++i) {
      const VoxelPos v{int(low.x) + (i >> 2), int(low.y) + (i >> 1 & 1), int(low.z) + (i & 1)};
      sum += ball.value(v) * (i >> 2 ? f.x : 1 - f.x) * (i >> 1 & 1 ? f.y : 1 - f.y) * (i & 1 ? f.z : 1 - f.z);
    }
    return sum;
  };
  for (uint64_t i = 0; i < 20000; ++i) {
    const GridRay ray = ray_to_depth(ball, i, 0.5);
    const ContourHit hit = walker.first_hit(ray);
    ASSERT_TRUE(hit.hit()) << i;
    EXPECT_NEAR(trilinear(place(ray, hit.grid.t)), 0, 1e-11) << i;
    // Nothing of the solid lies before it: 64 places on the last 4 voxels.
    for (int k = 1; k <= 64; ++k) ASSERT_GT(trilinear(place(ray, hit.grid.t - k / 16.0)), -1e-11) << i;
  }
}

TEST(Contours, ShadowRaysLeaveAConvexSurfaceUnblocked) {
  const Ball ball({0.3, -0.2, 0.45}, 9);
  for (const ContourShape shape : {ContourShape::planes, ContourShape::field}) {
    const ContourWalker walker(*ball.contours, shape);
    int blocked = 0, inwards_free = 0, inwards = 0;
    for (uint64_t i = 0; i < 50000; ++i) {
      const GridRay ray = ray_to_depth(ball, i, 3);
      const ContourHit hit = walker.first_hit(ray);
      ASSERT_TRUE(hit.hit());
      const Vec3d direction = unit_vector(i, 5);
      const double cosine = glm::dot(direction, hit.normal);
      // Planes are tilted by up to 7 degrees here.
      if (cosine > 0.15) blocked += walker.blocked(ray, hit, direction, ball.blocks);
      if (cosine < -0.6) ++inwards, inwards_free += !walker.blocked(ray, hit, direction, ball.blocks);
    }
    EXPECT_EQ(blocked, 0);
    EXPECT_GT(inwards, 1000);
    EXPECT_EQ(inwards_free, 0);
  }
}

TEST(Contours, WhereSomebodyBuiltOrDugBlocksArePlainCubes) {
  Ball ball({0.5, 0.5, 0.5}, 9);
  // A block on top of the pole, and one gone at the side.
  const VoxelPos built{0, 10, 0}, dug{9, 0, 0};
  const auto put = [&](VoxelPos v, bool set) {
    LeafMask mask = ball.blocks.leaf(leaf_from_voxel(v));
    if (set)
      mask.set(index_in_leaf(v));
    else
      mask.clear(index_in_leaf(v));
    ball.blocks.set_leaf(leaf_from_voxel(v), mask);
    const LeafPos leaf = leaf_from_voxel(v);
    ball.contours->update({&leaf, 1});
  };
  put(built, true), put(dug, false);
  const ContourWalker walker(*ball.contours, ContourShape::planes);
  const ContourHit top = walker.first_hit({WorldPoint::from(0.5, 20.25, 0.5), {0, -1, 0}});
  EXPECT_EQ(top.grid.voxel, built);
  EXPECT_EQ(top.grid.t, 9.25);
  EXPECT_FALSE(top.smooth);
  const ContourHit side = walker.first_hit({WorldPoint::from(20.25, 0.5, 0.5), {-1, 0, 0}});
  EXPECT_EQ(side.grid.voxel, (VoxelPos{8, 0, 0}));
  EXPECT_EQ(side.normal, Vec3d(1, 0, 0));

  // Undone, all is as it was built first.
  put(built, false), put(dug, true);
  const Ball fresh({0.5, 0.5, 0.5}, 9);
  ASSERT_EQ(ball.contours->leaves(), fresh.contours->leaves());
  for (int x = -16; x < 16; ++x)
    for (int y = -16; y < 16; ++y)
      for (int z = -16; z < 16; ++z) {
        ASSERT_EQ(ball.contours->plane({x, y, z}), fresh.contours->plane({x, y, z}));
        ASSERT_EQ(ball.contours->cells().test({x, y, z}), fresh.contours->cells().test({x, y, z}));
      }
}

TEST(Contours, OfADensityLieAtTheIsoValueAndThinnerBlocksVanish) {
  FloatLayer density;
  MaskVolume blocks;
  LeafMask mask;
  for (int i = 0; i < kLeafVoxels; ++i) {
    const VoxelPos v = offset_in_leaf(i);
    // 1 at y = 0.5, less by 0.125 a voxel: 0.5 at y = 4.5.
    density.set(v, 1 - 0.125f * v.y);
    mask.set(i);
  }
  blocks.set_leaf({0, 0, 0}, mask);
  const Contours contours(blocks, density_surface(density, 0.45f), true);
  for (const ContourShape shape : {ContourShape::planes, ContourShape::field}) {
    const ContourHit hit = ContourWalker(contours, shape).first_hit({WorldPoint::from(4.3, 20, 4.2), {0, -1, 0}});
    ASSERT_TRUE(hit.smooth);
    EXPECT_NEAR(hit.grid.t, 20 - 4.9, 1e-6 + (shape == ContourShape::planes ? kOffsetError : 0));
    EXPECT_LE(degrees_between(hit.normal, {0, 1, 0}), 1e-3);
  }
}

}  // namespace
}  // namespace world
