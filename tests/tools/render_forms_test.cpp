// Forms of pictures that the command makes: strips, sheets, paths, layers, and what their files say.
#include "tools/picture_forms.h"

#include <cmath>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <nlohmann/json.hpp>

#include "render/image/display.h"
#include "render/image/png_exr.h"
#include "tests/tools/command.h"

namespace tools {
namespace {

const char* const kScene = R"(
what = "Two blocks, seen along a path"
[world]
generator = "flat"
size = [32, 16, 32]
[[fill]]
min = [0, 0, 0]
max = [31, 0, 31]
block = "grass"
[[fill]]
min = [0, 1, 0]
max = [31, 15, 31]
block = "air"
[[fill]]
min = [12, 1, 12]
max = [19, 8, 19]
block = "brick_red"
[[camera]]
name = "still"
position = [34.5, 14.25, 36.5]
look_at = [16, 3, 16]
[[camera]]
name = "walk@0"
position = [40, 14, 40]
look_at = [16, 3, 16]
fov_deg = 50
[[camera]]
name = "walk@10"
position = [40, 14, -8]
look_at = [16, 3, 16]
fov_deg = 70
[[camera]]
name = "walk@40"
position = [-8, 14, -8]
look_at = [16, 3, 16]
fov_deg = 50
)";

class RenderForms : public Command {
 protected:
  void SetUp() override { write("scene.toml", kScene); }
  std::string render(const std::string& rest) {
    const Outcome outcome = run("render " + path("scene.toml") + " --backend raycast " + rest);
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    return outcome.out;
  }
  render::PngFile png(const std::string& name) {
    auto file = render::read_png(folder_ / name);
    EXPECT_TRUE(file.ok()) << (file.ok() ? "" : file.error().message);
    return file.ok() ? std::move(*file) : render::PngFile{};
  }
};

TEST_F(RenderForms, APictureSaysWhereItComesFrom) {
  render("--size 40x30 --camera still -o " + path("a.png"));
  const render::PictureText text = png("a.png").text;
  for (const char* key : {"scene", "camera", "camera_voxel", "camera_forward", "camera_vertical_fov", "knobs",
                          "backend", "commit", "world_hash", "tick", "world_seed"})
    EXPECT_TRUE(text.contains(key)) << key;
  EXPECT_EQ(text.at("camera"), "still");
  EXPECT_EQ(text.at("tick"), "0");
  EXPECT_EQ(text.at("world_hash").size(), 16u);
}

TEST_F(RenderForms, StripsMakeUpThePictureWithItsEffects) {
  const std::string effects =
      " --vignette 0.8 --tone_map filmic --grain 0.03 --chromatic_aberration 0.01 --lens_flare 0.5 --size 123x77 "
      "--camera still -o ";
  render(effects + path("whole.png"));
  render("--strip-rows 10" + effects + path("strips.png"));
  const render::PngFile whole = png("whole.png"), strips = png("strips.png");
  ASSERT_EQ(whole.samples.size(), strips.samples.size());
  size_t off = 0;
  for (size_t i = 0; i < whole.samples.size(); ++i) off += std::abs(int{whole.samples[i]} - int{strips.samples[i]}) > 1;
  EXPECT_LE(off, 6u);  // rays start from other bits: a few at edges fall to the other side
  // What looks far comes from a smaller picture of the whole: here of the same size, so as near.
  const std::string far = " --bloom 0.2 --exposure_mode histogram --size 96x64 --camera still -o ";
  render(far + path("far.png"));
  render("--strip-rows 7" + far + path("far_strips.png"));
  const render::PngFile a = png("far.png"), b = png("far_strips.png");
  off = 0;
  for (size_t i = 0; i < a.samples.size(); ++i) off += std::abs(int{a.samples[i]} - int{b.samples[i]}) > 1;
  EXPECT_LE(off, 6u);
}

TEST_F(RenderForms, StripsGoIntoAnExrTooAndStayRadiance) {
  render("--size 60x40 --camera still --tone_map filmic -o " + path("whole.exr"));
  render("--size 60x40 --camera still --strip-rows 16 -o " + path("strips.exr"));
  const auto whole = render::read_exr(folder_ / "whole.exr"), strips = render::read_exr(folder_ / "strips.exr");
  ASSERT_TRUE(whole.ok() && strips.ok());
  size_t off = 0;
  for (size_t i = 0; i < whole->image.pixels.size(); ++i)
    off += std::abs(whole->image.pixels[i].g - strips->image.pixels[i].g) > 1e-3f;
  EXPECT_LE(off, 4u);
}

TEST_F(RenderForms, ManyRowsOfAPictureNeedNoMoreMemoryThanFew) {
  // 16384 x 512 pixels would be 100 MB of radiance at once; in strips of 16 rows the limit of 1 GiB of address space
  // holds the program and its threads as it does for a small picture.
  const Outcome outcome =
      run("render " + path("scene.toml") + " --backend raycast -t 1 --size 16384x512 --strip-rows 16" +
              " --camera still --json -o " + path("wide.png"),
          "ulimit -v 1048576; ");
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_GT(std::filesystem::file_size(folder_ / "wide.png"), 10000u);
}

TEST_F(RenderForms, APathPassesItsKeysSmoothly) {
  world::World world;
  const auto key = [&](const char* name, double x, double fov) {
    world::CameraPlacement camera;
    camera.name = name;
    camera.position = world::WorldPoint::from(x, 10, 0);
    camera.vertical_fov_deg = fov;
    world.cameras.push_back(camera);
  };
  key("walk@40", 80, 50), key("walk@0", 0, 50), key("walk@10", 20, 70), key("other@5", 5, 60), key("walk@x", 1, 60);
  const auto path = CameraPath::of(world, "walk");
  ASSERT_TRUE(path.has_value());
  EXPECT_FALSE(CameraPath::of(world, "other").has_value());
  EXPECT_EQ(path->first_frame(), 0);
  EXPECT_EQ(path->last_frame(), 40);
  const auto x_at = [&](double frame) {
    const world::WorldPoint p = path->at(frame).position;
    return p.voxel.x + p.fraction.x;
  };
  for (const auto& [frame, x] : std::vector<std::pair<double, double>>{{0, 0}, {10, 20}, {40, 80}, {-5, 0}, {99, 80}})
    EXPECT_NEAR(x_at(frame), x, 1e-9) << frame;
  // Keys at an even speed are passed at that speed, at uneven times too.
  for (double frame = 0; frame <= 40; frame += 0.5) EXPECT_NEAR(x_at(frame), 2 * frame, 1e-9) << frame;
  EXPECT_NEAR(path->at(10).vertical_fov, 70 * 3.14159265358979 / 180, 1e-9);
  // No jump, and no jump of speed, at a key.
  const auto fov = [&](double frame) { return path->at(frame).vertical_fov; };
  EXPECT_NEAR((fov(10) - fov(9.999)) / 0.001, (fov(10.001) - fov(10)) / 0.001, 1e-3);
}

TEST_F(RenderForms, FramesOfAPathAndASheetOfThem) {
  render("--size 32x24 --camera walk --frames 8..11 -o " + path("f_###.png"));
  for (const char* name : {"f_008.png", "f_009.png", "f_010.png", "f_011.png"}) EXPECT_TRUE(exists(name)) << name;
  EXPECT_EQ(png("f_009.png").text.at("camera"), "walk@9");
  EXPECT_NE(png("f_008.png").samples, png("f_011.png").samples);
  render("--size 32x24 --camera walk --frames 8..11 --sheet 3 -o " + path("sheet.png"));
  const render::PngFile sheet = png("sheet.png"), first = png("f_008.png");
  ASSERT_EQ(sheet.width, 3 * 34 - 2);
  ASSERT_EQ(sheet.height, 2 * 26 - 2);
  for (int y = 0; y < 24; ++y)
    for (int x = 0; x < 3 * 32; ++x)
      ASSERT_EQ(sheet.samples[static_cast<size_t>(y * sheet.width * 3 + x)],
                first.samples[static_cast<size_t>(y * 32 * 3 + x)]);
  EXPECT_EQ(sheet.text.at("cell_001"), "walk@9");
  // Of all cameras, where nothing else is asked for.
  render("--size 32x24 --sheet 2 -o " + path("all.png"));
  EXPECT_EQ(png("all.png").height, 2 * 26 - 2);
}

TEST_F(RenderForms, LayersKnowDistanceDirectionAndBlock) {
  render("--size 40x30 --camera still --outputs depth,normal,id -o " + path("a.png"));
  for (const char* name : {"a.png", "a.depth.png", "a.normal.png", "a.id.png"}) EXPECT_TRUE(exists(name)) << name;
  // The middle looks at the red block's top, at (16, 9): up is green in a picture of normals.
  const render::PngFile normal = png("a.normal.png");
  const size_t bottom = static_cast<size_t>((29 * 40 + 20) * 3);
  EXPECT_NEAR(normal.samples[bottom + 1], 255, 1);
  EXPECT_NEAR(normal.samples[bottom], 128, 1);
  render("--size 40x30 --camera still --outputs id,depth,normal -o " + path("a.exr"));
  Imf::InputFile exr((folder_ / "a.exr").c_str());
  for (const char* channel : {"R", "G", "B", "Z", "N.X", "N.Y", "N.Z", "id"})
    EXPECT_NE(exr.header().channels().findChannel(channel), nullptr) << channel;
  EXPECT_TRUE(render::read_exr(folder_ / "a.exr").ok());
}

TEST_F(RenderForms, WhatCannotGoTogetherIsAUsageError) {
  const std::string scene = "render " + path("scene.toml") + " --backend raycast ";
  const std::string out = " -o " + path("a.png");
  for (const char* size : {"0x0", "65536x65536", "16385x1", "1x0", "-4x4", "axb"})
    expect_one_sentence(run(scene + "--size=" + size + out), 2, "16384");
  expect_one_sentence(run(scene + "--outputs depth,colour" + out), 2, "colour");
  expect_one_sentence(run(scene + "--size 16384x16384 --frames 0..3" + out), 2, "strips");
  expect_one_sentence(run(scene + "--sheet 2 --outputs id" + out), 2, "--sheet");
  expect_one_sentence(run(scene + "--bloom 2" + out), 2, "bloom");
  expect_one_sentence(run(scene + "--tone_map nice" + out), 2, "filmic");
  EXPECT_FALSE(exists("a.png"));
}

}  // namespace
}  // namespace tools
