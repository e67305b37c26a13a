#include "tools/diff.h"

#include <cmath>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>
#include <sys/wait.h>

#include "render/image/display.h"
#include "render/image/png_exr.h"
#include "tests/support.h"
#include "world/formats/format.h"

namespace tools {
namespace {

render::Image8 ramp(int width, int height) {
  render::Image8 image{width, height, {}};
  for (int i = 0; i < width * height * 3; ++i) image.pixels.push_back(static_cast<unsigned char>(i * 7));
  return image;
}

world::BlockPalette small_palette(const std::vector<std::string>& names) {
  world::BlockPalette palette;
  for (const std::string& name : names) {
    world::Block block;
    block.name = name;
    EXPECT_TRUE(palette.add(block).ok());
  }
  return palette;
}

void put(world::World& world, world::VoxelPos pos, const std::string& name) {
  world::EditBatch batch;
  batch.set(pos, *world.palette->find(name));
  EXPECT_TRUE(world.store.apply(batch).ok());
}

struct Outcome {
  int code = -1;
  std::string out, error;
};

class Diff : public ::testing::Test {
 protected:
  std::string path(const std::string& name) { return (folder_ / name).string(); }
  Outcome run(const std::string& arguments) {
    const std::string line =
        "'" LOAM_COMMAND "' diff " + arguments + " >'" + path("out") + "' 2>'" + path("error") + "'";
    const int status = std::system(line.c_str());
    const auto slurp = [](const std::string& file) {
      std::ifstream in(file, std::ios::binary);
      return std::string(std::istreambuf_iterator<char>(in), {});
    };
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, slurp(path("out")), slurp(path("error"))};
  }
  world::TemporaryFolder folder_;
};

TEST_F(Diff, EqualPicturesAreEqualInValidJson) {
  ASSERT_TRUE(render::write_png(path("a.png"), ramp(9, 7), {{"commit", "1"}}).ok());
  ASSERT_TRUE(render::write_png(path("b.png"), ramp(9, 7), {{"commit", "2"}}).ok());
  const Outcome outcome = run(path("a.png") + " " + path("b.png") + " --json --equal --min-psnr 99 --max-flip 0");
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  const nlohmann::json json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["equal"], true);
  EXPECT_EQ(json["mse"], 0.0);
  EXPECT_TRUE(json["psnr"].is_null());
  EXPECT_EQ(json["ssim"], 1.0);
  EXPECT_EQ(json["flip"], 0.0);
  EXPECT_EQ(json["fraction_within_1"], 1.0);
  for (const char* key : {"rel_mse", "worst"}) EXPECT_TRUE(json.contains(key)) << key;
}

TEST_F(Diff, OnlyAskedThresholdsFail) {
  render::Image8 changed = ramp(10, 10);
  changed.pixels[3 * 57 + 1] ^= 0x40;
  ASSERT_TRUE(render::write_png(path("a.png"), ramp(10, 10)).ok());
  ASSERT_TRUE(render::write_png(path("b.png"), changed).ok());
  const std::string both = path("a.png") + " " + path("b.png");
  const Outcome plain = run(both);
  EXPECT_EQ(plain.code, 0) << plain.error;
  EXPECT_NE(plain.out.find("(7, 5)"), std::string::npos) << plain.out;
  EXPECT_EQ(run(both + " --min-within 0.99").code, 0);
  const Outcome within = run(both + " --min-within 0.995 --json");
  EXPECT_EQ(within.code, 1);
  EXPECT_NE(within.error.find("fraction_within_1 is 0.99"), std::string::npos) << within.error;
  EXPECT_EQ(nlohmann::json::parse(within.out)["failed"].size(), 1u);
  EXPECT_EQ(run(both + " --equal").code, 1);
  EXPECT_EQ(run(both + " --max-mse 0").code, 1);
  EXPECT_EQ(run(both + " --max-mse 1").code, 0);
  EXPECT_EQ(run(both + " --min-psnr 100").code, 1);
  EXPECT_EQ(run(both + " --max-mse x").code, 2);
}

