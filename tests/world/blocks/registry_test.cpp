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
}

}  // namespace
}  // namespace world
