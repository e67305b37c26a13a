// Hard cases T1..T18: rays through the grid. T19 (packets) belongs to the SIMD walk.
#include <array>
#include <bit>
#include <cfloat>
#include <vector>

#include <gtest/gtest.h>

#include "world/base/random.h"
#include "world/space/grid_walk.h"
#include "world/space/grid_walk_variants.h"
#include "world/store/mask_walk.h"

namespace world {
namespace {

class Random {
 public:
  explicit Random(uint64_t seed) : seed_(seed) {}
  uint64_t bits() { return random_bits(seed_, static_cast<int64_t>(++n_), 0, 0); }
  double uniform(double low, double high) { return low + (high - low) * uniform01_double(bits()); }
  int below(int n) { return static_cast<int>(bits() % static_cast<uint64_t>(n)); }

 private:
  uint64_t seed_, n_ = 0;
};

struct Visit {
  VoxelPos voxel;
  double t;
  int face;
  friend bool operator==(const Visit&, const Visit&) = default;
};

std::vector<Visit> visits(const GridRay& ray, size_t most) {
  std::vector<Visit> list;
  for (FlatWalk walk(ray); walk.inside() && list.size() < most; walk.step())
    list.push_back({walk.voxel(), walk.t(), walk.face()});
  return list;
}

int64_t manhattan(VoxelPos a, VoxelPos b) {
  return std::abs(int64_t{a.x} - b.x) + std::abs(int64_t{a.y} - b.y) + std::abs(int64_t{a.z} - b.z);
}

Vec3d random_direction(Random& random) {
  return Vec3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
}

double ulps_apart(double a, double b) {
  const auto order = [](double v) { return static_cast<double>(std::bit_cast<int64_t>(v)); };
  return std::abs(order(a) - order(b));
}

TEST(HardCaseT1, LongRaysDifferFromTheExactWalkOnlyAtNearTies) {
  Random random(1);
  for (const double range : {16.0, 1e3, 1e5, 8e6}) {
    std::array<int, 3> wrong_rays{};
    for (int r = 0; r < 1000; ++r) {
      // Fractions of 2^-24 and directions of 2^-24: whole numbers for the exact walk, exact in double.
      FixedRay ray;
      for (int a = 0; a < 3; ++a) {
        ray.origin[a] = static_cast<int64_t>(random.uniform(-range, range) * 0x1p24) << 8;
        ray.direction[a] = static_cast<int32_t>(random.uniform(-1, 1) * 0x1p24);
      }
      ExactWalk exact(ray);
      FlatWalk walk(ray.ray());
      bool together = true, wrong = false;
      for (int step = 1; step <= 10000; ++step) {
        double t[3];
        if (together)
          for (int a = 0; a < 3; ++a) t[a] = exact.t_next(a);
        exact.step();
        walk.step();
        const VoxelPos v = walk.voxel();
        const bool same = v.x == exact.cell(0) && v.y == exact.cell(1) && v.z == exact.cell(2);
        if (!same) {
          if (together) {
            ASSERT_LE(ulps_apart(t[exact.axis()], t[face_axis(walk.face())]), 4) << "ray " << r << " step " << step;
          }
          for (int a = 0; a < 3; ++a) ASSERT_LE(std::abs(v[a] - exact.cell(a)), 1);
          wrong = true;
        }
        together = same;
        if (wrong && step == 100) ++wrong_rays[0];
        if (wrong && step == 1000) ++wrong_rays[1];
      }
      if (wrong) ++wrong_rays[2];
    }
    for (const int wrong : wrong_rays) EXPECT_LE(wrong, 5) << "of 1000 rays, origins within " << range;
  }
}

TEST(HardCaseT2, ZeroComponentsAreNeverStepped) {
  for (int code = 0; code < 27; ++code) {
    const int sign[3] = {code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1};
    if (code == 13) continue;
    for (const double zero : {0.0, -0.0})
      for (const double fraction : {0.0, 0.5, 1.0}) {
        Vec3d direction;
        for (int a = 0; a < 3; ++a) direction[a] = sign[a] == 0 ? zero : sign[a];
        const GridRay ray({{5, -7, 9}, Vec3d(fraction)}, direction);
        FlatWalk walk(ray);
        for (int i = 0; i < 30; ++i) {
          walk.step();
          ASSERT_TRUE(walk.inside());
          ASSERT_FALSE(std::isnan(walk.t()));
          ASSERT_NE(sign[face_axis(walk.face())], 0);
        }
        for (int a = 0; a < 3; ++a)
          if (sign[a] == 0) {
            EXPECT_EQ(walk.voxel()[a], ray.voxel[a]);
          }
        // The skipping walk leaves cubes through the same axes.
        const GridAxes axes(ray);
        WalkPlace place{ray.voxel, 0, -1};
        for (int i = 0; i < 30; ++i) {
          ASSERT_TRUE(mask_walk::leave_cube(axes, place, (1 << i % 8) - 1, kInfinity));
          ASSERT_NE(sign[place.axis], 0);
          ASSERT_FALSE(std::isnan(place.t));
        }
      }
  }
}

TEST(HardCaseT3, TinyComponentsTerminateAndDoNotMove) {
  for (const double tiny : {double{1e-39f}, 1e-12, 1e-300, 5e-324}) {
    FlatWalk walk(GridRay({{0, 0, 0}, Vec3d(0.5)}, Vec3d(1, tiny, 0)));
    for (int i = 0; i < 1000000; ++i) walk.step();
    EXPECT_EQ(walk.voxel(), (VoxelPos{1000000, 0, 0})) << tiny;
    EXPECT_EQ(walk.t(), 999999.5);
  }
}

TEST(HardCaseT4, NotANumberAndInfinityAreRejectedBeforeTheFirstStep) {
  const double nan = std::nan("");
  MaskVolume volume;
  volume.set_leaf({0, 0, 0}, kAllMask);
  const MaskWalker walker(volume);
  const auto rejected = [&](const GridRay& ray) {
    FlatWalk walk(ray);
    EXPECT_FALSE(walk.inside());
    EXPECT_EQ(walk.steps(), 0u);
    EXPECT_EQ(walk.end(), WalkEnd::rejected);
    EXPECT_EQ(walker.first_set(ray).end, WalkEnd::rejected);
    EXPECT_EQ(walker.first_entered(ray).end, WalkEnd::rejected);
  };
  for (int a = 0; a < 3; ++a)
    for (const double bad : {nan, kInfinity, -kInfinity}) {
      GridRay ray({{0, 0, 0}, Vec3d(0.5)}, Vec3d(1, 1, 1));
      ray.direction[a] = bad;
      rejected(ray);
      ray = GridRay({{0, 0, 0}, Vec3d(0.5)}, Vec3d(1, 1, 1));
      ray.fraction[a] = bad;
      rejected(ray);
    }
  rejected(GridRay({{0, 0, 0}, Vec3d(1e300)}, Vec3d(1, 1, 1)));
  rejected(GridRay({{0, 0, 0}, Vec3d(0.5)}, Vec3d(1e308, 1, 1)));
  rejected(GridRay({{0, 0, 0}, Vec3d(0.5)}, Vec3d(1, 1, 1), nan));
  rejected(GridRay({{0, 0, 0}, Vec3d(0.5)}, Vec3d(1, 1, 1), -1));
}

TEST(HardCaseT5, StartOnABoundaryGoingDownIsLeftAtZero) {
  const GridRay ray(WorldPoint::from(3, 0.5, 0.5), Vec3d(-1, 0, 0));
  const std::vector<Visit> list = visits(ray, 3);
  EXPECT_EQ(list[0].voxel.x, 3);
  EXPECT_EQ(list[1].voxel.x, 2);
  EXPECT_EQ(list[1].t, 0);
  EXPECT_EQ(list[2].t, 1);
  MaskVolume volume;
  LeafMask mask;
  mask.set(index_in_leaf({2, 0, 0}));
  volume.set_leaf({0, 0, 0}, mask);
  const GridHit hit = MaskWalker(volume).first_set(ray);
  ASSERT_TRUE(hit.hit());
  EXPECT_EQ(hit.voxel, (VoxelPos{2, 0, 0}));
  EXPECT_EQ(hit.t, 0);
  EXPECT_EQ(hit.face, kFacePosX);
}

TEST(HardCaseT6, MirroredRaysVisitMirroredVoxels) {
  Random random(6);
  for (int i = 0; i < 2000; ++i) {
    GridRay ray, mirrored;
    for (int a = 0; a < 3; ++a) {
      ray.voxel[a] = random.below(2000) - 1000;
      ray.fraction[a] = random.below((1 << 10) + 1) * 0x1p-10;
      ray.direction[a] = (random.below(41) - 20) / 20.0;
      mirrored.voxel[a] = -1 - ray.voxel[a];
      mirrored.fraction[a] = 1 - ray.fraction[a];
      mirrored.direction[a] = -ray.direction[a];
    }
    const std::vector<Visit> list = visits(ray, 200), mirror = visits(mirrored, 200);
    ASSERT_EQ(list.size(), mirror.size());
    for (size_t k = 0; k < list.size(); ++k) {
      for (int a = 0; a < 3; ++a) ASSERT_EQ(list[k].voxel[a], -1 - mirror[k].voxel[a]);
      ASSERT_EQ(list[k].t, mirror[k].t);
      ASSERT_EQ(list[k].face, mirror[k].face == kNoFace ? kNoFace : opposite_face(mirror[k].face));
    }
  }
}

TEST(HardCaseT7, WalksEndWhereTheEndPointLiesOnBoundaries) {
  const auto at = [](double x, double y, double z) { return WorldPoint::from(x / 16, y / 16, z / 16); };
  FlatWalk first = FlatWalk::segment(at(-668, -340, 77), at(404, -64, -784));
  VoxelPos last;
  for (; first.inside(); first.step()) last = first.voxel();
  EXPECT_EQ(first.steps(), 138u);
  EXPECT_EQ(last, (VoxelPos{25, -4, -49}));
  FlatWalk second = FlatWalk::segment(at(386.7112215521066, 137.40911926818373, 7.0554159455922285), at(416, 142, 0));
  for (; second.inside(); second.step()) last = second.voxel();
  EXPECT_EQ(second.steps(), 2u);
  EXPECT_EQ(last, (VoxelPos{26, 8, 0}));
}

TEST(HardCaseT8, CornersAreCrossedInThreeFaceStepsInAxisOrder) {
  const GridRay ray({{0, 0, 0}, Vec3d(0.5)}, Vec3d(1, 1, 1));
  const std::vector<Visit> list = visits(ray, 9);
  const VoxelPos expected[] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {2, 1, 1},
                               {2, 2, 1}, {2, 2, 2}, {3, 2, 2}, {3, 3, 2}};
  for (int i = 0; i < 9; ++i) EXPECT_EQ(list[static_cast<size_t>(i)].voxel, expected[i]);
  // Two solids that touch at the edge x = 1, y = 1: no diagonal ray passes between them.
  MaskVolume volume;
  LeafMask mask;
  for (int z = 0; z < 8; ++z) mask.set(index_in_leaf({1, 0, z})), mask.set(index_in_leaf({0, 1, z}));
  volume.set_leaf({0, 0, 0}, mask);
  const MaskWalker walker(volume);
  for (int i = 1; i < 64; ++i)
    for (const double z : {0.0, 0.25, 1.0}) {
      const double f = i / 64.0;
      EXPECT_TRUE(walker.any_set(GridRay({{0, 0, 3}, Vec3d(f, f, 0.5)}, Vec3d(1, 1, z), 3)));
      EXPECT_TRUE(walker.any_set(GridRay({{1, 1, 3}, Vec3d(f, f, 0.5)}, Vec3d(-1, -1, z), 3)));
    }
}

TEST(HardCaseT9, StepsNeverExceedTheManhattanBound) {
  Random random(9);
  for (int i = 0; i < 5000; ++i) {
    GridRay ray(
        {{random.below(100) - 50, random.below(100) - 50, random.below(100) - 50}, Vec3d(random.uniform(0, 1), 0, 1)},
        random_direction(random), random.uniform(0, 100));
    FlatWalk walk(ray);
    VoxelPos last = walk.voxel();
    for (; walk.inside(); walk.step()) last = walk.voxel();
    EXPECT_EQ(static_cast<int64_t>(walk.steps()), manhattan(last, ray.voxel));
    double bound = 3;
    for (int a = 0; a < 3; ++a) bound += std::abs(ray.direction[a]) * ray.t_max + 1;
    EXPECT_LE(static_cast<double>(walk.steps()), bound);
    EXPECT_EQ(walk.end(), WalkEnd::t_max);
  }
}

TEST(HardCaseT10, RaysAimedAtASilhouetteEdgeHitTheBox) {
  Random random(10);
  int missed = 0;
  for (int i = 0; i < 300000; ++i) {
    // From the quadrant -x, +y of the box [0,1]^3 its edge x = 0, y = 0 is a silhouette edge, as is x = 1, y = 1.
    const Vec3d origin(random.uniform(-9, -0.01), random.uniform(1.01, 9), random.uniform(-4, 5));
    const double edge = random.below(2);
    const Vec3d target(edge, edge, random.uniform(0.01, 0.99));
    const WorldPoint start = WorldPoint::from(origin.x, origin.y, origin.z);
    const Vec3d exact_start = Vec3d(start.voxel.x, start.voxel.y, start.voxel.z) + start.fraction;
    missed += intersect_box(GridRay(start, target - exact_start), Vec3d(0.0), Vec3d(1.0)).empty();
  }
  EXPECT_EQ(missed, 0);
}

TEST(HardCaseT11, ARayInASlabsPlaneIsInsideThatSlab) {
  for (const double zero : {0.0, -0.0})
    for (const double plane : {0.0, 1.0}) {
      const RayInterval on =
          intersect_box(GridRay(WorldPoint::from(-2, plane, 0.5), Vec3d(1, zero, zero)), Vec3d(0.0), Vec3d(1.0));
      ASSERT_FALSE(on.empty());
      EXPECT_EQ(on.t0, 2);
      EXPECT_NEAR(on.t1, 3, 1e-12);
    }
  EXPECT_TRUE(
      intersect_box(GridRay(WorldPoint::from(-2, 1.0001, 0.5), Vec3d(1, 0, 0)), Vec3d(0.0), Vec3d(1.0)).empty());
  EXPECT_TRUE(intersect_box(GridRay(WorldPoint::from(-2, 0, 3), Vec3d(1, 0, 0)), Vec3d(0.0), Vec3d(1.0)).empty());
}

// A sparse world over several regions: lone voxels, half-filled leaves, full leaves, empty space; both signs.
MaskVolume random_world(uint64_t seed) {
  Random random(seed);
  MaskVolume volume;
  for (int i = 0; i < 1500; ++i) {
    const LeafPos leaf{random.below(40) - 20, random.below(24) - 12, random.below(40) - 20};
    LeafMask mask;
    const int kind = random.below(4);
    if (kind == 0) mask = kAllMask;
    if (kind == 1) mask.set(random.below(512));
    if (kind == 2)
      for (int k = 0; k < 8; ++k) mask.set(random.below(512));
    if (kind == 3)
      for (uint64_t& word : mask.word) word = random.bits() & random.bits();
    volume.set_leaf(leaf, mask);
  }
  return volume;
}

// Of every kind: generic, axis-parallel, exact diagonals, starts on boundaries, inside and outside the bounds.
GridRay random_ray(Random& random) {
  GridRay ray;
  const bool exact = random.below(2);
  for (int a = 0; a < 3; ++a) {
    ray.voxel[a] = random.below(400) - 200;
    ray.fraction[a] = exact ? random.below(5) / 4.0 : random.uniform(0, 1);
    ray.direction[a] = exact ? random.below(9) - 4 : random.uniform(-1, 1);
  }
  if (random.below(16) == 0) ray.direction[random.below(3)] *= 1e-10;
  ray.t_max = random.below(4) ? 300 : random.uniform(0, 100);
  return ray;
}

void expect_same(const GridHit& a, const GridHit& b, const char* what) {
  ASSERT_EQ(a.hit(), b.hit()) << what;
  if (!a.hit()) return;
  ASSERT_EQ(a.voxel, b.voxel) << what;
  ASSERT_EQ(a.face, b.face) << what;
  ASSERT_EQ(std::bit_cast<uint64_t>(a.t + 0.0), std::bit_cast<uint64_t>(b.t + 0.0)) << what;
}

TEST(HardCaseT12, SkippingWalkFindsTheFlatWalksFirstHit) {
  const MaskVolume volume = random_world(12);
  const MaskWalker walker(volume);
  Random random(120);
  int hits = 0;
  for (int i = 0; i < 100000; ++i) {
    const GridRay ray = random_ray(random);
    const GridHit flat = first_hit_flat(ray, [&](VoxelPos v) { return volume.test(v); });
    expect_same(walker.first_set(ray), flat, "first_set");
    if (HasFatalFailure()) FAIL() << "ray " << i;
    hits += flat.hit();
  }
  EXPECT_GT(hits, 10000);
}

TEST(HardCaseT12, EveryCubeIsLeftWhereTheFlatWalkLeavesIt) {
  Random random(121);
  for (int i = 0; i < 20000; ++i) {
    GridRay ray = random_ray(random);
    if (ray.degenerate()) continue;
    ray.t_max = 400;
    const GridAxes axes(ray);
    WalkPlace place{ray.voxel, 0, -1};
    FlatWalk flat(ray);
    for (;;) {
      if (!mask_walk::leave_cube(axes, place, (1 << random.below(8)) - 1, ray.t_max)) break;
      while (flat.inside() && flat.voxel() != place.voxel) flat.step();
      ASSERT_TRUE(flat.inside()) << "ray " << i << ": a voxel that the flat walk does not visit";
      ASSERT_EQ(flat.t(), place.t);
      ASSERT_EQ(face_axis(flat.face()), place.axis);
    }
  }
}

TEST(HardCaseT13, FullLeavesAndFullMasksLookTheSame) {
  const MaskVolume tiles = random_world(13);
  // The same world with every full leaf stored as 512 bits.
  MaskVolume voxels;
  for (const MaskRegion* region : tiles.regions()) {
    auto copy = std::make_unique<MaskRegion>(*region);
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const LeafPos leaf = leaf_offset_in_region(i);
      if (!copy->leaf_full(leaf)) continue;
      copy->full[static_cast<size_t>(leaf_group(leaf))] &= ~(1ull << leaf_group_bit(leaf));
      copy->slot[static_cast<size_t>(i)] = static_cast<uint32_t>(copy->masks.size());
      copy->masks.push_back(kAllMask);
    }
    voxels.put_region(region->pos, std::move(copy));
  }
  voxels.finish();
  const MaskWalker with_tiles(tiles), with_voxels(voxels);
  Random random(130);
  for (int i = 0; i < 50000; ++i) {
    const GridRay ray = random_ray(random);
    expect_same(with_tiles.first_set(ray), with_voxels.first_set(ray), "first_set");
    expect_same(with_tiles.first_entered(ray), with_voxels.first_entered(ray), "first_entered");
    if (HasFatalFailure()) FAIL() << "ray " << i;
  }
}

