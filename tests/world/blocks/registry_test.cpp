#include <limits>

#include <gtest/gtest.h>

#include "world/blocks/block.h"

namespace world {
namespace {

constexpr const char* kRest =
    "density_kg_per_m3 = 2000\nheat_capacity_j_per_kg_k = 800\nheat_conductivity_w_per_m_k = 1\nhardness_mohs = 5\n";

std::string error_of(const std::string& text) {
  BlockPalette palette;
  const Status added = add_blocks_from_toml(palette, text, "rock.toml");
  return added.ok() ? "" : added.error().message;
}

TEST(BlockFile, SaysWhereAKeyIsMisspelt) {
  EXPECT_EQ(error_of("[a]\nalbedo = [0.1, 0.2, 0.3]\ndensty_kg_per_m3 = 2\n"),
            "rock.toml:3:1: unknown key 'densty_kg_per_m3' (did you mean 'density_kg_per_m3'?)");
}

TEST(BlockFile, SaysTheAllowedRangeOfEachValue) {
  const auto with = [](const std::string& line) { return error_of("[a]\n" + line + "\n" + kRest); };
  EXPECT_EQ(with("albedo = [0.1, 0.2, 0.3]"), "");
  EXPECT_EQ(with("albedo = [0.1, 1.0, 0.3]"), "rock.toml:2:16: 'albedo[1]' is 1, but must be in (0, 1)");
  EXPECT_EQ(with("albedo = [0.0, 0.5, 0.3]"), "rock.toml:2:11: 'albedo[0]' is 0, but must be in (0, 1)");
  EXPECT_EQ(with("albedo = [0.1, 0.5, 0.3]\nemission_w = [0, -1, 0]"),
            "rock.toml:3:18: 'emission_w[1]' is -1, but must be at least 0");
  EXPECT_EQ(with("albedo = [0.1, 0.5, 0.3]\nindex_of_refraction = 0.5"),
            "rock.toml:3:23: 'index_of_refraction' is 0.5, but must be in [1, 5]");
  EXPECT_EQ(
      with("albedo = [0.1, 0.5, 0.3]\nphase = 'liqid'"),
      "rock.toml:3:9: 'phase' is 'liqid', but must be one of gas, liquid, granular, solid (did you mean 'liquid'?)");
  EXPECT_EQ(with("albedo = [0.1, 0.5, 0.3]\nabsorption_per_m = [1, 1, 1]"),
            "rock.toml:3:20: 'absorption_per_m' needs 'opaque = false': no light enters an opaque block");
}

TEST(BlockFile, WhatASurfaceScattersIsCheckedAndHasADefault) {
  const auto with = [](const std::string& line) {
    return error_of("[a]\nalbedo = [0.1, 0.2, 0.7]\n" + line + "\n" + kRest);
  };
  EXPECT_EQ(with("bsdf = 'blinn_phong'\nglossy = [0.9, 0.8, 0.3]\nshininess = 1\ncoverage = 0.5"), "");
  EXPECT_EQ(with("glossy = [0.9, 0.8, -0.1]"), "rock.toml:3:21: 'glossy[2]' is -0.1, but must be in [0, 1]");
  EXPECT_EQ(with("shininess = 1.5"), "rock.toml:3:13: 'shininess' is 1.5, but must be in [0, 1]");
  EXPECT_EQ(with("coverage = -1"), "rock.toml:3:12: 'coverage' is -1, but must be in [0, 1]");
  EXPECT_EQ(with("glossy = [0.5, 0.5, 0.5]"),
            "rock.toml:3:10: 'albedo' and 'glossy' add up to 1.2 in a band, but must be at most 1: a surface can't "
            "scatter more than arrives");
  EXPECT_EQ(
      with("transmission = [0.5, 0.5, 0.5]"),
      "rock.toml:3:16: 'albedo' and 'transmission' add up to 1.2 in a band, but must be at most 1: a surface can't "
      "scatter more than arrives");

  BlockPalette palette;
  const std::string text = std::string("[matte]\nalbedo = [0.1, 0.2, 0.3]\n") + kRest +
                           "[shiny]\nbsdf = 'blinn_phong'\nalbedo = [0.1, 0.2, 0.98]\n" + kRest;
  ASSERT_TRUE(add_blocks_from_toml(palette, text, "a.toml").ok());
  const Block &matte = palette[*palette.find("matte")], &shiny = palette[*palette.find("shiny")];
  EXPECT_EQ(matte.glossy, Ratio3{});
  EXPECT_EQ(matte.coverage, 1);
  EXPECT_EQ(shiny.glossy, (Ratio3{0.04f, 0.04f, 1 - 0.98f}));
  EXPECT_TRUE(check_block(shiny).ok());
}

TEST(BlockFile, WhatASurfaceScattersReadsBackAsWritten) {
  Block block;
  block.name = "a";
  block.bsdf = "blinn_phong";
  block.albedo = {0.1f, 0.2f, 0.3f};
  block.glossy = {0, 0, 0};  // not the default of its bsdf
  block.shininess = 0.25f;
  block.transmission = {0.5f, 0, 0.125f};
  block.coverage = 0.75f;
  BlockPalette palette;
  ASSERT_TRUE(add_blocks_from_toml(palette, toml_from_block(block), "a.toml").ok());
  const auto again = palette.add(block);
  ASSERT_TRUE(again.ok()) << again.error().message << toml_from_block(block);
  EXPECT_EQ(*again, 1);
  block.coverage = 1;
  EXPECT_FALSE(palette.add(block).ok()) << "a different block of that name";
}

TEST(BlockFile, HowABlockRestsAndFlowsIsCheckedAndReadsBackAsWritten) {
  const auto with = [](const std::string& line) {
    return error_of("[a]\nalbedo = [0.1, 0.2, 0.3]\n" + line + "\n" + kRest);
  };
  EXPECT_EQ(with("phase = 'granular'\nrepose_deg = 15"), "");
  EXPECT_EQ(with("phase = 'granular'\nrepose_deg = 14.9"),
            "rock.toml:4:14: 'repose_deg' is 14.9, but must be in [15, 70]");
  EXPECT_EQ(with("repose_deg = 30"),
            "rock.toml:3:14: 'repose_deg' needs 'phase = \"granular\"': nothing else comes to rest in heaps");
  EXPECT_EQ(with("phase = 'liquid'\nviscosity_pa_s = 1e7"), "");
  EXPECT_EQ(with("phase = 'liquid'\nviscosity_pa_s = 0"),
            "rock.toml:4:18: 'viscosity_pa_s' is 0, but must be in (0, 1e+07]");
  EXPECT_EQ(with("phase = 'gas'\nviscosity_pa_s = 1"),
            "rock.toml:4:18: 'viscosity_pa_s' needs 'phase = \"liquid\"': nothing else flows by it");

  Block sand, tar;
  sand.name = "sand", sand.phase = Phase::granular, sand.repose_deg = 33.3;
  tar.name = "tar", tar.phase = Phase::liquid, tar.viscosity_pa_s = 1.0 / 3;
  BlockPalette palette;
  ASSERT_TRUE(add_blocks_from_toml(palette, toml_from_block(sand) + toml_from_block(tar), "a.toml").ok());
  EXPECT_EQ(palette[1].repose_deg, 33.3);
  EXPECT_EQ(palette[2].viscosity_pa_s, 1.0 / 3);
  EXPECT_TRUE(palette.add(sand).ok() && palette.add(tar).ok());
  sand.repose_deg = 33, tar.viscosity_pa_s = 0.3;
  EXPECT_FALSE(palette.add(sand).ok()) << "a different block of that name";
  EXPECT_FALSE(palette.add(tar).ok());
  sand.name = "b", sand.repose_deg = 71;
  EXPECT_EQ(palette.add(sand).error().message, "block 'b': repose is 71, but must be in [15, 70]");
}

TEST(BlockFile, OfTheUsualRestAndFlowTheTextSaysNothing) {
  // Else programs that don't know these keys could not read any palette.
  for (const Phase phase : {Phase::gas, Phase::liquid, Phase::granular, Phase::solid}) {
    Block block;
    block.name = "a", block.phase = phase, block.opaque = false;
    const std::string text = toml_from_block(block);
    EXPECT_EQ(text.find("repose"), text.npos);
    EXPECT_EQ(text.find("viscosity"), text.npos);
  }
}

TEST(BlockPalette, RefusesASurfaceThatScattersMoreThanArrives) {
  BlockPalette palette;
  Block block;
  block.name = "a";
  block.glossy = {0.6f, 0, 0};
  const auto added = palette.add(block);
  ASSERT_FALSE(added.ok());
  EXPECT_EQ(added.error().message,
            "block 'a': 'albedo' and 'glossy' add up to 1.1 in a band, but must be at most 1: a surface can't scatter "
            "more than arrives");
}

TEST(BlockFile, ABlockDefinedTwiceIsAnErrorAndAddsNothing) {
  BlockPalette palette;
  const std::string text = std::string("[a]\nalbedo = [0.1, 0.2, 0.3]\n") + kRest;
  ASSERT_TRUE(add_blocks_from_toml(palette, text, "one.toml").ok());
  const Status again =
      add_blocks_from_toml(palette, "[b]\nalbedo = [0.1, 0.2, 0.3]\n" + std::string(kRest) + text, "two.toml");
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().message, "two.toml:7:1: the block 'a' is defined already; choose another name");
  EXPECT_EQ(palette.size(), 2u);
}

TEST(BlockPalette, HoldsAirFirstAndFindsWhatWasAdded) {
  BlockPalette palette;
  EXPECT_EQ(palette.find("air"), kAir);
  EXPECT_EQ(palette.masks()[kAir], 0);
  Block lamp;
  lamp.name = "test:lamp";
  lamp.emission = {1, 0, 0};
  const auto id = palette.add(lamp);
  ASSERT_TRUE(id.ok());
  EXPECT_EQ(*id, 1);
  EXPECT_EQ(palette.find("test:lamp"), 1);
  EXPECT_EQ(palette.find("test:lam"), std::nullopt);
  EXPECT_EQ(palette.nearest_name("test:lam"), "test:lamp");
  EXPECT_EQ(palette.masks()[1], mask_bits(lamp));
}

TEST(BlockPalette, TheSameBlockTwiceIsOneIdAndADifferentOneIsAnError) {
  BlockPalette palette;
  Block block;
  block.name = "a";
  const auto first = palette.add(block), second = palette.add(block);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(*first, *second);
  block.opaque = false;
  EXPECT_FALSE(palette.add(block).ok());
}

TEST(BlockPalette, IdsRunOutAtTheLastOfSixteenBits) {
  BlockPalette palette;
  Block block;
  for (size_t i = 1; i < kMaxBlocks; ++i) {
    block.name = "b" + std::to_string(i);
    ASSERT_TRUE(palette.add(block).ok());
  }
  block.name = "one_too_many";
  EXPECT_FALSE(palette.add(block).ok());
}

TEST(BlockPalette, ChecksNameTheProperty) {
  Block block;
  block.name = "a";
  block.density.value = 0;
  EXPECT_EQ(check_block(block).error().message, "block 'a': density is 0, but must be above 0");
  block.density.value = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(check_block(block).ok());
  block.density.value = 1;
  block.albedo.g = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(check_block(block).ok());
}

TEST(MaskBits, SayWhatABlockIsToLightBodiesAndRules) {
  const BlockPalette& blocks = standard_blocks();
  const auto has = [&](const char* name, MaskKind kind) {
    return (blocks.masks()[*blocks.find(name)] >> static_cast<int>(kind) & 1) != 0;
  };
  EXPECT_TRUE(has("stone", MaskKind::occupied) && has("stone", MaskKind::opaque) && has("stone", MaskKind::solid));
  EXPECT_TRUE(has("sand", MaskKind::solid));
  EXPECT_TRUE(has("water", MaskKind::liquid) && !has("water", MaskKind::opaque) && !has("water", MaskKind::solid));
  EXPECT_TRUE(has("lava", MaskKind::liquid) && has("lava", MaskKind::emitting));
  EXPECT_TRUE(has("lamp_warm", MaskKind::emitting) && !has("stone", MaskKind::emitting));
  EXPECT_TRUE(has("smoke", MaskKind::occupied) && !has("smoke", MaskKind::solid) && !has("smoke", MaskKind::liquid));
  EXPECT_TRUE(has("sand", MaskKind::granular) && !has("stone", MaskKind::granular) &&
              !has("water", MaskKind::granular));
  EXPECT_TRUE(has("smoke", MaskKind::gas) && !has("water", MaskKind::gas) && !has("air", MaskKind::gas));
}

}  // namespace
}  // namespace world
