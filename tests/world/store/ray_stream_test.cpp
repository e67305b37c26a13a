#include "world/store/ray_stream.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "world/base/random.h"
#include "world/base/simd.h"

namespace world {
namespace {

double draw(uint64_t seed, uint64_t i, uint64_t stream) {
  return uniform01_double(random_bits(seed, static_cast<int64_t>(i), 0, 0, 0, stream));
}

/// Leaves of all kinds (empty, full, mixed thin and thick) in a box of 3x2x3 regions with its corner at `corner`.
MaskVolume random_volume(uint64_t seed, RegionPos corner, double density) {
  MaskVolume volume;
  const LeafPos first = leaf_from_region(corner);
  for (int n = 0; n < 400; ++n) {
    const auto at = [&](int range, uint64_t stream) { return static_cast<int32_t>(draw(seed, n, stream) * range); };
    const LeafPos l = first + LeafPos{at(48, 0), at(32, 1), at(48, 2)};
    LeafMask mask;
    const double kind = draw(seed, n, 3);
    if (kind < 0.2) {
      mask = kAllMask;
    } else {
      for (int i = 0; i < kLeafVoxels; ++i)
        if (draw(seed, n * 512 + i, 4) < (kind < 0.6 ? density : 0.5)) mask.set(i);
    }
    volume.set_leaf(l, mask);
  }
  return volume;
}

/// Rays of every awkward kind: along axes and diagonals, from corners, edges and faces, tiny components, long and
/// short.
std::vector<GridRay> random_rays(uint64_t seed, VoxelPos corner, int count) {
  std::vector<GridRay> rays;
  for (int i = 0; i < count; ++i) {
    GridRay ray;
    for (int a = 0; a < 3; ++a) {
      const int extent = a == 1 ? 256 : 384;
      ray.voxel[a] = corner[a] + static_cast<int32_t>(draw(seed, i, a) * (extent + 100)) - 50;
      ray.fraction[a] = draw(seed, i, 3 + a);
      ray.direction[a] = 2 * draw(seed, i, 6 + a) - 1;
      const double kind = draw(seed, i, 9 + a);
      if (kind < 0.2) ray.fraction[a] = std::floor(kind * 15) / 2;  // 0, 1/2, 1
      if (kind > 0.7) ray.direction[a] = std::floor(draw(seed, i, 12 + a) * 5) / 2 - 1;
      if (kind > 0.97) ray.direction[a] = draw(seed, i, 12 + a) < 0.5 ? 1e-30 : -1e-9;
    }
    if (draw(seed, i, 15) < 0.3) ray.t_max = 200 * draw(seed, i, 16);
    if (draw(seed, i, 17) < 0.1) ray.direction *= 1e5;
    rays.push_back(ray);
  }
  return rays;
}

::testing::AssertionResult same_hit(const GridHit& a, const GridHit& b) {
  if (a.hit() != b.hit()) return ::testing::AssertionFailure() << "one hits, the other doesn't";
  if (a.hit() && (a.voxel != b.voxel || a.face != b.face || a.t != b.t))
    return ::testing::AssertionFailure() << "hits differ: t " << a.t << " and " << b.t << ", faces " << a.face
                                         << " and " << b.face;
  return ::testing::AssertionSuccess();
}

void expect_exact(const MaskVolume& volume, const std::vector<GridRay>& rays, double most_exact_walks) {
  const RayStream stream(volume);
  ASSERT_TRUE(stream.bricks().walkable());
  const MaskWalker walker(volume);
  std::vector<GridHit> hits(rays.size()), packed(rays.size());
  StreamReport report;
  stream.first_set(rays, hits, &report);
  stream.first_set_coherent(rays, packed);
  size_t met = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    const GridHit exact = walker.first_set(rays[i]);
    met += exact.hit();
    ASSERT_TRUE(same_hit(hits[i], exact)) << "ray " << i;
    ASSERT_TRUE(same_hit(packed[i], exact)) << "ray " << i << ", in a packet";
  }
  EXPECT_GT(met, rays.size() / 20);
  EXPECT_LT(met, rays.size());
  EXPECT_LE(static_cast<double>(report.exact), most_exact_walks * static_cast<double>(rays.size()));
}

TEST(RayStream, HitsOfAwkwardRaysAreThoseOfTheExactWalkAtEverySimdLevel) {
  const MaskVolume volume = random_volume(1, {-1, 0, -2}, 0.02);
  const std::vector<GridRay> rays = random_rays(2, {-128, 0, -256}, 20000);
  for (const SimdLevel& level : simd_levels()) {
    const SimdChoice choice(level);
    SCOPED_TRACE(level.name);
    expect_exact(volume, rays, 0.7);  // of these rays, a third start outside and a third at corners
  }
}

// T12, and hits 1e8 m from the origin are those at home: all arithmetic is relative to the ray's start.
TEST(RayStream, HitsAHundredMillionMetresAwayAreThoseOfTheExactWalk) {
  const RegionPos far{781250, -3, -781251};  // 1e8 m
  expect_exact(random_volume(3, far, 0.02), random_rays(4, voxel_from_region(far), 20000), 0.7);
}

TEST(RayStream, NearlyAllOrdinaryRaysNeedNoExactWalk) {
  const MaskVolume volume = random_volume(5, {0, 0, 0}, 0.02);
  std::vector<GridRay> rays;
  for (int i = 0; i < 20000; ++i) {
    GridRay ray;
    for (int a = 0; a < 3; ++a) {
      ray.voxel[a] = 20 + static_cast<int32_t>(draw(6, i, a) * 200);
      ray.fraction[a] = draw(6, i, 3 + a);
      ray.direction[a] = 2 * draw(6, i, 6 + a) - 1;
    }
    rays.push_back(ray);
  }
  expect_exact(volume, rays, 0.02);
}

/// 64 rays that run alike: a pinhole's, parallel ones, and ones from near each other.
TEST(RayStream, PacketsOfEveryKindHitWhatTheExactWalkHits) {
  const MaskVolume volume = random_volume(7, {0, 0, 0}, 0.03);
  const RayStream stream(volume);
  const MaskWalker walker(volume);
  size_t met = 0, lanes = 0, total = 0;
  for (int packet = 0; packet < 1500; ++packet) {
    std::vector<GridRay> rays;
    Vec3d lead;
    for (int a = 0; a < 3; ++a) lead[a] = 2 * draw(8, packet, a) - 1;
    if (packet % 5 == 0) lead[packet / 5 % 3] = 0;
    if (packet % 7 == 0) lead = Vec3d(packet % 2 ? 1 : -1, packet % 3 - 1, 1);
    const double spread = packet % 3 == 0 ? 0 : 0.1 * draw(8, packet, 3);
    for (int i = 0; i < 64; ++i) {
      GridRay ray;
      for (int a = 0; a < 3; ++a) {
        const int apart = packet % 3 == 1 ? 0 : 6;
        ray.voxel[a] = 30 + static_cast<int32_t>(draw(8, packet, 4 + a) * 200 + apart * draw(9, packet * 64 + i, a));
        ray.fraction[a] = packet % 3 == 1 ? draw(8, packet, 7 + a) : packet % 4 ? draw(9, packet * 64 + i, 3 + a) : 0;
        ray.direction[a] = lead[a] + spread * (2 * draw(9, packet * 64 + i, 6 + a) - 1);
      }
      if (packet % 11 == 0) ray.t_max = 100 * draw(9, packet * 64 + i, 9);
      rays.push_back(ray);
    }
    std::vector<GridHit> hits(rays.size());
    StreamReport report;
    stream.first_set_coherent(rays, hits, &report);
    lanes += report.steps > 0, total += 1;
    for (size_t i = 0; i < rays.size(); ++i) {
      const GridHit exact = walker.first_set(rays[i]);
      met += exact.hit();
      ASSERT_TRUE(same_hit(hits[i], exact)) << "packet " << packet << " ray " << i;
    }
  }
  EXPECT_GT(met, 10000u);
  EXPECT_LT(lanes, total);  // most never fall back to lanes
}

TEST(RayStream, RaysInFloatsHitWhatTheSameRaysInDoublesHit) {
  const MaskVolume volume = random_volume(15, {0, 0, 0}, 0.02);
  const RayStream stream(volume);
  const MaskWalker walker(volume);
  std::vector<StreamRay> rays;
  for (const GridRay& ray : random_rays(16, {0, 0, 0}, 5000)) {
    rays.push_back({ray.voxel, Vec3f(ray.fraction), Vec3f(ray.direction)});
    if (ray.t_max < kInfinity) rays.back().t_max = static_cast<float>(ray.t_max);
  }
  std::vector<GridHit> hits(rays.size()), packed(rays.size());
  std::vector<uint8_t> blocked(rays.size());
  stream.first_set(rays, hits);
  stream.first_set_coherent(rays, packed);
  stream.any_set_coherent(rays, blocked);
  for (size_t i = 0; i < rays.size(); ++i) {
    const GridHit exact = walker.first_set(rays[i]);
    ASSERT_TRUE(same_hit(hits[i], exact)) << i;
    ASSERT_TRUE(same_hit(packed[i], exact)) << i;
    ASSERT_EQ(blocked[i] != 0, exact.hit()) << i;
  }
}

TEST(RayStream, BlockedSaysWhetherThereIsAHit) {
  const MaskVolume volume = random_volume(10, {0, 0, 0}, 0.02);
  const RayStream stream(volume);
  const std::vector<GridRay> rays = random_rays(11, {0, 0, 0}, 3000);
  std::vector<GridHit> hits(rays.size());
  std::vector<uint8_t> blocked(rays.size());
  stream.first_set(rays, hits);
  stream.any_set(rays, blocked);
  for (size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(blocked[i] != 0, hits[i].hit()) << i;
}

TEST(RayStream, AnEmptyVolumeAndBadRaysHitNothing) {
  const MaskVolume empty;
  const RayStream nothing(empty);
  const MaskVolume volume = random_volume(12, {0, 0, 0}, 0.02);
  const RayStream stream(volume);
  std::vector<GridRay> rays(40);
  for (size_t i = 0; i < rays.size(); ++i) {
    rays[i] = {WorldPoint::from(100, 100, 100), Vec3d(1, 0.5, 0.25)};
    if (i % 4 == 1) rays[i].direction[i % 3] = std::nan("");
    if (i % 4 == 2) rays[i].fraction[i % 3] = i % 8 ? std::nan("") : kInfinity;
    if (i % 4 == 3) rays[i].direction = Vec3d(i % 8 == 3 ? kInfinity : 0.0);
  }
  std::vector<GridHit> hits(rays.size());
  nothing.first_set(rays, hits);
  for (const GridHit& hit : hits) EXPECT_FALSE(hit.hit());
  stream.first_set(rays, hits);
  std::vector<GridHit> packed(rays.size());
  stream.first_set_coherent(rays, packed);
  const MaskWalker walker(volume);
  for (size_t i = 0; i < rays.size(); ++i) {
    EXPECT_TRUE(same_hit(hits[i], walker.first_set(rays[i]))) << i;
    EXPECT_TRUE(same_hit(packed[i], walker.first_set(rays[i]))) << i;
  }
}

// One ray that is no ray takes nothing from those beside it.
TEST(RayStream, ABadRayInAPacketLeavesTheOthersRight) {
  const MaskVolume volume = random_volume(17, {0, 0, 0}, 0.02);
  const RayStream stream(volume);
  const MaskWalker walker(volume);
  for (int kind = 0; kind < 12; ++kind) {
    std::vector<GridRay> rays(64);
    for (size_t i = 0; i < rays.size(); ++i)
      rays[i] = {WorldPoint::from(60 + 0.9 * double(i % 8), 64 + 0.9 * double(i / 8), 4), Vec3d(0.02, 0.01, 1)};
    GridRay& bad = rays[static_cast<size_t>(kind * 5)];
    if (kind < 3)
      bad.fraction[kind] = std::nan("");
    else if (kind < 6)
      bad.direction[kind - 3] = std::nan("");
    else if (kind < 9)
      bad.voxel[kind - 6] += 1 << 29;
    else
      bad.fraction[kind - 9] = -1e30;
    std::vector<GridHit> hits(rays.size());
    stream.first_set_coherent(rays, hits);
    for (size_t i = 0; i < rays.size(); ++i)
      ASSERT_TRUE(same_hit(hits[i], walker.first_set(rays[i]))) << kind << " " << i;
  }
}

// The far side of an empty cube may lie beyond the last voxels; that a ray in floats comes out behind these says
// nothing.
TEST(RayStream, RaysThatGrazeTheLastVoxelsHitThem) {
  MaskVolume volume;
  volume.set_leaf({1, 4, 1}, kAllMask);  // 8..15, 32..39, 8..15, in front of an empty cube of 32
  const RayStream stream(volume);
  const MaskWalker walker(volume);
  std::vector<GridRay> rays;
  for (int i = 0; i < 20000; ++i) {
    const int edge_axis = i & 2, other = 2 - edge_axis;
    const bool high = i & 1;
    GridRay ray;
    for (int a = 0; a < 3; ++a) ray.fraction[a] = draw(18, i, a);
    ray.voxel[1] = static_cast<int32_t>(draw(18, i, 3) * 30);
    ray.voxel[edge_axis] =
        high ? static_cast<int32_t>(draw(18, i, 4) * 12) : 10 + static_cast<int32_t>(draw(18, i, 4) * 20);
    ray.voxel[other] = 10 + static_cast<int32_t>(draw(18, i, 5) * 4);
    Vec3d to;
    to[edge_axis] = (high ? 16 : 8) + 4e-6 * (draw(18, i, 6) - 0.5), to[1] = 32, to[other] = 12;
    ray.direction = to - ray.fraction - Vec3d(ray.voxel.x, ray.voxel.y, ray.voxel.z);
    rays.push_back(ray);
  }
  for (const SimdLevel& level : simd_levels()) {
    const SimdChoice choice(level);
    SCOPED_TRACE(level.name);
    std::vector<GridHit> hits(rays.size());
    stream.first_set(rays, hits);
    size_t met = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
      const GridHit exact = walker.first_set(rays[i]);
      met += exact.hit();
      ASSERT_TRUE(same_hit(hits[i], exact)) << "ray " << i;
    }
    EXPECT_GT(met, rays.size() / 3);
    EXPECT_LT(met, rays.size() * 2 / 3);
  }
}

// Each list of what must be walked in double may fill up to its end.
TEST(RayStream, RaysThatAreAllUnsureHitWhatTheExactWalkHits) {
  const MaskVolume volume = random_volume(11, {0, 0, 0}, 0.02);
  const RayStream stream(volume);
  const MaskWalker walker(volume);
  for (const double tiny : {1e-30, 1e-15}) {
    std::vector<GridRay> rays;
    for (int i = 0; i < 10000; ++i)
      rays.push_back({{{20 + i % 200, 20 + i / 97 % 200, 20 + i / 50}, {0.5, 0.5, 1}}, {1, 0.3, i % 2 ? tiny : -tiny}});
    for (const SimdLevel& level : simd_levels()) {
      const SimdChoice choice(level);
      SCOPED_TRACE(level.name);
      std::vector<GridHit> hits(rays.size()), packed(rays.size());
      StreamReport report;
      stream.first_set(rays, hits, &report);
      stream.first_set_coherent(rays, packed);
      EXPECT_EQ(report.exact, rays.size());
      for (size_t i = 0; i < rays.size(); ++i) {
        const GridHit exact = walker.first_set(rays[i]);
        ASSERT_TRUE(same_hit(hits[i], exact)) << "ray " << i;
        ASSERT_TRUE(same_hit(packed[i], exact)) << "ray " << i << ", in a packet";
      }
    }
  }
}

// An edit changes no more than its leaf and the codes of the empty cube that held it, and gives what building gives.
TEST(BrickVolume, AfterAnyEditsItEqualsOneBuiltAnew) {
  MaskVolume volume = random_volume(13, {0, 0, 0}, 0.02);
  BrickVolume followed(volume);
  for (int edit = 0; edit < 3000; ++edit) {
    const auto at = [&](int range, uint64_t stream) { return static_cast<int32_t>(draw(14, edit, stream) * range); };
    const LeafPos l{at(48, 0), at(32, 1), at(48, 2)};
    LeafMask mask = volume.leaf(l);
    const double kind = draw(14, edit, 3);
    if (kind < 0.2)
      mask = kNoneMask;
    else if (kind < 0.3)
      mask = kAllMask;
    else if (kind < 0.7)
      mask.set(at(512, 4));
    else
      mask.clear(at(512, 5));
    volume.set_leaf(l, mask);
    followed.update(volume, l);
    if (edit % 300 != 0) continue;
    const BrickVolume fresh(volume);
    ASSERT_EQ(followed.mixed_leaves(), fresh.mixed_leaves());
    for (int x = 0; x < 48; ++x)
      for (int y = 0; y < 32; ++y)
        for (int z = 0; z < 48; ++z) {
          const uint32_t a = followed.code({x, y, z}), b = fresh.code({x, y, z});
          ASSERT_EQ(a & BrickVolume::kMixed, b & BrickVolume::kMixed) << x << " " << y << " " << z;
          const uint32_t compared = a & BrickVolume::kMixed ? ~BrickVolume::kFirstWord : ~0u;
          ASSERT_EQ(a & compared, b & compared) << x << " " << y << " " << z;
        }
    for (int i = 0; i < 5000; ++i) {
      const VoxelPos v{at(384, 10 + 3 * i), at(256, 11 + 3 * i), at(384, 12 + 3 * i)};
      ASSERT_EQ(followed.test(v), volume.test(v));
    }
  }
}

TEST(BrickVolume, HoldsAtMostThreeTenthsOfAByteAVoxelOfMixedLeaves) {
  MaskVolume volume;
  // Terrain: a surface through every column of leaves of a region, as deep as the region.
  for (int x = 0; x < 16; ++x)
    for (int z = 0; z < 16; ++z)
      for (int y = 0; y < 16; ++y) {
        LeafMask mask;
        for (int i = 0; i < kLeafVoxels; i += y < 7 ? 1 : y < 9 ? 3 : 1000) mask.set(i);
        if (y < 9) volume.set_leaf({x, y, z}, mask);
      }
  const BrickVolume bricks(volume);
  EXPECT_EQ(bricks.mixed_leaves(), 512u);
  EXPECT_LE(static_cast<double>(bricks.bytes()) / (512.0 * 512), 0.3);
}

}  // namespace
}  // namespace world
