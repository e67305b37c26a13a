// The swept box against a reference that asks every cube and box of the way, and its rules at edges.
#include "sim/bodies/sweep.h"

#include "tests/sim/bodies/body_support.h"
#include "world/base/random.h"

namespace sim {
namespace {

using world::Vec3d;
using world::VoxelPos;
using world::World;

int64_t draw(uint64_t seed, int64_t i, int64_t j, int64_t range) {
  return static_cast<int64_t>(world::random_bits(seed, i, j, 5) % static_cast<uint64_t>(range));
}

/// The first time at which the moving box overlaps the other, by intervals in long double; 2 where it doesn't.
long double first_overlap(const BodyBox& box, const FixedVec3& d, const BodyBox& other) {
  long double begin = -1e30L, end = 1e30L;
  for (int a = 0; a < 3; ++a) {
    const long double low = other.min[a] - box.max(a), high = other.max(a) - box.min[a], way = d[a];
    if (d[a] == 0) {
      if (low >= 0 || high <= 0) return 2;
      continue;
    }
    begin = std::max(begin, std::min(low / way, high / way)), end = std::min(end, std::max(low / way, high / way));
  }
  return begin >= 0 && begin < end && begin < 1 ? begin : 2;
}

TEST(Sweep, FindsTheFirstOverlapOfAllCubesAndShapes) {
  World w(world::standard_blocks());
  // Numbers with few bits, so that the reference's quotients are the same where times are equal.
  for (int i = 0; i < 700; ++i) {
    const VoxelPos v{int32_t(draw(1, i, 0, 16)) - 8, int32_t(draw(1, i, 1, 16)) - 8, int32_t(draw(1, i, 2, 16)) - 8};
    const char* const kBlocks[] = {"stone", "stone", "fence_oak"};
    fill(w, v, v, kBlocks[draw(1, i, 3, w.palette->find("fence_oak") ? 3 : 2)]);
  }
  BodyTerrain terrain(w.store);
  terrain.refresh();
  int hits = 0;
  for (int i = 0; i < 1500; ++i) {
    BodyBox box;
    FixedVec3 d;
    for (int a = 0; a < 3; ++a) {
      box.min[a] = (draw(2, i, a, 160) - 80) * (kFixedOne / 10 + a);
      box.size[a] = (1 + draw(3, i, a, 24)) * (kFixedOne / 16);
      d[a] = (draw(4, i, a, 9) - 4) * (kFixedOne + draw(5, i, a, 3) * 12345);
    }
    if (terrain.overlaps(box)) continue;
    long double expected = 2;
    for (int x = -14; x < 14; ++x)
      for (int y = -14; y < 14; ++y)
        for (int z = -14; z < 14; ++z) {
          const VoxelPos v{x, y, z};
          if (terrain.filling(v) == BodyTerrain::Filling::full)
            expected = std::min(expected, first_overlap(box, d,
                                                        {{x * kFixedOne, y * kFixedOne, z * kFixedOne},
                                                         {kFixedOne, kFixedOne, kFixedOne}}));
          else if (terrain.filling(v) == BodyTerrain::Filling::shaped)
            for (const BodyBox& part : terrain.boxes(v)) expected = std::min(expected, first_overlap(box, d, part));
        }
    const SweepHit hit = sweep(box, d, terrain);
    ASSERT_EQ(hit.hit(), expected < 2) << i;
    if (hit.hit()) {
      EXPECT_NEAR(hit.time(), double(expected), 1e-15) << i;
      ++hits;
    }
    EXPECT_FALSE(terrain.overlaps(moved(box, hit.part_of(d)))) << i;
  }
  EXPECT_GT(hits, 300);
}

TEST(Sweep, TouchingIsNotMeetingAndLeavingIsFree) {
  World w(world::standard_blocks());
  fill(w, {0, 0, 0}, {0, 0, 0}, "stone");
  BodyTerrain terrain(w.store);
  terrain.refresh();
  const BodyBox above{{0, kFixedOne, 0}, {kFixedOne, kFixedOne, kFixedOne}};
  EXPECT_FALSE(sweep(above, {kFixedOne * 5, 0, 0}, terrain).hit());
  EXPECT_FALSE(sweep(above, {0, kFixedOne, 0}, terrain).hit());
  const SweepHit down = sweep(above, {0, -1, 0}, terrain);
  EXPECT_TRUE(down.hit());
  EXPECT_EQ(down.axis, 1);
  EXPECT_EQ(down.numerator, 0);
  // From inside it may go out.
  const BodyBox inside{{kFixedOne / 4, kFixedOne / 2, 0}, {kFixedOne / 2, kFixedOne, kFixedOne / 2}};
  EXPECT_FALSE(sweep(inside, {0, kFixedOne, 0}, terrain).hit());
}

TEST(Sweep, AnEdgeMetExactlyIsGotOnto) {
  World w(world::standard_blocks());
  fill(w, {1, 0, 0}, {1, 0, 0}, "stone");
  BodyTerrain terrain(w.store);
  terrain.refresh();
  // Its lower right edge flies exactly onto the upper left edge of the stone.
  const BodyBox box{{-kFixedOne, 2 * kFixedOne, 0}, {kFixedOne, kFixedOne, kFixedOne}};
  const SweepHit hit = sweep(box, {2 * kFixedOne, -2 * kFixedOne, 0}, terrain);
  EXPECT_EQ(hit.axis, 1);
  EXPECT_EQ(hit.time(), 0.5);
  // The same against a body that stands there.
  const BodyBox other{{kFixedOne, 0, 0}, {kFixedOne, kFixedOne, kFixedOne}};
  World empty(world::standard_blocks());
  BodyTerrain air(empty.store);
  air.refresh();
  const SweepHit on_body = sweep(box, {2 * kFixedOne, -2 * kFixedOne, 0}, air, {&other, 1});
  EXPECT_EQ(on_body.axis, 1);
  EXPECT_EQ(on_body.obstacle, 0);
  EXPECT_EQ(on_body.time(), 0.5);
}

TEST(Sweep, TheWorldEndsInAWall) {
  World w(world::standard_blocks());
  BodyTerrain terrain(w.store);
  terrain.refresh();
  const int64_t border = int64_t{world::kWorldBorder} * kFixedOne;
  const BodyBox box{{border - 10 * kFixedOne, 0, 0}, {kFixedOne, kFixedOne, kFixedOne}};
  const SweepHit hit = sweep(box, {100 * kFixedOne, 0, 0}, terrain);
  EXPECT_EQ(hit.axis, 0);
  EXPECT_EQ(moved(box, hit.part_of(FixedVec3{100 * kFixedOne, 0, 0})).max(0), border);
}

TEST(Terrain, ABoxDisplacesTheLiquidThatItIsIn) {
  World w(world::standard_blocks());
  fill(w, {0, 0, 0}, {3, 1, 3}, "water");
  BodyTerrain terrain(w.store);
  terrain.refresh();
  const BodyBox box{{kFixedOne / 2, kFixedOne / 4, 0}, {kFixedOne, 2 * kFixedOne, kFixedOne}};
  EXPECT_EQ(terrain.displaced(box).volume, 1.75);
  EXPECT_EQ(terrain.displaced(box).mass, 1.75 * 998);
  // The upper voxels hold a quarter.
  for (int x = 0; x < 4; ++x)
    for (int z = 0; z < 4; ++z) w.store.make_int_layer(world::Layer::liquid).set({x, 1, z}, 1024);
  EXPECT_EQ(terrain.displaced(box).volume, 1.0);
}

TEST(Terrain, PlantsAreOpenAndFencesAreThin) {
  World w(world::standard_blocks());
  world::BlockId plant = 0, fence = 0;
  for (size_t id = 0; id < w.palette->size(); ++id) {
    if ((*w.palette)[world::BlockId(id)].proxy == "cross") plant = world::BlockId(id);
    if ((*w.palette)[world::BlockId(id)].proxy == "fence") fence = world::BlockId(id);
  }
  ASSERT_NE(plant, 0);
  ASSERT_NE(fence, 0);
  world::EditBatch batch;
  batch.set({0, 0, 0}, plant), batch.set({4, 0, 0}, fence);
  ASSERT_TRUE(w.store.apply(batch).ok());
  BodyTerrain terrain(w.store);
  terrain.refresh();
  EXPECT_EQ(terrain.filling({0, 0, 0}), BodyTerrain::Filling::open);
  EXPECT_EQ(terrain.filling({4, 0, 0}), BodyTerrain::Filling::shaped);
  const BodyBox corner{{4 * kFixedOne, 0, 0}, {kFixedOne / 8, kFixedOne, kFixedOne / 8}};
  EXPECT_FALSE(terrain.overlaps(corner));
  EXPECT_TRUE(terrain.overlaps(moved(corner, {kFixedOne / 2, 0, kFixedOne / 2})));
}

}  // namespace
}  // namespace sim
