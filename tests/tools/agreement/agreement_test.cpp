/// The rasterizer and the ray caster draw the same picture (hard case R5): each row of the table is drawn by both and
/// held to its bound, and tools/gallery/agreement.md has the rows as they are here.
///
/// LOAM_AGREEMENT=FILE loam_tools_tests --gtest_filter='*Agreement*'   writes the page, with what was measured
/// LOAM_AGREEMENT_PICTURES=FOLDER   keeps both pictures of each row and camera, and 16 times their difference
#include "tests/tools/agreement/table.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "render/effects/samples.h"
#include "render/image/display.h"
#include "render/image/flip.h"
#include "render/image/png_exr.h"
#include "render/raster/raster.h"
#include "render/raycast/raycast.h"
#include "tests/tools/agreement/document.h"
#include "tests/tools/agreement/worlds.h"
#include "tools/light.h"
#include "tools/picture.h"
#include "world/base/file.h"
#include "world/scenes/scene.h"

namespace tools {
namespace {

using render::Image8;
using render::RenderKnobs;

constexpr double kShows = 0.002;  // of the pixels: as many must change for an effect to be there

/// Of 255: by how much the bands of a pixel differ at most.
int difference(const Image8& a, const Image8& b, size_t pixel) {
  int worst = 0;
  for (size_t c = 3 * pixel; c < 3 * pixel + 3; ++c) worst = std::max(worst, std::abs(a.pixels[c] - b.pixels[c]));
  return worst;
}

/// Both pictures, and by how much they differ.
void keep_pictures(const std::string& folder, const std::string& name, const Image8& by_raster, const Image8& by_rays) {
  Image8 apart = by_rays;
  for (size_t i = 0; i < apart.pixels.size(); ++i)
    apart.pixels[i] = static_cast<uint8_t>(std::min(16 * std::abs(by_raster.pixels[i] - by_rays.pixels[i]), 255));
  const std::filesystem::path in = folder;
  EXPECT_TRUE(render::write_png(in / (name + "_raster.png"), by_raster).ok());
  EXPECT_TRUE(render::write_png(in / (name + "_rays.png"), by_rays).ok());
  EXPECT_TRUE(render::write_png(in / (name + "_difference.png"), apart).ok());
}

std::string row_name(size_t row) {
  std::string name = fmt::format("{:03}_", row);
  for (const char c : std::string(agreement_rows()[row].effect)) name += std::isalnum(c) ? c : '_';
  return name;
}

/// Draws rows one after the other; those of one world share it.
class Agreement : public testing::TestWithParam<size_t> {
 protected:
  static void SetUpTestSuite() {
    auto raster = render::make_raster({.validation = true});
    ASSERT_TRUE(raster.ok()) << raster.error().message;
    raster_ = std::move(*raster);
    auto raycast = render::make_raycast_backend();
    ASSERT_TRUE(raycast.ok()) << raycast.error().message;
    raycast_ = std::move(*raycast);
  }
  static void TearDownTestSuite() {
    raster_.reset(), raycast_.reset();
    leave_world();
    if (const char* file = std::getenv("LOAM_AGREEMENT")) {
      const auto page = world::read_file(file);
      const std::string text = agreement_document(measured_, page.ok() ? std::string(page->begin(), page->end()) : "");
      std::ofstream(file) << text;
    }
  }

  const AgreementRow& row() const { return agreement_rows()[GetParam()]; }

  static void leave_world() {
    // The light lets go of the world while that is there.
    if (pictured_) {
      ASSERT_TRUE(light_.follow(pictured_->world, {}, RenderKnobs{}).ok());
    }
    pictured_.reset();
    name_.clear();
  }

  /// Whether the row's world is there.
  bool find_world() {
    const std::string name = fmt::format("{}@{}", row().world, row().ticks);
    if (name != name_) {
      leave_world();
      auto made = pictured_world(row().world, row().ticks);
      if (!made.ok()) ADD_FAILURE() << made.error().message;
      if (made.ok()) name_ = name, pictured_ = std::move(*made);
    }
    return pictured_.has_value();
  }

  RenderKnobs knobs(const std::string& settings) const {
    std::vector<std::string> all = split(kSettingsOfAllRows, " ");
    for (const std::string& setting : split(settings, " ")) all.push_back(setting);
    auto knobs = resolve_knobs("usual", pictured_->world.knobs, {}, all);
    EXPECT_TRUE(knobs.ok()) << (knobs.ok() ? "" : knobs.error().message);
    return knobs.ok() ? *knobs : RenderKnobs{};
  }

  std::vector<world::CameraPlacement> cameras() const {
    const world::World& w = pictured_->world;
    std::vector<world::CameraPlacement> cameras;
    const auto add = [&](const std::string& name) {
      auto camera = world::camera_of(w, name);
      EXPECT_TRUE(camera.ok()) << (camera.ok() ? "" : camera.error().message);
      if (camera.ok()) cameras.push_back(*camera);
    };
    for (const std::string& name : split(row().cameras, ", ")) add(name);
    if (!cameras.empty()) return cameras;
    if (w.cameras.empty()) add("");
    cameras.insert(cameras.end(), w.cameras.begin(), w.cameras.end());
    return cameras;
  }

  /// As `loam render` draws it. Black where that fails.
  Image8 drawn(render::Backend& backend, const render::Camera& camera, const RenderKnobs& knobs) {
    world::World& w = pictured_->world;
    const world::Environment environment = w.environment;
    EXPECT_TRUE(set_time_of_day(knobs, w).ok());
    backend.light = {};
    if (backend.reads_light(w, knobs)) {
      auto light = light_.follow(w, camera.position, knobs);
      EXPECT_TRUE(light.ok()) << (light.ok() ? "" : light.error().message);
      if (light.ok()) backend.light = *light;
    }
    backend.inhabitants = pictured_->inhabitants(camera.position);
    auto frame = backend.render(world::WorldView(w), camera, knobs, row().width, row().height);
    w.environment = environment;
    if (!frame.ok()) ADD_FAILURE() << frame.error().message;
    return render::display_image(frame.ok() ? frame->image : render::Image(row().width, row().height), knobs.exposure);
  }

