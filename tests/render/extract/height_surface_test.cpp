/// Surfaces of heights: their error holds everywhere, what is no surface has a large one, and their sides leave no gap.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "render/extract/height_surface.h"
#include "tests/render/raster/small_worlds.h"

namespace render {
namespace {

constexpr int kSide = kChunkSize;

/// Land over 64 x 64 columns and those around, of heights by place.
template <class TopOf>
world::World land(const TopOf& top_of) {
  world::World w(world::standard_blocks());
  world::EditBatch batch;
  for (int x = -8; x < kSide + 8; ++x)
    for (int z = -8; z < kSide + 8; ++z) {
      const int top = top_of(x, z);
      batch.fill({{x, -8, z}, {x, top - 1, z}}, block(w, "stone"));
      batch.set({x, top, z}, block(w, (x + z) % 3 ? "grass" : "sand"));
    }
  apply(w, batch);
  return w;
}

int hilly(int x, int z) { return static_cast<int>(60 + 12 * std::sin(x * 0.08) + 9 * std::cos(z * 0.11 + x * 0.03)); }

struct Extracted {
  Extractor extractor;
  std::vector<const ExtractedChunk*> chunks;  // of x = z = 0
};

std::optional<HeightSurface> surface_of(const world::World& w, Extracted& of, bool skirts = true) {
  of.extractor.rebuild(world::WorldView(w), {.sealed_cavities = true, .skirts = skirts});
  of.chunks.clear();
  for (const ExtractedChunk* c : of.extractor.chunks())
    if (c->pos.x == 0 && c->pos.z == 0) of.chunks.push_back(c);
  return height_surface(of.chunks);
}

/// Of a grid, at a place in cells; from `base`, in cells.
double grid_at(const HeightSurface& s, int number, double x, double z) {
  const int step = HeightSurface::step(number), side = HeightSurface::side(number);
  const int i = std::min(static_cast<int>(x / step), side - 2), j = std::min(static_cast<int>(z / step), side - 2);
  const auto height = [&](int di, int dj) {
    const auto at = static_cast<size_t>((i + di) * side + j + dj);
    return (s.words[HeightSurface::first_vertex(number) + at] & 0xffff) / 16.0;
  };
  const double u = x / step - i, v = z / step - j;
  // The triangles that render/raster/heightfields.cpp draws.
  if (u > v) return height(0, 0) + u * (height(1, 0) - height(0, 0)) + v * (height(1, 1) - height(1, 0));
  return height(0, 0) + v * (height(0, 1) - height(0, 0)) + u * (height(1, 1) - height(0, 1));
}

TEST(HeightSurface, HasTheTopOfEachColumnAcrossChunks) {
  const world::World w = land(hilly);
  Extracted of;
  const auto made = surface_of(w, of);
  ASSERT_TRUE(made);
  EXPECT_GT(of.chunks.size(), 1u);
  for (int x = 0; x < kSide; ++x)
    for (int z = 0; z < kSide; ++z) {
      const uint32_t word = made->words[static_cast<size_t>(x * kSide + z)];
      ASSERT_EQ(static_cast<int>(word & 0xffff) + made->base, hilly(x, z) + 1);
      ASSERT_EQ(word >> 16, block(w, (x + z) % 3 ? "grass" : "sand"));
    }
}

TEST(HeightSurface, NoPointOfAFaceAndNoneOfTheGridIsFartherThanItsError) {
  const world::World w = land(hilly);
  Extracted of;
  const auto made = surface_of(w, of, false);
  ASSERT_TRUE(made);
  for (int number = 0; number < HeightSurface::kSteps; ++number) {
    double worst = 0;
    for (int x = 0; x < kSide; ++x)
      for (int z = 0; z < kSide; ++z) {
        const double top = hilly(x, z) + 1 - made->base;
        for (int i = 0; i <= 16; ++i)
          worst = std::max(worst, std::abs(grid_at(*made, number, x + i % 4 / 3.0, z + i / 4 / 4.0) - top));
        // Walls towards lower columns, at their own plane.
        for (int side = 0; side < 4; ++side) {
          const int dx = side < 2 ? 2 * side - 1 : 0, dz = side < 2 ? 0 : 2 * side - 5;
          if (x + dx < 0 || x + dx >= kSide || z + dz < 0 || z + dz >= kSide) continue;  // skirts
          const double low = hilly(x + dx, z + dz) + 1 - made->base;
          if (low >= top) continue;
          const double there = grid_at(*made, number, x + 0.5 + 0.5 * dx, z + 0.5 + 0.5 * dz);
          worst = std::max({worst, there - low, top - there});
        }
      }
    const double error = double{made->error[static_cast<size_t>(number)]};
    EXPECT_LE(worst, error + 1e-4) << number;
    EXPECT_GT(worst, 0.5 * error) << number;  // no more than it need be
  }
}

TEST(HeightSurface, OfFlatLandHasNoError) {
  Extracted of;
  const auto made = surface_of(land([](int, int) { return 20; }), of);
  ASSERT_TRUE(made);
  for (const float error : made->error) EXPECT_EQ(error, 0);
}

TEST(HeightSurface, CountsWhatIsNoSurfaceByItsDepth) {
  Extracted of;
  world::World w = land([](int, int) { return 40; });
  world::EditBatch batch;
  batch.fill({{20, 10, 20}, {24, 40, 24}}, world::kAir);  // a shaft
  batch.fill({{24, 10, 20}, {40, 12, 24}}, world::kAir);  // and a gallery from its foot
  apply(w, batch);
  auto made = surface_of(w, of);
  ASSERT_TRUE(made);
  for (const float error : made->error) EXPECT_GE(error, 15);
  w = land([](int, int) { return 20; });
  batch = {};
  batch.fill({{30, 21, 30}, {30, 28, 30}}, block(w, "oak_log"));
  batch.fill({{28, 27, 28}, {32, 30, 32}}, block(w, "oak_leaves"));
  apply(w, batch);
  made = surface_of(w, of);
  ASSERT_TRUE(made);
  for (const float error : made->error) EXPECT_GE(error, 4);
}

TEST(HeightSurface, IsNoneWhereAColumnIsEmpty) {
  Extracted of;
  world::World w = land(hilly);
  world::EditBatch batch;
  batch.fill({{7, -8, 9}, {7, 100, 9}}, world::kAir);
  apply(w, batch);
  EXPECT_FALSE(surface_of(w, of));
}

TEST(HeightSurface, ItsSidesReachFromAboveTheFacesToBelowThem) {
  const world::World w = land(hilly);
  Extracted of;
  const auto made = surface_of(w, of);
  ASSERT_TRUE(made);
  for (int number = 0; number < HeightSurface::kSteps; ++number) {
    const int step = HeightSurface::step(number), side = HeightSurface::side(number);
    for (int n = 0; n < kSide; ++n)
      for (const auto& [x, z, dx, dz] :
           {std::array{0, n, -1, 0}, {kSide - 1, n, 1, 0}, {n, 0, 0, -1}, {n, kSide - 1, 0, 1}}) {
        const double top = hilly(x, z) + 1 - made->base, beside = hilly(x + dx, z + dz) + 1 - made->base;
        for (const double along : {0.0, 0.5, 1.0}) {
          const double at_x = dx ? x + (dx + 1) / 2 : x + along, at_z = dz ? z + (dz + 1) / 2 : z + along;
          EXPECT_GE(grid_at(*made, number, at_x, at_z), top - 1e-9);
        }
        const int i = dx ? (dx > 0 ? side - 1 : 0) : n / step, j = dz ? (dz > 0 ? side - 1 : 0) : n / step;
        for (int end = 0; end < 2; ++end) {
          const auto at = static_cast<size_t>((i + (dx ? 0 : end)) * side + j + (dz ? 0 : end));
          const double skirt = (made->words[HeightSurface::first_vertex(number) + at] >> 16) / 16.0;
          EXPECT_LE(skirt, std::max(0.0, std::min(top, beside) - 1)) << number;
        }
      }
  }
}

}  // namespace
}  // namespace render