TEST(HardCaseT14, SmallComponentsEqualTheFlatWalk) {
  const MaskVolume volume = random_world(14);
  const MaskWalker walker(volume);
  Random random(140);
  for (int i = 0; i < 20000; ++i) {
    GridRay ray = random_ray(random);
    ray.direction[random.below(3)] = std::ldexp(random.uniform(-1, 1), -24 - random.below(1000));
    expect_same(walker.first_set(ray), first_hit_flat(ray, [&](VoxelPos v) { return volume.test(v); }), "first_set");
    if (HasFatalFailure()) FAIL() << "ray " << i;
  }
}

TEST(HardCaseT15, TheWorldsBorderStopsTheRay) {
  // A start past the border is refused; 2^31 - 7.5 is one.
  EXPECT_EQ(FlatWalk(GridRay({{INT32_MAX - 7, 0, 0}, Vec3d(0.5)}, Vec3d(1, 0, 0))).end(), WalkEnd::rejected);
  MaskVolume volume;
  volume.set_leaf(leaf_from_voxel({kWorldBorder - 1, 0, 0}), kNoneMask);
  for (int axis = 0; axis < 3; ++axis)
    for (const int sign : {1, -1}) {
      GridRay ray;
      ray.voxel[axis] = sign > 0 ? kWorldBorder - 8 : -kWorldBorder + 7;
      ray.fraction = Vec3d(0.5);
      ray.direction[axis] = sign;
      FlatWalk walk(ray);
      while (walk.inside()) walk.step();
      EXPECT_EQ(walk.end(), WalkEnd::left_world);
      EXPECT_EQ(walk.steps(), 8u);
      EXPECT_EQ(walk.t(), 7.5);
      const GridHit missed = MaskWalker(volume).first_set(ray);
      EXPECT_EQ(missed.end, WalkEnd::left_world);
      EXPECT_EQ(missed.t, 7.5);
    }
  // Across the whole world, corner to corner, in both walks' arithmetic.
  MaskVolume far;
  LeafMask corner;
  corner.set(index_in_leaf({kWorldBorder - 1, kWorldBorder - 1, kWorldBorder - 1}));
  far.set_leaf(leaf_from_voxel({kWorldBorder - 1, kWorldBorder - 1, kWorldBorder - 1}), corner);
  const GridRay across({{-kWorldBorder, -kWorldBorder, -kWorldBorder}, Vec3d(0.5)}, Vec3d(1, 1, 1));
  const GridHit hit = MaskWalker(far).first_set(across);
  ASSERT_TRUE(hit.hit());
  EXPECT_EQ(hit.voxel, (VoxelPos{kWorldBorder - 1, kWorldBorder - 1, kWorldBorder - 1}));
  EXPECT_EQ(hit.face, kFaceNegZ);
  EXPECT_EQ(hit.t, 2.0 * kWorldBorder - 1.5);
}

