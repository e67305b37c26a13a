// Textures of blocks: what they are in the mean, and how far their filters are from the mean over a footprint.
#include <cmath>

#include <gtest/gtest.h>

#include "render/textures/texture_set.h"
#include "world/base/random.h"
#include "world/blocks/block_texture.h"

namespace render {
namespace {

const TextureSet& standard_textures() {
  static const TextureSet set = [] {
    TextureSet made;
    CHECK(made.follow(world::standard_blocks(), RenderKnobs{}).ok());
    return made;
  }();
  return set;
}

float texel(const TextureSet& set, uint32_t at) { return shared::texture_unpacked(set.texels()[at]).x; }

TEST(Textures, KeepTheMeanAlbedoAndNeverReachOne) {
  const world::BlockPalette& palette = world::standard_blocks();
  const TextureSet& set = standard_textures();
  int textured = 0;
  for (size_t id = 0; id < palette.size(); ++id) {
    const auto block = static_cast<world::BlockId>(id);
    if (!set.of(block).tiles) continue;
    ++textured;
    double sum = 0, least = 0, most = 0, spread = 0;
    for (uint32_t t = 0; t < shared::kTextureTiles; ++t)
      for (uint32_t i = 0; i < 1024; ++i) {
        const double n = texel(set, set.of(block).tiles + t * shared::kTextureTileTexels + i);
        sum += n, spread += n * n, least = std::min(least, n), most = std::max(most, n);
      }
    const double count = 1024 * shared::kTextureTiles;
    EXPECT_NEAR(sum / count, 0, 1e-5) << palette[block].name;
    EXPECT_NEAR(std::max(most, -least), 1, 1e-6) << palette[block].name;
    EXPECT_GT(std::sqrt(spread / count), 0.1) << palette[block].name << " is all but even";
    EXPECT_LT((palette[block].albedo + palette[block].glossy).max() * (1 + set.of(block).contrast), 1);
    // Each level is the mean of the one before, rounded to a 127th.
    double level = 0;
    for (uint32_t i = 0; i < 1024; ++i) level += texel(set, set.of(block).tiles + i) / 1024;
    EXPECT_NEAR(texel(set, set.of(block).tiles + shared::kTextureTileTexels - 1), level, 0.5 / 127 + 1e-5);
  }
  EXPECT_GT(textured, 150);
}

TEST(Textures, AWordHoldsTheTexelsBesideAndAboveWrapped) {
  const TextureSet& set = standard_textures();
  const uint32_t tile = set.of(*world::standard_blocks().find("stone")).tiles;
  uint32_t first = tile;
  for (uint32_t size = 32; size >= 1; first += size * size, size /= 2)
    for (uint32_t y = 0; y < size; ++y)
      for (uint32_t x = 0; x < size; ++x) {
        const auto at = [&](uint32_t u, uint32_t v) { return texel(set, first + v % size * size + u % size); };
        EXPECT_EQ(shared::texture_unpacked(set.texels()[first + y * size + x]),
                  glm::vec4(at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)));
      }
}

TEST(Textures, NobodyAsksForAreNotMade) {
  TextureSet set;
  RenderKnobs knobs;
  knobs.textures = TextureFilter::off;
  ASSERT_TRUE(set.follow(world::standard_blocks(), knobs).ok());
  EXPECT_TRUE(set.empty());
  EXPECT_EQ(set.bytes(), 0u);
}

TEST(Textures, UnknownKindsAreRefusedByName) {
  world::BlockPalette palette;
  const auto bad =
      world::add_blocks_from_toml(palette, "[rock]\nalbedo = [0.1, 0.1, 0.1]\ntexture_contrast = 2\n", "x");
  EXPECT_FALSE(bad.ok());
  EXPECT_EQ(world::block_texture("stone")->kind, "speckle");
  EXPECT_EQ(world::block_texture("glass"), nullptr);
}

/// Root mean square of what a filter differs from the mean over the footprint by, over that of the texture itself.
double error_of(TextureFilter filter, int anisotropy, float along, float across) {
  RenderKnobs exact, approximate;
  exact.textures = TextureFilter::exact;
  approximate.textures = filter, approximate.texture_anisotropy = anisotropy;
  const TextureSet& set = standard_textures();
  const world::BlockId stone = *world::standard_blocks().find("stone");
  double error = 0, size = 0;
  for (uint64_t i = 0; i < 1000; ++i) {
    const auto at = [&](uint64_t k) { return static_cast<float>(world::uniform01_double(world::hash_combine(i, k))); };
    const world::VoxelPos voxel{static_cast<int>(i), 0, 0};
    const float angle = 6.28f * at(3);
    const glm::vec3 fraction(at(1), 1, at(2)), x(along * std::cos(angle), 0, along * std::sin(angle)),
        z(-across * std::sin(angle), 0, across * std::cos(angle));
    const double want = set.factor(exact, stone, voxel, 3, fraction, x, z);
    const double have = set.factor(approximate, stone, voxel, 3, fraction, x, z);
    exact.textures = TextureFilter::point;
    const double itself = set.factor(exact, stone, voxel, 3, fraction, {}, {});
    exact.textures = TextureFilter::exact;
    error += (have - want) * (have - want), size += (itself - 1) * (itself - 1);
  }
  return std::sqrt(error / size);
}

TEST(Textures, FiltersComeNearTheMeanOverAFootprint) {
  // A quarter of an octave apart, so that each level's widest and narrowest footprint are among them.
  double sum = 0;
  int widths = 0;
  for (float width = 0.004f; width < 4.5f; width *= 1.189207f, ++widths) {
    const double point = error_of(TextureFilter::point, 1, width, width),
                 mip = error_of(TextureFilter::mip, 4, width, width);
    EXPECT_LT(mip, 0.3) << width;
    EXPECT_LT(mip, 0.5 * point) << width;
    sum += mip;
  }
  EXPECT_LT(sum / widths, 0.16);
  // Seen at a slant, more probes are nearer.
  const double one = error_of(TextureFilter::mip, 1, 0.5f, 0.03f), four = error_of(TextureFilter::mip, 4, 0.5f, 0.03f),
               sixteen = error_of(TextureFilter::mip, 16, 0.5f, 0.03f);
  EXPECT_LT(sixteen, 0.75 * one);
  EXPECT_LT(four, 1.02 * one);
}

}  // namespace
}  // namespace render
