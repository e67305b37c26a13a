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
}

TEST(BsdfParameters, ALampRadiatesItsPowerOverSixFaces) {
  world::Block lamp;
  lamp.emission = {6 * 3.14159265f, 0, 0};
  EXPECT_NEAR(bsdf_parameters(lamp, 1.0f, false).emission.x, 1, 1e-6);
}

}  // namespace
}  // namespace render
