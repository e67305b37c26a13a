/// What holds of every shader, told by its text: hard cases R7, R10 and R20; and that what order its atomics run in
/// shows in no picture.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/render/raster/both_backends.h"
#include "tests/render/raster/compare_pictures.h"
#include "tests/render/raster/small_worlds.h"
#include "tests/support.h"

namespace render {
namespace {

struct Line {
  std::string file, text;
};

/// Of all shaders and what they include, but what a comment says.
const std::vector<Line>& shader_lines() {
  static const std::vector<Line> lines = [] {
    std::vector<Line> all;
    for (const char* top : {"render", "world"})
      for (const auto& entry :
           std::filesystem::recursive_directory_iterator(std::filesystem::path(world::kSourceFolder) / top)) {
        const std::string file = entry.path().filename();
        if (!file.ends_with(".glsl") && !file.ends_with(".glsl.h") && !file.ends_with(".shared.h")) continue;
        std::ifstream in(entry.path());
        for (std::string text; std::getline(in, text);) all.push_back({file, text.substr(0, text.find("//"))});
      }
    return all;
  }();
  return lines;
}

std::vector<std::string> lines_with(const char* pattern) {
  const std::regex wanted(pattern);
  std::vector<std::string> found;
  for (const Line& line : shader_lines())
    if (std::regex_search(line.text, wanted)) found.push_back(line.file + ":" + line.text);
  return found;
}

/// Beyond 2^24 a float skips integers. What a vertex or an instance is stays an integer up to the pixel.
TEST(HardCaseR7, NoShaderCountsInFloats) {
  ASSERT_GT(lines_with("gl_InstanceIndex").size(), 5u) << "the scan found too few shaders";
  for (const std::string& line : lines_with(R"((float|vec[234])\(gl_(Vertex|Instance)Index\))"))
    EXPECT_EQ(line.substr(0, line.find(':')), "outline.vert.glsl") << line << ": there are 9 of those";
  for (const Line& line : shader_lines()) {
    const bool attribute = std::regex_search(line.text, std::regex(R"(layout\(location.*\) in )"));
    if (line.file.ends_with(".vert.glsl") && line.file != "overlay.vert.glsl") {
      EXPECT_FALSE(attribute) << line.file << line.text << ": records are pulled by their index";
    }
  }
}

/// A walk ends after a number of steps that it states, whatever the world; what has no such number looks a place up
/// in a table that is never full, halves an interval, counts up to a number at its body's end, or takes what is left of
/// a list.
TEST(HardCaseR10, EveryLoopOfAShaderEnds) {
  ASSERT_GT(lines_with(R"(for \()").size(), 50u) << "the scan found too few shaders";
  const std::vector<Line>& lines = shader_lines();
  const std::regex endless(R"(for \((?:(?:\w+ )?(\w+) = )?([^;]*);\s*;)");
  for (std::size_t at = 0; at < lines.size(); ++at) {
    std::smatch loop;
    if (!std::regex_search(lines[at].text, loop, endless)) continue;
    bool ends = loop[2].str().starts_with("region_hash(");
    for (std::size_t body = at + 1; !ends && loop[1].matched && body < std::min(at + 8, lines.size()); ++body)
      ends = lines[body].text.find("if (++" + loop[1].str() + " >= ") != std::string::npos;
    EXPECT_TRUE(ends) << lines[at].file << ":" << lines[at].text;
  }
  for (const std::string& line : lines_with(R"(\bwhile \()"))
    EXPECT_NE(line.find("while (low < high)"), std::string::npos) << line;
  for (const std::string& line : lines_with(R"(int steps = 0)"))
    EXPECT_TRUE(std::regex_search(line, std::regex(R"(steps < ([0-9]+|\(1 << 24\));)"))) << line;
}

TEST(HardCaseR20, OnlyIntegersAreAtomic) {
  ASSERT_GT(lines_with(R"(\batomic[A-Z])").size(), 5u) << "the scan found too few shaders";
  EXPECT_EQ(lines_with("shader_atomic_float"), std::vector<std::string>{});
  // Without that extension no function takes a float. By its bits one could: where they are added the order shows.
  EXPECT_EQ(lines_with(R"(\batomic[A-Z].*floatBitsTo)"), std::vector<std::string>{});
}

/// Layers get their places in lists, tiles theirs, and pixels that are shaded later theirs by atomics.
TEST(HardCaseR20, ThePictureIsTheSameWhateverOrderAtomicsRanIn) {
  const world::World w = hills();
  RenderKnobs knobs;
  knobs.transparency = Transparency::lists;
  knobs.reflection = Reflection::traced, knobs.refraction = Refraction::traced;
  knobs.exposure_mode = ExposureMode::histogram;
  Image first;
  for (int repeat = 0; repeat < 3; ++repeat) {
    auto made = make_raster({.validation = repeat == 0});
    ASSERT_TRUE(made.ok()) << made.error().message;
    const Image image = draw(**made, w, hill_cameras()[0].camera, knobs, 320, 180).image;
    if (repeat == 0) first = image;
    EXPECT_TRUE(same(first, image)) << repeat;
  }
}

}  // namespace
}  // namespace render
