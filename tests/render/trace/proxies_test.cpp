#include "render/trace/proxies.h"

#include <cmath>

#include <gtest/gtest.h>

#include "world/base/random.h"

namespace render {

namespace {

using world::GridRay;
using world::Proxy;
using world::ProxyBox;
using world::ProxyQuad;
using world::VoxelPos;
using world::WorldPoint;

constexpr VoxelPos kVoxel{3, -2, 5};

double random_at(int i, int k) { return world::uniform01_double(world::random_bits(11, i, k, 0)); }

Proxy box_proxy(std::vector<ProxyBox> boxes) {
  Proxy proxy;
  proxy.boxes = std::move(boxes);
  proxy.finish();
  return proxy;
}

/// The unit box cut at these planes of each axis.
Proxy cut_box(std::vector<float> cuts) {
  cuts.insert(cuts.begin(), 0.0f), cuts.push_back(1.0f);
  std::vector<ProxyBox> boxes;
  for (size_t x = 0; x + 1 < cuts.size(); ++x)
    for (size_t y = 0; y + 1 < cuts.size(); ++y)
      for (size_t z = 0; z + 1 < cuts.size(); ++z)
        boxes.push_back({{cuts[x], cuts[y], cuts[z]}, {cuts[x + 1], cuts[y + 1], cuts[z + 1]}});
  return box_proxy(boxes);
}

WorldPoint in_voxel(const Vec3d& p) { return WorldPoint::from(kVoxel.x + p.x, kVoxel.y + p.y, kVoxel.z + p.z); }

/// From all around towards points of the voxel; every third of them on planes at multiples of 1/8 on one axis or more,
/// every fourth along an axis, so that rays run through edges and corners and in planes.
GridRay ray_towards_voxel(int i) {
  Vec3d target, from;
  for (int a = 0; a < 3; ++a) {
    target[a] = random_at(i, a) * 1.2 - 0.1;
    from[a] = random_at(i, a + 3) * 20 - 10;
    if (i % 3 == 0 && random_at(i, a + 6) < 0.6) target[a] = std::round(target[a] * 8) / 8;
    if (i % 3 == 0) from[a] = std::round(from[a] * 8) / 8;
    if (i % 4 == 0 && random_at(i, a + 9) < 0.5) from[a] = target[a];
  }
  return GridRay(in_voxel(from), target - from);
}

}  // namespace

TEST(IntersectProxy, AUnitBoxIsMetAsTheGridWalkEntersItsVoxel) {
  const Proxy unit = box_proxy({ProxyBox{}});
  int hits = 0;
  for (int i = 0; i < 20000; ++i) {
    const GridRay ray = ray_towards_voxel(i);
    const world::GridHit walked = world::first_hit_flat(
        [&] {
          GridRay limited = ray;
          limited.t_max = 3;
          return limited;
        }(),
        [](VoxelPos v) { return v == kVoxel; });
    if (ray.voxel == kVoxel || !walked.hit()) continue;
    ProxyHit hit;
    ASSERT_TRUE(intersect_proxy(unit, 0, ray, kVoxel, world::kInfinity, hit)) << i;
    EXPECT_EQ(hit.t, walked.t) << i;
    EXPECT_EQ(hit.normal[world::face_axis(walked.face)], world::face_sign(walked.face)) << i;
    EXPECT_FALSE(hit.inside);
    ++hits;
  }
  EXPECT_GT(hits, 5000);
}

TEST(IntersectProxy, BoxesThatTouchAreOneAndLetNoRayThrough) {
  const Proxy unit = box_proxy({ProxyBox{}}), cut = cut_box({0.375f, 0.5f});
  int hits = 0, inside = 0;
  for (int i = 0; i < 20000; ++i) {
    const GridRay ray = ray_towards_voxel(i);
    ProxyHit one, many;
    const bool hit = intersect_proxy(unit, 0, ray, kVoxel, world::kInfinity, one);
    ASSERT_EQ(intersect_proxy(cut, 0, ray, kVoxel, world::kInfinity, many), hit) << i;
    if (!hit) continue;
    EXPECT_EQ(many.t, one.t) << i;
    EXPECT_EQ(many.normal, one.normal) << i;
    EXPECT_EQ(many.inside, one.inside) << i;
    ++hits, inside += one.inside;
  }
  EXPECT_GT(hits, 8000);
  EXPECT_GT(inside, 10);
}

TEST(IntersectProxy, FromWithinBoxesThatOverlapARayLeavesAllOfThem) {
  // A bar along x in three pieces that overlap, off the middle so that rays leave through every side.
  const Proxy bar = box_proxy({{{0.0f, 0.25f, 0.25f}, {0.5f, 0.75f, 0.75f}},
                               {{0.375f, 0.25f, 0.25f}, {0.75f, 0.75f, 0.75f}},
                               {{0.5f, 0.25f, 0.25f}, {1.0f, 0.75f, 0.75f}}});
  const Proxy whole = box_proxy({{{0.0f, 0.25f, 0.25f}, {1.0f, 0.75f, 0.75f}}});
  for (int i = 0; i < 5000; ++i) {
    Vec3d start, direction;
    for (int a = 0; a < 3; ++a) {
      start[a] = a == 0 ? 0.01 + 0.98 * random_at(i, a) : 0.26 + 0.48 * random_at(i, a);
      direction[a] = random_at(i, a + 3) - 0.5;
    }
    const GridRay ray(in_voxel(start), direction);
    ProxyHit many, one;
    ASSERT_TRUE(intersect_proxy(whole, 0, ray, kVoxel, world::kInfinity, one));
    ASSERT_TRUE(intersect_proxy(bar, 0, ray, kVoxel, world::kInfinity, many)) << i;
    EXPECT_TRUE(one.inside && many.inside);
    EXPECT_EQ(many.t, one.t) << i;
    EXPECT_EQ(many.normal, one.normal) << i;
    EXPECT_GT(dot(Vec3d(one.normal), direction), 0);
  }
}

TEST(IntersectProxy, ThePointLiesOnTheSurfaceWithinItsError) {
  for (const Proxy& proxy : world::proxies())
    for (int i = 0; i < 3000; ++i) {
      const GridRay ray = ray_towards_voxel(i);
      ProxyHit hit;
      if (!intersect_proxy(proxy, 63, ray, kVoxel, world::kInfinity, hit)) continue;
      // The point against the ray in long double.
      for (int a = 0; a < 3; ++a) {
        const long double along = static_cast<long double>(hit.t) * ray.direction[a];
        const long double at = static_cast<long double>(ray.voxel[a] - kVoxel[a]) + ray.fraction[a] + along;
        // t itself errs by three roundings of the distance along its own axis: its part of `along` is at most that.
        const double rounding = 8 * 0x1p-53 * (std::abs(static_cast<double>(along)) + 21);
        EXPECT_NEAR(static_cast<double>(at), hit.point[a], hit.error[a] + rounding) << proxy.name << ' ' << i;
      }
      EXPECT_NEAR(length(hit.normal), 1, 1e-6);
      if (static_cast<size_t>(hit.part) >= proxy.boxes.size()) continue;
      const ProxyBox& box = proxy.boxes[static_cast<size_t>(hit.part)];
      for (int a = 0; a < 3; ++a) {
        EXPECT_TRUE(hit.point[a] >= box.low[a] && hit.point[a] <= box.high[a]);
        if (hit.normal[a] == 0) continue;
        EXPECT_EQ(hit.point[a], hit.normal[a] > 0 ? box.high[a] : box.low[a]);
        EXPECT_EQ(hit.error[a], 0);
      }
    }
}

TEST(IntersectProxy, ARayThatLeavesASurfaceDoesNotMeetItAgain) {
  int spawned = 0;
  for (const Proxy& proxy : world::proxies())
    for (int i = 0; i < 3000; ++i) {
      ProxyHit first;
      if (!intersect_proxy(proxy, 63, ray_towards_voxel(i), kVoxel, world::kInfinity, first) || first.inside) continue;
      Vec3d direction(random_at(i, 20) - 0.5, random_at(i, 21) - 0.5, random_at(i, 22) - 0.5);
      const bool flat = static_cast<size_t>(first.part) >= proxy.boxes.size();
      if (!flat && dot(direction, Vec3d(first.normal)) < 0) direction = -direction;
      GridRay next;
      next.voxel = kVoxel, next.fraction = first.point, next.direction = direction;
      ++spawned;
      ProxyHit second;
      if (!intersect_proxy(proxy, 63, next, kVoxel, world::kInfinity, second, first.part)) continue;
      EXPECT_NE(second.part, first.part) << proxy.name << ' ' << i;
      EXPECT_FALSE(second.inside) << proxy.name << ' ' << i;
    }
  EXPECT_GT(spawned, 2000);
}

TEST(IntersectProxy, ARayThatEntersABoxFromItsSurfaceIsInside) {
  const Proxy unit = box_proxy({{{0.25f, 0.25f, 0.25f}, {0.75f, 0.75f, 0.75f}}});
  const GridRay down(in_voxel(Vec3d(0.5, 2, 0.5)), Vec3d(0, -1, 0));
  ProxyHit top, bottom;
  ASSERT_TRUE(intersect_proxy(unit, 0, down, kVoxel, world::kInfinity, top));
  EXPECT_EQ(top.t, 1.25);
  GridRay on;
  on.voxel = kVoxel, on.fraction = top.point, on.direction = down.direction;
  ASSERT_TRUE(intersect_proxy(unit, 0, on, kVoxel, world::kInfinity, bottom, top.part));
  EXPECT_EQ(bottom.t, 0.5);
  EXPECT_TRUE(bottom.inside);
  EXPECT_EQ(bottom.normal, Vec3f(0, -1, 0));
  // One that merely arrives there is not.
  ASSERT_TRUE(intersect_proxy(unit, 0, on, kVoxel, world::kInfinity, bottom));
  EXPECT_EQ(bottom.t, 0);
  EXPECT_FALSE(bottom.inside);
}

TEST(IntersectProxy, QuadsThatShareAnEdgeLetNoRayThroughAndAreSeenFromBothSides) {
  // A roof whose ridge runs askew.
  Proxy roof;
  roof.quads = {{{0, 0, 0}, {0.5f, 0.7f, 0.1f}, {0, 0.1f, 0.8f}},
                {{0.5f, 0.7f, 0.1f}, {0.4f, -0.6f, 0}, {0, 0.1f, 0.8f}}};
  roof.finish();
  const Vec3d ridge(0.5f, 0.7f, 0.1f), along(0, 0.1f, 0.8f);
  for (int i = 0; i < 20000; ++i) {
    const Vec3d target = ridge + random_at(i, 0) * along;
    const double side = i % 2 ? 1 : -1;
    const Vec3d from = target + Vec3d(0.4 * random_at(i, 1) - 0.2, side * (1 + random_at(i, 2)), 0);
    const GridRay ray(in_voxel(from), target - from);
    ProxyHit hit;
    ASSERT_TRUE(intersect_proxy(roof, 0, ray, kVoxel, world::kInfinity, hit)) << i;
    EXPECT_NEAR(hit.t, 1, 1e-6);
  }
}

TEST(IntersectProxy, IsTheSameAtAnyDistanceFromTheOrigin) {
  for (const Proxy& proxy : world::proxies())
    for (int i = 0; i < 1000; ++i) {
      GridRay ray = ray_towards_voxel(i);
      ProxyHit here, far;
      const bool hit = intersect_proxy(proxy, 63, ray, kVoxel, world::kInfinity, here);
      const VoxelPos moved{900'000'000, -1'000'000'000, 100'000'007};
      ray.voxel = ray.voxel + moved;
      ASSERT_EQ(intersect_proxy(proxy, 63, ray, kVoxel + moved, world::kInfinity, far), hit);
      if (!hit) continue;
      EXPECT_EQ(far.t, here.t);
      EXPECT_EQ(far.point, here.point);
      EXPECT_EQ(far.normal, here.normal);
    }
}

TEST(IntersectProxy, AMeetingAtTheLimitCountsAndOneBeyondDoesNot) {
  const Proxy& torch = *world::find_proxy("torch");
  const GridRay down(in_voxel(Vec3d(0.5, 2, 0.5)), Vec3d(0, -1, 0));
  ProxyHit hit;
  EXPECT_TRUE(intersect_proxy(torch, 0, down, kVoxel, 1.3125, hit));
  EXPECT_EQ(hit.t, 1.3125);
  EXPECT_FALSE(intersect_proxy(torch, 0, down, kVoxel, 1.3124, hit));
  EXPECT_FALSE(intersect_proxy(torch, 0, GridRay(down), kVoxel + VoxelPos{1, 0, 0}, world::kInfinity, hit));
}

TEST(IntersectProxy, PartsAreThereOnlyWhereTheyJoin) {
  const Proxy& fence = *world::find_proxy("fence");
  const GridRay through(in_voxel(Vec3d(0.8, 0.45, 2)), Vec3d(0, 0, -1));  // where the lower rail to +x would be
  ProxyHit hit;
  EXPECT_FALSE(intersect_proxy(fence, 0, through, kVoxel, world::kInfinity, hit));
  EXPECT_FALSE(intersect_proxy(fence, 1 << world::kFaceNegX, through, kVoxel, world::kInfinity, hit));
  ASSERT_TRUE(intersect_proxy(fence, 1 << world::kFacePosX, through, kVoxel, world::kInfinity, hit));
  EXPECT_EQ(hit.normal, Vec3f(0, 0, 1));
}

TEST(IntersectProxy, NoDirectionMeetsNothing) {
  for (const Proxy& proxy : world::proxies())
    for (const Vec3d& start : {Vec3d(0.5, 0.25, 0.5), Vec3d(-1, 0, 0)}) {
      ProxyHit hit;
      EXPECT_FALSE(intersect_proxy(proxy, 0, GridRay(in_voxel(start), Vec3d(0)), kVoxel, world::kInfinity, hit))
          << proxy.name;
    }
}

}  // namespace render