TEST(HardCaseT16, InfiniteRaysEndOutsideTheWorld) {
  for (const double t_max : {kInfinity, DBL_MAX}) {
    const GridRay ray({{0, 0, 0}, Vec3d(0.5)}, Vec3d(0.3, 0.2, -0.1), t_max);
    EXPECT_EQ(MaskWalker(MaskVolume()).first_set(ray).end, WalkEnd::left_world);
    MaskVolume behind;
    behind.set_leaf({-4, 0, 0}, kAllMask);
    EXPECT_EQ(MaskWalker(behind).first_set(ray).end, WalkEnd::left_world);
    FlatWalk walk(GridRay({{kWorldBorder - 1000, 0, 0}, Vec3d(0.5)}, Vec3d(0.3, 0.2, -0.1), t_max));
    while (walk.inside()) walk.step();
    EXPECT_EQ(walk.end(), WalkEnd::left_world);
    EXPECT_LE(walk.steps(), 1000u + 667 + 334 + 3);
  }
}

TEST(HardCaseT17, ARayWithoutDirectionSeesOnlyItsOwnVoxel) {
  MaskVolume volume;
  LeafMask mask;
  mask.set(0);
  volume.set_leaf({0, 0, 0}, mask);
  const MaskWalker walker(volume);
  for (const double fraction : {0.0, 0.5, 1.0})
    for (const double t_max : {1.0, kInfinity}) {
      const GridRay solid({{0, 0, 0}, Vec3d(fraction)}, Vec3d(0.0), t_max),
          clear({{1, 0, 0}, Vec3d(fraction)}, Vec3d(0.0), t_max);
      FlatWalk walk(clear);
      walk.step();
      EXPECT_FALSE(walk.inside());
      EXPECT_EQ(walk.steps(), 0u);
      EXPECT_EQ(walk.end(), WalkEnd::t_max);
      EXPECT_TRUE(walker.first_set(solid).hit());
      EXPECT_FALSE(walker.first_set(clear).hit());
      EXPECT_FALSE(walker.first_entered(solid).hit());
    }
}

TEST(HardCaseT18, AStartInsideASolidIsAHitAtZeroWithoutAFace) {
  MaskVolume volume;
  volume.set_leaf({0, 0, 0}, kAllMask);
  const GridRay ray({{3, 3, 3}, Vec3d(0.5)}, Vec3d(1, 2, 3));
  const GridHit hit = MaskWalker(volume).first_set(ray);
  ASSERT_TRUE(hit.hit());
  EXPECT_EQ(hit.voxel, ray.voxel);
  EXPECT_EQ(hit.t, 0);
  EXPECT_EQ(hit.face, kNoFace);
  expect_same(hit, first_hit_flat(ray, [&](VoxelPos v) { return volume.test(v); }), "flat");
}

}  // namespace
}  // namespace world
