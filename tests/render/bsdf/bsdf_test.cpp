#include "render/bsdf/bsdf.h"

#include <algorithm>
#include <string>

#include <gtest/gtest.h>

namespace render {
namespace {

TEST(Bsdfs, AreSortedByNameAndFoundByIt) {
  EXPECT_TRUE(
      std::is_sorted(bsdfs().begin(), bsdfs().end(), [](const Bsdf& a, const Bsdf& b) { return a.name < b.name; }));
  EXPECT_GE(bsdfs().size(), 4u);
  for (const Bsdf& bsdf : bsdfs()) EXPECT_EQ(find_bsdf(bsdf.name), &bsdf);
  EXPECT_EQ(find_bsdf("chrome"), nullptr);
  EXPECT_EQ(find_bsdf(""), nullptr);
}

TEST(Bsdfs, ABlockWithAnUnknownOneIsAnErrorThatNamesTheNearest) {
  world::BlockPalette palette;
  EXPECT_TRUE(check_bsdfs(palette).ok());
  world::Block block;
  block.name = "chrome_block";
  block.bsdf = "miror";
  ASSERT_TRUE(palette.add(block).ok());
  const world::Status checked = check_bsdfs(palette);
  ASSERT_FALSE(checked.ok());
  EXPECT_EQ(checked.error().message, "block 'chrome_block': there is no bsdf 'miror'; the nearest is 'mirror'");
  EXPECT_EQ(checked.error().kind, world::ErrorKind::input_output);
  // One that a file names says where.
  world::BlockPalette from_file;
  ASSERT_TRUE(
      world::add_blocks_from_toml(from_file,
                                  "[chrome]\nalbedo = [0.5, 0.5, 0.5]\nbsdf = \"miror\"\ndensity_kg_per_m3 = 1\n"
                                  "heat_capacity_j_per_kg_k = 1\nheat_conductivity_w_per_m_k = 1\n"
                                  "hardness_mohs = 1\n",
                                  "chrome.toml")
          .ok());
  EXPECT_EQ(check_bsdfs(from_file).error().message,
            "chrome.toml:3:8: 'bsdf' of block 'chrome': there is no bsdf 'miror'; the nearest is 'mirror'");
}

TEST(BsdfParameters, TheIndexIsThatBeyondOverThatOnThisSide) {
  world::Block water;
  water.bsdf = "dielectric";
  water.index_of_refraction = 1.333f;
  EXPECT_FLOAT_EQ(bsdf_parameters(water, 1.0f, false).eta, 1.333f);
  EXPECT_FLOAT_EQ(bsdf_parameters(water, 1.0f, true).eta, 1 / 1.333f);
  EXPECT_FLOAT_EQ(bsdf_parameters(water, 1.52f, false).eta, 1.333f / 1.52f);
  water.bsdf = "thin";  // has the same medium on both sides
  EXPECT_FLOAT_EQ(bsdf_parameters(water, 1.0f, true).eta, 1.333f);
  water.index_of_refraction = 1;  // a leaf's: nothing that mirrors, in air or in water
  EXPECT_EQ(bsdf_parameters(water, 1.333f, false).eta, 1);
}

TEST(Bsdfs, EveryStandardBlockHasOneAndScattersNoMoreThanArrives) {
  const world::BlockPalette& blocks = world::standard_blocks();
  EXPECT_TRUE(check_bsdfs(blocks).ok());
  const Vec3f n(0, 1, 0);
  for (size_t id = 1; id < blocks.size(); ++id) {
    const world::Block& block = blocks[static_cast<world::BlockId>(id)];
    const BsdfParameters p = bsdf_parameters(block, 1.00029f, false);
    for (const Vec3f& wo : {n, glm::normalize(Vec3f(1, 1, 0)), glm::normalize(Vec3f(0, 0.1f, 1))}) {
      const Vec3f scattered = find_bsdf(block.bsdf)->probability_in(p, wo, n);
      for (int band = 0; band < 3; ++band) EXPECT_LE(scattered[band], 1 + 1e-6f) << block.name;
    }
  }
}

TEST(BsdfParameters, GoldReflectsAsItsIndexOfRefractionTells) {
  const world::BlockPalette& blocks = world::standard_blocks();
  const BsdfParameters gold = bsdf_parameters(blocks[*blocks.find("gold_block")], 1, false);
  const Vec3f n(0, 1, 0), seen = find_bsdf("blinn_phong")->probability_in(gold, n, n);
  // |n - 1 + ik|^2 / |n + 1 + ik|^2 at 450, 550 and 650 nm: 0.386, 0.847, 0.940; bands are wide, so only their order.
  EXPECT_GT(seen.x, 0.94f);
  EXPECT_NEAR(seen.y, 0.78f, 0.02f);
  EXPECT_NEAR(seen.z, 0.345f, 0.02f);
}

TEST(BsdfParameters, MoreShininessIsSmoother) {
  world::Block block;
  block.bsdf = "blinn_phong";
  float before = 0;
  for (const float shininess : {0.0f, 0.5f, 1.0f}) {
    block.shininess = shininess;
    const float s = bsdf_parameters(block, 1, false).smoothness;
    EXPECT_GT(s, before);
    before = s;
  }
  EXPECT_FLOAT_EQ(before, 8192);
}

TEST(BsdfParameters, ALampRadiatesItsPowerOverSixFaces) {
  world::Block lamp;
  lamp.emission = {6 * 3.14159265f, 0, 0};
  EXPECT_NEAR(bsdf_parameters(lamp, 1.0f, false).emission.x, 1, 1e-6);
}

}  // namespace
}  // namespace render