  /// Which of the pixels that differ lie on no edge.
  size_t count_elsewhere(const Image8& by_raster, const Image8& by_rays, const render::Camera& camera,
                         const RenderKnobs& knobs) {
    Image8 low = by_rays, high = by_rays;
    for (int i = 0; i < 8; ++i) {
      const double angle = i * 3.14159265358979323846 / 4;
      const glm::dvec2 shift = kBesidePixels * glm::dvec2(std::cos(angle), std::sin(angle));
      const Image8 beside = drawn(*raycast_, render::shifted(camera, row().width, row().height, shift), knobs);
      for (size_t k = 0; k < beside.pixels.size(); ++k) {
        low.pixels[k] = std::min(low.pixels[k], beside.pixels[k]);
        high.pixels[k] = std::max(high.pixels[k], beside.pixels[k]);
      }
    }
    size_t elsewhere = 0;
    for (size_t p = 0; 3 * p < by_rays.pixels.size(); ++p) {
      if (difference(by_raster, by_rays, p) <= row().bound.levels) continue;
      bool between = true;
      for (size_t c = 3 * p; c < 3 * p + 3; ++c)
        between &= by_raster.pixels[c] >= low.pixels[c] - row().bound.levels &&
                   by_raster.pixels[c] <= high.pixels[c] + row().bound.levels;
      elsewhere += !between;
    }
    return elsewhere;
  }

  inline static std::unique_ptr<render::RasterBackend> raster_;
  inline static std::unique_ptr<render::Backend> raycast_;
  inline static std::optional<PicturedWorld> pictured_;
  inline static std::string name_;
  inline static LightOfWorld light_;
  inline static std::map<size_t, Measured> measured_;
};

TEST_P(Agreement, IsWithinTheRowsBound) {
  if (!find_world()) GTEST_SKIP() << row().world << " is not on this machine";
  const RenderKnobs of_raster = knobs(row().settings);
  const RenderKnobs of_rays = knobs(std::string(row().settings) + " " + row().of_rays);
  const AgreementBound& bound = row().bound;
  const double pixels = double{1} * row().width * row().height;
  Measured worst;
  double changed = 0;
  for (const world::CameraPlacement& placed : cameras()) {
    const render::Camera camera = render::Camera::from(placed);
    const Image8 by_raster = drawn(*raster_, camera, of_raster), by_rays = drawn(*raycast_, camera, of_rays);
    if (const char* folder = std::getenv("LOAM_AGREEMENT_PICTURES"))
      keep_pictures(folder, fmt::format("{}_{}", row_name(GetParam()), placed.name), by_raster, by_rays);
    size_t beyond = 0, elsewhere = 0, lit = 0;
    int most = 0;
    for (size_t p = 0; 3 * p < by_rays.pixels.size(); ++p) {
      const int off = difference(by_raster, by_rays, p);
      beyond += off > bound.levels, most = std::max(most, off);
      lit += by_rays.pixels[3 * p] + by_rays.pixels[3 * p + 1] + by_rays.pixels[3 * p + 2] > 30;
    }
    if (beyond > 0) elsewhere = count_elsewhere(by_raster, by_rays, camera, of_rays);
    const Measured now{1 - static_cast<double>(beyond) / pixels,
                       most > 0 ? render::flip_map(by_raster, by_rays).mean : 0,
                       static_cast<double>(elsewhere) / pixels};
    std::printf("  %-34s %-28s %.4f %% within %d/255, FLIP %.5f, worst %d, %zu pixels beyond, %zu on no edge\n",
                row().world, placed.name.c_str(), 100 * now.share, bound.levels, now.flip, most, beyond, elsewhere);
    EXPECT_GE(now.share, bound.share) << placed.name;
    EXPECT_LT(now.flip, bound.flip) << placed.name;
    EXPECT_LE(now.elsewhere, bound.elsewhere) << placed.name;
    EXPECT_GT(static_cast<double>(lit), 0.05 * pixels) << placed.name << ": too dark to say anything";
    worst.share = std::min(worst.share, now.share), worst.flip = std::max(worst.flip, now.flip);
    worst.elsewhere = std::max(worst.elsewhere, now.elsewhere);
    if (changed < kShows && *row().settings != 0) {
      // What the rays have by another knob only the rasterizer can leave out by the row's.
      render::Backend& either = *row().of_rays == 0 ? *raycast_ : *raster_;
      const Image8 without = drawn(either, camera, knobs(row().against));
      size_t differ = 0;
      for (size_t p = 0; 3 * p < by_rays.pixels.size(); ++p) differ += difference(without, by_rays, p) > bound.levels;
      changed = static_cast<double>(differ) / pixels;
    }
  }
  if (*row().settings != 0) {
    EXPECT_GE(changed, kShows) << "the effect doesn't show";
  }
  EXPECT_EQ(raster_->messages(), std::vector<std::string>{});
  measured_[GetParam()] = worst;
}

std::vector<size_t> row_numbers() {
  std::vector<size_t> numbers(agreement_rows().size());
  std::iota(numbers.begin(), numbers.end(), size_t{0});
  return numbers;
}
INSTANTIATE_TEST_SUITE_P(Rows, Agreement, testing::ValuesIn(row_numbers()),
                         [](const auto& of) { return row_name(of.param); });

}  // namespace
}  // namespace tools
