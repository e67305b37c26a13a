#include "world/formats/translation/translation.h"

#include <gtest/gtest.h>

namespace world {
namespace {

Block block_of(const std::string& state, const char* game = "minecraft") {
  BlockPalette palette = standard_blocks();
  Translator translator(translation_table(game), palette);
  return palette[translator.block(state)];
}

TEST(Translation, TheSameThingIsLoamsBlock) {
  EXPECT_EQ(block_of("minecraft:stone").name, "stone");
  EXPECT_EQ(block_of("stone").name, "stone");
  EXPECT_EQ(block_of("minecraft:light_gray_wool").name, "wool_light_grey");
  EXPECT_EQ(block_of("minecraft:oak_log[axis=x]").name, "oak_log");
  EXPECT_EQ(block_of("minecraft:cave_air").name, "air");
  EXPECT_EQ(block_of("default:stone_with_coal", "luanti").name, "coal_ore");
  EXPECT_EQ(block_of("wool:dark_green", "luanti").name, "wool_green");
}

TEST(Translation, WhatOnlyLooksLikeItKeepsItsNameAndItsProperties) {
  const Block slab = block_of("minecraft:oak_slab[type=top,waterlogged=false]");
  EXPECT_EQ(slab.name, "minecraft:oak_slab[type=top]");
  EXPECT_EQ(slab.proxy, "slab_top");
  EXPECT_FALSE(slab.opaque);
  const Block oak = standard_blocks()[standard_blocks().find("oak_planks").value()];
  EXPECT_EQ(slab.albedo, oak.albedo);
  const Block whole = block_of("minecraft:oak_slab[type=double]");
  EXPECT_EQ(whole.proxy, "");
  EXPECT_TRUE(whole.opaque);
  EXPECT_EQ(block_of("minecraft:stone_brick_stairs[facing=east,half=bottom,shape=straight]").proxy,
            "stairs_east_bottom");
  EXPECT_EQ(block_of("minecraft:nether_brick_fence").proxy, "fence");
  EXPECT_EQ(block_of("minecraft:mossy_cobblestone_wall").proxy, "wall");
  EXPECT_EQ(block_of("minecraft:waxed_exposed_cut_copper_slab[type=bottom]").proxy, "slab_bottom");
  EXPECT_EQ(block_of("minecraft:red_concrete_powder").phase, Phase::granular);
  EXPECT_EQ(block_of("minecraft:blue_stained_glass_pane").bsdf, "dielectric");
  EXPECT_GT(block_of("minecraft:redstone_lamp[lit=true]").emission.max(), 0);
  EXPECT_EQ(block_of("minecraft:redstone_lamp[lit=false]").emission.max(), 0);
  EXPECT_EQ(block_of("minecraft:water[level=3]").phase, Phase::liquid);
  EXPECT_EQ(block_of("minecraft:water[level=3]").name, "minecraft:water[level=3]");
  EXPECT_EQ(block_of("minecraft:water[level=0]").name, "water");
  EXPECT_EQ(block_of("minecraft:snow[layers=3]").proxy, "layer_3");
  EXPECT_EQ(block_of("minecraft:oak_door[facing=east,half=lower,hinge=left,open=false,powered=false]").proxy,
            "panel_west");
}

TEST(Translation, ATorchOnAWallLeansOnTheOneBehindIt) {
  const TranslationTable& table = translation_table("minecraft");
  const std::pair<const char*, const char*> kBehind[] = {
      {"east", "west"}, {"west", "east"}, {"north", "south"}, {"south", "north"}};
  for (const auto& [facing, behind] : kBehind) {
    const std::string leans = std::string("torch_") + behind, property = std::string("[facing=") + facing + "]";
    for (const char* name : {"wall_torch", "soul_wall_torch"})
      EXPECT_EQ(translate(table, parse_state(name + property))->block.name, leans);
    EXPECT_EQ(translate(table, parse_state("redstone_wall_torch" + property))->block.proxy, leans);
  }
  EXPECT_EQ(translate(table, parse_state("torch"))->block.name, "torch");
  EXPECT_EQ(translate(table, parse_state(numeric_state(table, "50:1")))->block.name, "torch_west");
  EXPECT_EQ(translate(table, parse_state(numeric_state(table, "50:5")))->block.name, "torch");
}

TEST(Translation, NumericIdsBecomeNames) {
  EXPECT_EQ(block_of("1:0").name, "stone");
  EXPECT_EQ(block_of("1:5").name, "andesite");
  EXPECT_EQ(block_of("17:5").name, "spruce_log");
  EXPECT_EQ(block_of("9:0").name, "water");
  EXPECT_EQ(block_of("44:8").proxy, "slab_top");
  EXPECT_EQ(block_of("53:6").proxy, "stairs_south_top");
  EXPECT_EQ(block_of("35:14").name, "wool_red");
}

TEST(Translation, WhatNoRuleKnowsBecomesAPlaceholderThatIsCounted) {
  World world(standard_blocks());
  Translator translator(translation_table("minecraft"), *world.palette);
  const BlockId unknown = translator.block("thatmod:strange \"thing\"[a=b]");
  EXPECT_EQ((*world.palette)[unknown].name, "thatmod:strange__thing_");
  EXPECT_EQ((*world.palette)[unknown].albedo, (Ratio3{0.8f, 0.02f, 0.6f}));
  EXPECT_EQ((*world.palette)[translator.block("3000:4")].name, "minecraft:3000:4");
  EditBatch batch;
  batch.set({1, 2, 3}, unknown);
  ASSERT_TRUE(world.store.apply(batch));
  ImportReport report;
  EXPECT_TRUE(translator.finish(world, "mca", "a.mca", {}, report));
  EXPECT_EQ(report.unmapped, (std::map<std::string, uint64_t>{{"thatmod:strange__thing_", 1}}));
  const Status strict = translator.finish(world, "mca", "a.mca", {.strict = true}, report);
  ASSERT_FALSE(strict);
  EXPECT_EQ(strict.error().kind, ErrorKind::input_output);
}

TEST(Translation, NamesForLoamsBlocksLeadBack) {
  const TranslationTable& table = translation_table("minecraft");
  int named = 0;
  for (size_t id = 1; id < standard_blocks().size(); ++id) {
    const std::string& loam = standard_blocks()[static_cast<BlockId>(id)].name;
    const std::string name = foreign_name(table, loam);
    if (name.empty()) continue;
    ++named;
    EXPECT_EQ(block_of(name).name, loam);
  }
  EXPECT_GT(named, 180);
}

TEST(Translation, AHostileListOfNamesEndsInOnePlaceholder) {
  BlockPalette palette = standard_blocks();
  Translator translator(translation_table("minecraft"), palette);
  for (int i = 0; i < 70'000; ++i) translator.block("mod:block" + std::to_string(i));
  EXPECT_LT(palette.size(), 5000u);
}

}  // namespace
}  // namespace world
