// Light in three bands: each is what one band alone would be.
#include <fmt/format.h>

#include "sim/light/game_rules.h"
#include "tests/sim/light/light_support.h"

namespace sim {
namespace {

using world::EditBatch;
using world::LightModel;
using world::LightSample;
using world::Store;

/// Coloured lamps and panes beside what treats all bands alike.
LightBlocks coloured_blocks() {
  LightBlocks blocks = every_kind_of_block();
  const auto pane = [](int r, int g, int b) {
    std::array<BlockOptics, 3> bands;
    const int loss[3] = {r, g, b};
    for (size_t i = 0; i < 3; ++i)
      bands[i] = {.loss = static_cast<uint8_t>(loss[i]), .level = 0, .passes_sky = loss[i] == 1};
    return bands;
  };
  const auto lamp = [](int r, int g, int b, int loss) {
    std::array<BlockOptics, 3> bands;
    const int level[3] = {r, g, b};
    for (size_t i = 0; i < 3; ++i)
      bands[i] = {.loss = static_cast<uint8_t>(loss), .level = static_cast<uint8_t>(level[i]), .passes_sky = false};
    return bands;
  };
  blocks.add("red_pane", pane(1, 0, 0), false);
  blocks.add("teal_pane", pane(6, 1, 2), false);
  blocks.add("red_lamp", lamp(15, 2, 0, 0), true);
  blocks.add("blue_flame", lamp(1, 6, 14, 1), false);
  return blocks;
}

EditBatch random_rooms(uint64_t seed, int count, size_t kinds) {
  EditBatch batch;
  for (int i = 0; i < count; ++i) {
    VoxelPos v;
    for (int a = 0; a < 3; ++a) v[a] = static_cast<int>(bits(seed, i, a) % 30) - 12;
    const int size = static_cast<int>(bits(seed, i, 3) % 5);
    batch.fill({v, v + VoxelPos{size, size % 3, size}},
               bits(seed, i, 4) % 3 ? static_cast<BlockId>(bits(seed, i, 5) % kinds) : world::kAir);
  }
  return batch;
}

TEST(FloodRgb, EachBandIsWhatItWouldBeAlone) {
  const LightBlocks blocks = coloured_blocks();
  Store store(blocks.palette);
  FloodLight light(store, LightModel::flood_rgb, blocks.rules);
  for (uint64_t step = 0; step < 40; ++step) {
    ASSERT_TRUE(store.apply(random_rooms(step, step == 0 ? 300 : 12, blocks.palette.size())).ok());
    light.update();
    if (step % 4) continue;
    for (size_t band = 0; band < 3; ++band) {
      LightRules alone = blocks.rules;
      for (size_t id = 0; id < alone.bands.size(); ++id) alone.all_bands[id] = alone.bands[id][band];
      FloodLight one(store, LightModel::flood4, alone);
      one.compute();
      const int b = static_cast<int>(band);
      EXPECT_EQ(light.volume().sky(b).content_hash(), one.volume().sky().content_hash()) << step << ", band " << b;
      EXPECT_EQ(light.volume().block(b).content_hash(), one.volume().block().content_hash()) << step << ", band " << b;
    }
  }
}

TEST(FloodRgb, ASkyThatNothingColoursIsOneField) {
  world::BlockPalette palette;
  world::Block stone;
  stone.name = "stone";
  const BlockId stone_id = *palette.add(stone);
  Store store(palette);
  EditBatch batch;
  batch.fill({{0, 0, 0}, {20, 0, 20}}, stone_id);
  batch.fill({{0, 9, 0}, {20, 9, 20}}, stone_id);
  ASSERT_TRUE(store.apply(batch).ok());
  FloodLight light(store, LightModel::flood_rgb);
  light.update();
  EXPECT_EQ(light.volume().fields().size(), 4u);
  // A block that filters comes into the palette, and then into the roof: the floor below turns red.
  world::Block pane;
  pane.name = "ruby";
  pane.opaque = false;
  pane.absorption = {0, 5, 5};
  const BlockId ruby = *palette.add(pane);
  EditBatch window;
  window.fill({{9, 9, 9}, {11, 9, 11}}, ruby);
  ASSERT_TRUE(store.apply(window).ok());
  light.update();
  EXPECT_EQ(light.volume().fields().size(), 6u);
  const LightSample below = light.volume().sample({10, 1, 10});
  EXPECT_EQ(below.sky[0], 15);
  EXPECT_EQ(below.sky[1], 4);  // from beside the roof, eleven steps away
  EXPECT_EQ(below.sky[1], below.sky[2]);
  FloodLight anew(store, LightModel::flood_rgb);
  anew.compute();
  EXPECT_EQ(light.volume().content_hash(), anew.volume().content_hash());
}

TEST(FloodRgb, LampsOfThePaletteShineInTheirColours) {
  const world::BlockPalette& palette = world::standard_blocks();
  const LightRules rules = light_rules(palette);
  const auto levels = [&](const char* name) {
    const auto& bands = rules.bands[*palette.find(name)];
    return std::array<int, 3>{bands[0].level, bands[1].level, bands[2].level};
  };
  EXPECT_EQ(levels("lamp_white"), (std::array<int, 3>{15, 15, 15}));
  EXPECT_EQ(levels("lamp_red"), (std::array<int, 3>{15, 2, 1}));
  EXPECT_EQ(levels("torch"), (std::array<int, 3>{13, 10, 3}));
  EXPECT_EQ(levels("stone"), (std::array<int, 3>{0, 0, 0}));
  // Water takes a level a metre more of red than of blue, and lets no band straight down.
  const auto& water = rules.bands[*palette.find("water")];
  EXPECT_EQ(water[0].loss, 2);
  EXPECT_EQ(water[2].loss, 1);
  EXPECT_FALSE(water[2].passes_sky);
  EXPECT_TRUE(rules.all_bands[world::kAir].passes_sky);
}

TEST(GameRules, SayWhatIsWrongAndWhere) {
  const auto error = [](const std::string& text) { return read_game_rules(text, "games.toml").error().message; };
  const std::string head = "namespace = \"a\"\nsky_level = 15\n";
  EXPECT_NE(error("namespace = \"a\"\nsky_level = 16\n").find("games.toml:2"), std::string::npos);
  EXPECT_NE(error(head + "[[blocks]]\nnames = [\"b\"]\nloss = 2\npasses_sky = true\n").find("games.toml:5"),
            std::string::npos);
  EXPECT_NE(error(head + "[[sources]]\nnames = [\"b\"]\nlevel = 3\nwhen = \"lit\"\n").find("property=value"),
            std::string::npos);
  EXPECT_NE(error(head + "[[sources]]\nnames = [\"b\"]\nlevels = 3\n").find("levels"), std::string::npos);
  EXPECT_NE(game_rules("quake").error().message.find("minecraft_1_14"), std::string::npos);
  const auto rules = game_rules("minecraft_1_13");
  ASSERT_TRUE(rules.ok()) << rules.error().message;
  EXPECT_EQ(rules->optics(world::parse_state("minecraft:stone")), (BlockOptics{.loss = 0}));
  EXPECT_EQ(rules->optics(world::parse_state("minecraft:furnace[facing=north,lit=true]")),
            (BlockOptics{.loss = 1, .level = 13}));
  EXPECT_EQ(rules->optics(world::parse_state("minecraft:furnace[facing=north,lit=false]")), (BlockOptics{.loss = 0}));
  EXPECT_EQ(rules->optics(world::parse_state("minecraft:oak_fence[waterlogged=true]")), (BlockOptics{.loss = 1}));
}

}  // namespace
}  // namespace sim
