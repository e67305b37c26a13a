/// The laws of blocks, on every block of world/blocks/*.toml.
#include <set>

#include <gtest/gtest.h>

#include "world/blocks/block.h"

namespace world {
namespace {

TEST(EveryBlock, PassesItsOwnChecks) {
  const BlockPalette& blocks = standard_blocks();
  for (size_t id = 0; id < blocks.size(); ++id) {
    const Status checked = check_block(blocks[static_cast<BlockId>(id)]);
    EXPECT_TRUE(checked.ok()) << checked.error().message;
  }
}

TEST(EveryBlock, ScattersLessThanArrives) {
  const BlockPalette& blocks = standard_blocks();
  for (size_t id = 0; id < blocks.size(); ++id) {
    const Ratio3 albedo = blocks[static_cast<BlockId>(id)].albedo;
    for (const float band : {albedo.r, albedo.g, albedo.b}) {
      EXPECT_GT(band, 0.0f) << blocks[static_cast<BlockId>(id)].name;
      EXPECT_LT(band, 1.0f) << blocks[static_cast<BlockId>(id)].name;
    }
  }
}

TEST(EveryBlock, IsFoundByItsNameWhichIsUnique) {
  const BlockPalette& blocks = standard_blocks();
  std::set<std::string> names;
  for (size_t id = 0; id < blocks.size(); ++id) {
    const std::string& name = blocks[static_cast<BlockId>(id)].name;
    EXPECT_EQ(blocks.find(name), static_cast<BlockId>(id)) << name;
    EXPECT_TRUE(names.insert(name).second) << name;
  }
}

TEST(EveryBlock, PhaseFitsItsOtherProperties) {
  const BlockPalette& blocks = standard_blocks();
  for (size_t id = 0; id < blocks.size(); ++id) {
    const Block& block = blocks[static_cast<BlockId>(id)];
    const bool gas = block.phase == Phase::gas, fluid = gas || block.phase == Phase::liquid;
    EXPECT_EQ(block.density.value < 10, gas) << block.name;
    EXPECT_EQ(block.hardness == 0, fluid) << block.name;
    EXPECT_FALSE(gas && block.opaque) << block.name;
  }
}

TEST(EveryBlock, SaysHowItRestsOrFlowsIfItDoes) {
  // What is poured in heaps or flows has a value of its own, found in a table, though it may be that of water.
  const BlockPalette& blocks = standard_blocks();
  const Block usual;
  std::set<double> angles, viscosities;
  for (size_t id = 0; id < blocks.size(); ++id) {
    const Block& block = blocks[static_cast<BlockId>(id)];
    if (block.phase == Phase::granular) {
      angles.insert(block.repose_deg);
      EXPECT_NE(block.repose_deg, usual.repose_deg) << block.name;
    } else {
      EXPECT_EQ(block.repose_deg, usual.repose_deg) << block.name;
    }
    if (block.phase == Phase::liquid)
      viscosities.insert(block.viscosity_pa_s);
    else
      EXPECT_EQ(block.viscosity_pa_s, usual.viscosity_pa_s) << block.name;
  }
  EXPECT_GE(angles.size(), 5u);
  EXPECT_EQ(viscosities.size(), 7u);
  const auto viscosity = [&](const char* name) { return blocks[*blocks.find(name)].viscosity_pa_s; };
  EXPECT_LT(viscosity("water"), viscosity("mercury"));
  EXPECT_LT(viscosity("mercury"), viscosity("oil"));
  EXPECT_LT(viscosity("oil"), viscosity("honey"));
  EXPECT_LT(viscosity("honey"), viscosity("lava"));
}

TEST(EveryBlock, WhatIsDrawnAsAProxyLetsLightPast) {
  const BlockPalette& blocks = standard_blocks();
  for (size_t id = 0; id < blocks.size(); ++id) {
    const Block& block = blocks[static_cast<BlockId>(id)];
    EXPECT_TRUE(block.proxy.empty() || !block.opaque) << block.name;
  }
}

TEST(StandardBlocks, AreEightyOrMoreOfEachKind) {
  const BlockPalette& blocks = standard_blocks();
  EXPECT_GE(blocks.size(), 81u);
  for (const char* name :
       {"stone",       "granite",    "basalt",     "limestone",  "sandstone",    "slate",       "marble",
        "coal_ore",    "iron_ore",   "copper_ore", "gold_ore",   "dirt",         "grass",       "clay",
        "mud",         "sand",       "red_sand",   "gravel",     "snow",         "ice",         "packed_ice",
        "water",       "lava",       "oil",        "glass",      "glass_red",    "glass_green", "glass_blue",
        "oak_log",     "oak_planks", "oak_leaves", "birch_log",  "birch_leaves", "pine_log",    "pine_needles",
        "reed",        "tall_grass", "fence_oak",  "torch",      "lamp_warm",    "lamp_white",  "lamp_red",
        "lamp_green",  "lamp_blue",  "lantern",    "iron_block", "copper_block", "gold_block",  "brick_red",
        "brick_stone", "smoke",      "steam",      "fire"})
    EXPECT_TRUE(blocks.find(name)) << name;
}

}  // namespace
}  // namespace world