TEST_F(Diff, MapShowsWhereAndIsBlackElsewhere) {
  render::Image8 changed = ramp(60, 50);
  for (int c = 0; c < 3; ++c) changed.pixels[static_cast<size_t>(3 * (30 * 60 + 20) + c)] ^= 0x80;
  ASSERT_TRUE(render::write_png(path("a.png"), ramp(60, 50)).ok());
  ASSERT_TRUE(render::write_png(path("b.png"), changed).ok());
  ASSERT_EQ(run(path("a.png") + " " + path("b.png") + " --map " + path("map.png")).code, 0);
  const auto file = render::read_png(path("map.png"));
  ASSERT_TRUE(file.ok());
  const render::Image8 map = render::image8_from_png(*file);
  ASSERT_EQ(map.width, 60);
  ASSERT_EQ(map.height, 50);
  const auto light = [&](int x, int y) {
    const size_t i = static_cast<size_t>(3 * (y * 60 + x));
    return map.pixels[i] + map.pixels[i + 1] + map.pixels[i + 2];
  };
  EXPECT_GT(light(20, 30), 50);
  EXPECT_EQ(light(50, 30), 0);
  EXPECT_EQ(light(20, 5), 0);
}

TEST_F(Diff, PicturesOfRadianceAndOfCodesCompare) {
  render::Image image(8, 8);
  for (size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = {static_cast<float>(i), 2, 3};
  ASSERT_TRUE(render::write_exr(path("a.exr"), image).ok());
  ASSERT_TRUE(render::write_png(path("shown.png"), render::display_image(image, 0)).ok());
  const auto mixed = compare_picture_files(path("a.exr"), path("shown.png"));
  ASSERT_TRUE(mixed.ok());
  EXPECT_TRUE(mixed->metrics.equal);
  image.pixels[3].r = std::numeric_limits<float>::quiet_NaN();
  ASSERT_TRUE(render::write_exr(path("b.exr"), image).ok());
  const Outcome outcome = run(path("b.exr") + " " + path("a.exr") + " --json");
  EXPECT_EQ(outcome.code, 0);
  const nlohmann::json json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["not_finite"], 1);
  EXPECT_TRUE(json["worst"]["a"][0].is_null());
  EXPECT_EQ(json["worst"]["x"], 3);
  EXPECT_EQ(run(path("b.exr") + " " + path("a.exr") + " --max-mse 1").code, 1);
}

TEST_F(Diff, BadInputIsOneSentenceAndExitThree) {
  ASSERT_TRUE(render::write_png(path("a.png"), ramp(9, 7)).ok());
  ASSERT_TRUE(render::write_png(path("wide.png"), ramp(10, 7)).ok());
  std::ofstream(path("text.png")) << "hello";
  std::ofstream(path("empty.vox"));
  for (const auto& [b, holds] : {std::pair{"wide.png", "10 x 7"},
                                 {"text.png", "text.png"},
                                 {"missing.png", "missing.png"},
                                 {"empty.vox", "two pictures or two worlds"}}) {
    const Outcome outcome = run(path("a.png") + " " + path(b) + " --json");
    EXPECT_EQ(outcome.code, 3) << b;
    EXPECT_NE(outcome.error.find(holds), std::string::npos) << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    EXPECT_TRUE(outcome.out.empty());
  }
  EXPECT_EQ(run(path("a.png")).code, 2);
  EXPECT_EQ(run(path("a.png") + " " + path("a.png") + " --map " + path("none/map.png")).code, 3);
}

TEST_F(Diff, WorldsCompareByNameWhateverTheirIds) {
  world::World a(small_palette({"clay", "stone"})), b(small_palette({"stone", "moss", "clay"}));
  for (world::World* w : {&a, &b}) {
    put(*w, {-1, 5, 300}, "stone");
    put(*w, {4, 4, 4}, "clay");
  }
  EXPECT_TRUE(compare_worlds(a, b).equal());
  put(b, {4, 4, 4}, "moss");
  put(b, {-200, 0, 0}, "stone");
  put(a, {0, 0, 0}, "clay");
  const WorldDifference d = compare_worlds(a, b);
  EXPECT_EQ(d.differing, 3u);
  EXPECT_EQ(d.only_a, 1u);
  EXPECT_EQ(d.only_b, 1u);
  ASSERT_EQ(d.first.size(), 3u);
  EXPECT_EQ(d.first[0].pos, (world::VoxelPos{-200, 0, 0}));
  EXPECT_EQ(d.first[0].a, "air");
  EXPECT_EQ(d.first[0].b, "stone");
  EXPECT_EQ(d.first[1].pos, (world::VoxelPos{0, 0, 0}));
  EXPECT_EQ(d.first[2].pos, (world::VoxelPos{4, 4, 4}));
  EXPECT_EQ(d.first[2].a, "clay");
  EXPECT_EQ(d.first[2].b, "moss");
}

