#include "world/store/parallel_rays.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "world/base/jobs.h"
#include "world/base/random.h"
#include "world/base/simd.h"

namespace world {
namespace {

double draw(uint64_t seed, uint64_t i, uint64_t stream) {
  return uniform01_double(random_bits(seed, static_cast<int64_t>(i), 0, 0, 0, stream));
}

/// Hills with caves, single voxels above them, and holes to the bottom, in 128 x 64 x 128 voxels.
MaskVolume hills(uint64_t seed, LeafPos corner) {
  MaskVolume volume;
  for (int x = 0; x < 16; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 16; ++z) {
        LeafMask mask;
        for (int i = 0; i < kLeafVoxels; ++i) {
          const int vx = x * 8 + (i >> 6), vy = y * 8 + (i >> 3 & 7), vz = z * 8 + (i & 7);
          const double height = 20 + 9 * std::sin(vx * 0.11) + 8 * std::cos(vz * 0.17 + vx * 0.05);
          const bool hole = (vx / 10 + vz / 7) % 9 == 0, cave = std::abs(vy - height + 9) < 2.5 && (vx + vz) % 29 < 14;
          const bool speck = draw(seed, static_cast<uint64_t>((vx * 64 + vy) * 128 + vz), 0) < 0.002;
          if ((vy < height && !hole && !cave) || speck) mask.set(i);
        }
        volume.set_leaf(corner + LeafPos{x, y, z}, mask);
      }
  return volume;
}

std::vector<Vec3d> directions() {
  std::vector<Vec3d> all{{0, 1, 0},          {0, -1, 0},        {1, 0, 0},        {0, 0, -1},
                         {1, 1, 1},          {-1, 1, 0},        {0.3, 0.9, -0.4}, {1, 0.02, 0.01},
                         {-0.01, -0.4, 0.9}, {0.5, -0.5, 0.25}, {1e-9, 1, 1e-20}, {-0.7, 0.1, -0.69}};
  for (Vec3d& d : all) d = Vec3d(Vec3f(glm::normalize(d)));
  return all;
}

/// Starts in and around the hills, many on faces, edges and corners of voxels; a few rays of other directions, of
/// finite length and bad ones.
std::vector<StreamRay> starts(uint64_t seed, const VoxelPos& corner, const Vec3d& direction, int count) {
  std::vector<StreamRay> rays;
  for (int i = 0; i < count; ++i) {
    StreamRay ray;
    for (int a = 0; a < 3; ++a) {
      const int extent = a == 1 ? 64 : 128;
      ray.voxel[a] = corner[a] + static_cast<int32_t>(draw(seed, i, a) * (extent + 24)) - 12;
      const double f = draw(seed, i, 3 + a);
      ray.fraction[a] = static_cast<float>(f < 0.3 ? std::floor(f * 10) / 2 : f);
    }
    ray.direction = Vec3f(direction);
    const double kind = draw(seed, i, 6);
    if (kind < 0.02) ray.direction = Vec3f(0.6f, 0.64f, -0.48f);
    if (kind > 0.98) ray.t_max = static_cast<float>(40 * draw(seed, i, 7));
    if (kind > 0.97 && kind < 0.975) ray.fraction.y = std::nanf("");
    if (kind > 0.96 && kind < 0.965) ray.voxel.x += 1 << 29;
    rays.push_back(ray);
  }
  return rays;
}

void expect_exact(const RayStream& stream, const ParallelRays& parallel, const std::vector<StreamRay>& rays,
                  double most_otherwise) {
  std::vector<uint8_t> blocked(rays.size(), 7), in_doubles(rays.size(), 7);
  StreamReport report;
  parallel.any_set(rays, blocked, &report);
  const std::vector<GridRay> grid(rays.begin(), rays.end());
  parallel.any_set(grid, in_doubles);
  size_t met = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    const bool exact = stream.walker().any_set(rays[i]);
    met += exact;
    ASSERT_EQ(blocked[i] != 0, exact) << "ray " << i << " from " << rays[i].voxel.x << " " << rays[i].voxel.y << " "
                                      << rays[i].voxel.z << " + " << rays[i].fraction.x << " " << rays[i].fraction.y
                                      << " " << rays[i].fraction.z << " along " << rays[i].direction.x << " "
                                      << rays[i].direction.y << " " << rays[i].direction.z << " to " << rays[i].t_max;
    ASSERT_EQ(in_doubles[i] != 0, exact) << "ray " << i << ", in doubles";
  }
  EXPECT_GT(met, rays.size() / 20);
  EXPECT_LT(met, rays.size());
  EXPECT_LE(static_cast<double>(report.exact), most_otherwise * static_cast<double>(rays.size()));
}

TEST(ParallelRays, SayOfEveryRayWhatTheExactWalkSaysAtEverySimdLevel) {
  for (const LeafPos& corner : {LeafPos{0, 0, 0}, LeafPos{12500000, -40, -12500003}}) {
    const MaskVolume volume = hills(1, corner);
    const RayStream stream(volume);
    for (const SimdLevel& level : simd_levels()) {
      const SimdChoice choice(level);
      for (const Vec3d& direction : directions()) {
        SCOPED_TRACE(level.name);
        SCOPED_TRACE(::testing::Message() << direction.x << " " << direction.y << " " << direction.z);
        const ParallelRays parallel(stream, direction);
        // Of these starts many lie on edges, where only the exact walk can tell.
        expect_exact(stream, parallel, starts(2, voxel_from_leaf(corner), direction, 2500), 0.7);
      }
    }
  }
}

// Generic starts: the map and the slabs decide nearly all.
TEST(ParallelRays, NearlyAllOrdinaryRaysNeedNoExactWalk) {
  const MaskVolume volume = hills(3, {0, 0, 0});
  const RayStream stream(volume);
  const Vec3d direction = Vec3d(Vec3f(glm::normalize(Vec3d(0.5, 0.8, 0.4))));
  const ParallelRays parallel(stream, direction);
  std::vector<StreamRay> rays;
  for (int i = 0; i < 20000; ++i) {
    StreamRay ray;
    for (int a = 0; a < 3; ++a) {
      ray.voxel[a] = static_cast<int32_t>(draw(4, i, a) * (a == 1 ? 64 : 128));
      ray.fraction[a] = static_cast<float>(draw(4, i, 3 + a));
    }
    ray.direction = Vec3f(direction);
    rays.push_back(ray);
  }
  expect_exact(stream, parallel, rays, 0.002);
}

// An edit gives what a map made anew gives; regions that widen the bounds too.
TEST(ParallelRays, FollowEdits) {
  MaskVolume volume = hills(5, {0, 0, 0});
  RayStream stream(volume);
  const Vec3d direction = Vec3d(Vec3f(glm::normalize(Vec3d(-0.6, 0.7, 0.5))));
  ParallelRays parallel(stream, direction);
  const std::vector<StreamRay> rays = starts(6, {0, 0, 0}, direction, 1500);
  for (int edit = 0; edit < 60; ++edit) {
    const auto at = [&](int range, uint64_t s) { return static_cast<int32_t>(draw(7, edit, s) * range); };
    LeafPos leaf{at(16, 0), at(8, 1), at(16, 2)};
    if (edit % 20 == 19) leaf = {at(16, 0), at(8, 1) + 20 * edit / 19, -at(16, 2) - 1};
    LeafMask mask = volume.leaf(leaf);
    const double kind = draw(7, edit, 3);
    if (kind < 0.3)
      mask = kNoneMask;
    else if (kind < 0.4)
      mask = kAllMask;
    else
      for (int i = 0; i < 20; ++i) mask.set(at(512, 4 + i));
    volume.set_leaf(leaf, mask);
    stream.update({&leaf, 1});
    parallel.update({&leaf, 1});
    expect_exact(stream, parallel, rays, 0.7);
  }
}

// Blocks of the map are made by whichever thread asks first, each once.
TEST(ParallelRays, MapAndAnswersAreTheSameOnAnyNumberOfThreads) {
  const MaskVolume volume = hills(8, {0, 0, 0});
  const RayStream stream(volume);
  const Vec3d direction = Vec3d(Vec3f(glm::normalize(Vec3d(0.5, 0.8, 0.4))));
  const std::vector<StreamRay> rays = starts(9, {0, 0, 0}, direction, 8192);
  const ParallelRays alone(stream, direction);
  std::vector<uint8_t> expected(rays.size());
  alone.any_set(rays, expected);
  for (const int threads : {1, 2, 3, 8}) {
    const ThreadLimit limit(threads);
    const ParallelRays together(stream, direction);
    std::vector<uint8_t> blocked(rays.size());
    parallel_ranges(128, 1, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i)
        together.any_set(std::span(rays).subspan(i * 64, 64), std::span(blocked).subspan(i * 64, 64));
    });
    EXPECT_EQ(blocked, expected) << threads;
    EXPECT_EQ(together.bytes(), alone.bytes()) << threads;
    // From a map that many threads made, each ray alone.
    for (size_t i = 0; i < rays.size(); i += 7) {
      uint8_t again = 2;
      together.any_set({&rays[i], 1}, {&again, 1});
      ASSERT_EQ(again, expected[i]) << threads << " " << i;
    }
  }
}

TEST(ParallelRays, AnEmptyVolumeAndUselessDirectionsBlockWhatTheStreamBlocks) {
  const MaskVolume empty;
  const RayStream nothing(empty);
  const Vec3d up(0, 1, 0);
  uint8_t blocked = 7;
  const StreamRay ray{{12, 2, 12}, Vec3f(0.5f), Vec3f(up)};
  ParallelRays(nothing, up).any_set({&ray, 1}, {&blocked, 1});
  EXPECT_EQ(blocked, 0);
  const MaskVolume volume = hills(10, {0, 0, 0});
  const RayStream stream(volume);
  for (const Vec3d& direction : {Vec3d(0.0), Vec3d(std::nan(""), 1, 0), Vec3d(kInfinity, 0, 0)}) {
    const ParallelRays parallel(stream, direction);
    parallel.any_set({&ray, 1}, {&blocked, 1});
    EXPECT_EQ(blocked, 1);  // it starts in the ground
    EXPECT_EQ(parallel.bytes(), 0u);
  }
}

}  // namespace
}  // namespace world