TEST_F(Diff, TilesEqualTheSameVoxelsOneByOne) {
  world::World a(small_palette({"stone"})), b(small_palette({"stone"}));
  world::EditBatch whole, single;
  whole.fill({{0, 0, 0}, {127, 127, 127}}, 1);
  for (int y = 0; y < 128; ++y) single.fill({{0, y, 0}, {127, y, 127}}, 1);
  ASSERT_TRUE(a.store.apply(whole).ok());
  ASSERT_TRUE(b.store.apply(single).ok());
  EXPECT_TRUE(compare_worlds(a, b).equal());
  world::World empty;
  const WorldDifference d = compare_worlds(a, empty, 4);
  EXPECT_EQ(d.differing, 128u * 128 * 128);
  EXPECT_EQ(d.only_a, d.differing);
  EXPECT_EQ(d.first.size(), 4u);
}

TEST_F(Diff, WorldFilesCompareFromTheCommand) {
  world::World a(world::standard_blocks()), b(world::standard_blocks());
  put(a, {1, 2, 3}, "granite"), put(b, {1, 2, 3}, "granite"), put(b, {9, 2, 3}, "granite");
  ASSERT_TRUE(world::write_world(a, path("a.loam")).ok());
  ASSERT_TRUE(world::write_world(b, path("b.loam")).ok());
  const Outcome outcome = run(path("a.loam") + " " + path("b.loam") + " --json");
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  const nlohmann::json json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["equal"], false);
  EXPECT_EQ(json["differing"], 1);
  EXPECT_EQ(json["first"][0]["position"], (nlohmann::json{9, 2, 3}));
  EXPECT_EQ(run(path("a.loam") + " " + path("b.loam") + " --equal").code, 1);
  EXPECT_EQ(run(path("a.loam") + " " + path("a.loam") + " --equal").code, 0);
  EXPECT_EQ(run(path("a.loam") + " " + path("b.loam") + " --max-mse 1").code, 2);
}

TEST_F(Diff, LayersOfWorldsCompareVoxelByVoxel) {
  world::World a(world::standard_blocks()), b(world::standard_blocks());
  for (world::World* w : {&a, &b}) {
    put(*w, {1, 2, 3}, "water"), put(*w, {9, 2, 3}, "water");
    w->store.make_int_layer(world::Layer::liquid).set({1, 2, 3}, 100);
    w->store.make_int_layer(world::Layer::heat).set({1, 2, 3}, 7);
  }
  EXPECT_TRUE(compare_worlds(a, b).equal());
  b.store.make_int_layer(world::Layer::liquid).set({1, 2, 3}, 101);
  b.store.make_int_layer(world::Layer::liquid).set({9, 2, 3}, 5);
  a.store.make_int_layer(world::Layer::gas).set({4, 4, 4}, 0);  // 0 is a value, other than none
  ASSERT_TRUE(world::write_world(a, path("a.loam")).ok());
  ASSERT_TRUE(world::write_world(b, path("b.loam")).ok());
  const Outcome outcome = run(path("a.loam") + " " + path("b.loam") + " --json");
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  const nlohmann::json json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["equal"], false);
  EXPECT_EQ(json["differing"], 0);
  ASSERT_EQ(json["layers"].size(), 2u);
  EXPECT_EQ(json["layers"][0]["layer"], "liquid");
  EXPECT_EQ(json["layers"][0]["differing"], 2);
  EXPECT_EQ(json["layers"][0]["position"], (nlohmann::json{1, 2, 3}));
  EXPECT_EQ(json["layers"][0]["a"], 100);
  EXPECT_EQ(json["layers"][0]["b"], 101);
  EXPECT_EQ(json["layers"][1]["layer"], "gas");
  EXPECT_EQ(json["layers"][1]["a"], 0);
  EXPECT_TRUE(json["layers"][1]["b"].is_null());
  EXPECT_EQ(run(path("a.loam") + " " + path("b.loam") + " --equal").code, 1);
}

}  // namespace
}  // namespace tools
