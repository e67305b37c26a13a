/// Laws of the effects between radiance and the display, each stated of every member, on processors and on the device.
#include "render/effects/chain.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "render/effects/chain.shared.h"
#include "render/effects/device_chain.h"
#include "render/image/convolve.h"
#include "render/image/display.h"
#include "render/image/framebuffer.h"
#include "tests/render/raster/small_worlds.h"
#include "world/base/random.h"

namespace render {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

struct Member {
  std::string name;
  uint32_t bit;
  std::function<void(RenderKnobs&)> on;  // gives it strength
};

/// Every member of the folder; a new one fails the test until it is here.
std::vector<Member> members() {
  std::vector<Member> all;
  const auto set = [](const std::string& name) -> std::function<void(RenderKnobs&)> {
    if (name == "bloom") return [](RenderKnobs& k) { k.bloom = 0.3f, k.bloom_threshold = 0.5f, k.bloom_radius = 0.1f; };
    if (name == "chromatic_aberration") return [](RenderKnobs& k) { k.chromatic_aberration = 0.01f; };
    if (name == "exposure") return [](RenderKnobs& k) { k.exposure_mode = ExposureMode::histogram; };
    if (name == "grain") return [](RenderKnobs& k) { k.grain = 0.05f, k.grain_seed = 7; };
    if (name == "lens_flare") return [](RenderKnobs& k) { k.lens_flare = 0.7f; };
    if (name == "tone_map") return [](RenderKnobs& k) { k.tone_map = ToneMap::filmic; };
    if (name == "vignette") return [](RenderKnobs& k) { k.vignette = 0.8f; };
    return {};
  };
#define EFFECT(name) all.push_back({#name, EFFECT_##name, set(#name)});
#include "render_effects.list.h"
#undef EFFECT
  return all;
}

Camera wide_camera() {
  Camera camera;
  camera.vertical_fov = 1.2;
  return camera;
}

/// Radiance from 0 to 2^12, most of it dark, some very bright.
Image bright_spots(int width, int height, uint64_t seed = 1) {
  Image image(width, height);
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    const auto band = [&](uint64_t b) {
      const float u = world::uniform01(world::mix64(seed * 1000003 + i * 3 + b));
      return u < 0.02f ? 4096 * u / 0.02f : u * u * 200;
    };
    image.pixels[i] = {band(0), band(1), band(2)};
  }
  return image;
}

const std::vector<FlareSpot>& spots() {
  static const std::vector<FlareSpot> two{{0.4, -0.5, {170, 150, 120}}, {-0.9, 0.2, {3, 4, 9}}};
  return two;
}

EffectPlan plan_of(const RenderKnobs& knobs, int width, int height, const Camera& camera = wide_camera()) {
  auto plan = plan_effects(camera, knobs, width, height, spots());
  EXPECT_TRUE(plan.ok()) << (plan.ok() ? "" : plan.error().message);
  return plan.ok() ? std::move(*plan) : EffectPlan{};
}

Image on_processors(const EffectPlan& plan, Image image, EffectOutcome* outcome = nullptr) {
  EffectOutcome made = apply_effects(plan, image);
  if (outcome) *outcome = std::move(made);
  return image;
}

class OnDevice {
 public:
  OnDevice() {
    auto made = gpu::Device::make({.validation = true});
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().message);
    if (made.ok()) device_ = std::move(*made), chain_ = std::make_unique<DeviceEffects>();
  }
  ~OnDevice() {
    chain_.reset(), radiance_ = {};
    EXPECT_EQ(device_->messages(), std::vector<std::string>{});
  }
  Image apply(const EffectPlan& plan, const Image& image, EffectOutcome* outcome = nullptr) {
    const size_t bytes = image.pixels.size() * sizeof(Rgb);
    auto buffer = gpu::make_buffer(*device_, bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::MemoryUse::upload);
    EXPECT_TRUE(buffer.ok());
    radiance_ = std::move(*buffer);
    std::memcpy(radiance_.mapped(), image.pixels.data(), bytes);
    const world::Status ready = chain_->prepare(*device_, plan, {&radiance_});
    EXPECT_TRUE(ready.ok()) << (ready.ok() ? "" : ready.error().message);
    EXPECT_TRUE(device_->run([&](VkCommandBuffer commands) { chain_->record(commands, [](const char*) {}); }).ok());
    Image out(image.width, image.height);
    const EffectOutcome made = chain_->read(out);
    if (outcome) *outcome = made;
    return out;
  }
  DeviceEffects& chain() { return *chain_; }

 private:
  std::unique_ptr<gpu::Device> device_;
  gpu::Buffer radiance_;
  std::unique_ptr<DeviceEffects> chain_;
};

/// Largest difference of a band over its size, or over `least` where it is smaller.
double worst_difference(const Image& a, const Image& b, float least = 0.1f) {
  double worst = 0;
  const auto off = [&](float x, float y) {
    worst = std::max(worst, double{std::abs(x - y)} / std::max({std::abs(x), std::abs(y), least}));
  };
  for (size_t i = 0; i < a.pixels.size(); ++i) {
    const Rgb &p = a.pixels[i], &q = b.pixels[i];
    off(p.r, q.r), off(p.g, q.g), off(p.b, q.b);
  }
  return worst;
}

bool equal_bits(const Image& a, const Image& b) {
  return a.width == b.width && a.height == b.height &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(Rgb)) == 0;
}

bool all_finite(const Image& image) {
  return std::all_of(image.pixels.begin(), image.pixels.end(),
                     [](const Rgb& p) { return std::isfinite(p.r) && std::isfinite(p.g) && std::isfinite(p.b); });
}

TEST(EveryEffect, IsInTheChainAndTurnedOnByItsKnob) {
  for (const Member& m : members()) {
    ASSERT_TRUE(m.on) << m.name << " needs a row in members()";
    RenderKnobs knobs;
    m.on(knobs);
    const EffectPlan plan = plan_of(knobs, 40, 30);
    EXPECT_EQ(plan.effects, 1u << m.bit) << m.name;
    const Image before = bright_spots(40, 30);
    EXPECT_FALSE(equal_bits(on_processors(plan, before), before)) << m.name;
    EXPECT_EQ(effect_pass_name(plan), m.name);
  }
}

TEST(EveryEffect, OfNoStrengthIsThePictureItselfAndMakesNoPass) {
  // What a scene that asks for no effect gets.
  const EffectPlan plan = plan_of({}, 40, 30);
  EXPECT_TRUE(plan.empty());
  EXPECT_TRUE(effect_passes(plan).empty());
  EXPECT_EQ(plan.blurred_numbers, 0u);
  const Image before = bright_spots(40, 30);
  EXPECT_TRUE(equal_bits(on_processors(plan, before), before));
  RenderKnobs all;
  for (const Member& m : members()) m.on(all);
  EXPECT_TRUE(plan_of(without_effects(all), 40, 30).empty());
}

TEST(EveryEffect, GivesTheSameOnProcessorsAndOnTheDevice) {
  OnDevice device;
  RenderKnobs all;
  for (const Member& m : members()) m.on(all);
  std::vector<std::pair<std::string, RenderKnobs>> cases{{"all of them", all}};
  for (const Member& m : members()) {
    RenderKnobs knobs;
    m.on(knobs);
    cases.emplace_back(m.name, knobs);
  }
  for (const ToneMap curve : {ToneMap::reinhard, ToneMap::filmic})
    cases.emplace_back("a tone curve", RenderKnobs{}), cases.back().second.tone_map = curve;
  for (const int levels : {0, 1, 16}) cases.emplace_back("levels", all), cases.back().second.bloom_levels = levels;
  cases.emplace_back("log mean", RenderKnobs{}), cases.back().second.exposure_mode = ExposureMode::log_mean;
  cases.emplace_back("half", RenderKnobs{}), cases.back().second.colour_format = ColourFormat::half;
  for (const auto& [name, knobs] : cases)
    for (const auto& [width, height] : std::vector<std::pair<int, int>>{{1, 1}, {3, 5}, {70, 130}}) {
      const EffectPlan plan = plan_of(knobs, width, height);
      const Image before = bright_spots(width, height);
      EffectOutcome here, there;
      const Image a = on_processors(plan, before, &here), b = device.apply(plan, before, &there);
      // exp2, log2, pow and sqrt are right to 4 ulp on either; bloom sums up to 100 terms.
      EXPECT_LT(worst_difference(a, b), 1e-4) << name << " " << width << "x" << height;
      EXPECT_NEAR(here.metered_ev, there.metered_ev, 1e-5) << name;
    }
}

TEST(HardCaseH5, ANaNIsContainedToItsPixelAndCounted) {
  OnDevice device;
  for (const Member& m : members()) {
    RenderKnobs knobs;
    m.on(knobs);
    knobs.bloom_threshold = 0;
    Image image = bright_spots(64, 48);
    for (Rgb& p : image.pixels) p = {50, 50, 50};
    Image zero = image;
    image.at(20, 30) = {kNaN, 1, 1}, zero.at(20, 30) = {0, 1, 1};
    const EffectPlan plan = plan_of(knobs, 64, 48);
    EffectOutcome outcome, of_device;
    const Image out = on_processors(plan, image, &outcome);
    EXPECT_TRUE(all_finite(out)) << m.name;
    EXPECT_EQ(outcome.not_finite, 1u) << m.name;
    // As if the band were black.
    EXPECT_TRUE(equal_bits(out, on_processors(plan, zero))) << m.name;
    EXPECT_TRUE(all_finite(device.apply(plan, image, &of_device))) << m.name;
    EXPECT_EQ(of_device.not_finite, 1u) << m.name;
  }
}

TEST(HardCaseA17, BloomOfANaNAnInfinityAndAMillionIsFinite) {
  OnDevice device;
  RenderKnobs knobs;
  knobs.bloom = 0.5f, knobs.tone_map = ToneMap::filmic, knobs.exposure_mode = ExposureMode::log_mean;
  Image image(256, 256);
  for (Rgb& p : image.pixels) p = {1, 1, 1};
  image.at(10, 10) = {kNaN, kNaN, kNaN}, image.at(200, 100) = {kInf, -kInf, kInf},
               image.at(128, 128) = {1e6f, 1e6f, 1e6f};
  const EffectPlan plan = plan_of(knobs, 256, 256);
  EffectOutcome outcome;
  EXPECT_TRUE(all_finite(on_processors(plan, image, &outcome)));
  EXPECT_EQ(outcome.not_finite, 2u);
  EXPECT_TRUE(all_finite(device.apply(plan, image, &outcome)));
  EXPECT_EQ(outcome.not_finite, 2u);
}

TEST(HardCaseH21, EveryEffectHoldsForMoonlightAndForTheSunsDisk) {
  for (const Member& m : members())
    for (const float radiance : {1e-12f, 1e-4f, 8e6f, 3e38f}) {
      RenderKnobs knobs;
      m.on(knobs);
      Image image(17, 9);
      for (Rgb& p : image.pixels) p = {radiance, radiance * 0.5f, 0};
      EXPECT_TRUE(all_finite(on_processors(plan_of(knobs, 17, 9), image))) << m.name << " " << radiance;
    }
}

TEST(HardCaseA16, BloomOfAConstantIsTheConstant) {
  for (const int levels : {0, 1, 3, 16})
    for (const float threshold : {0.0f, 0.2f}) {
      RenderKnobs knobs;
      knobs.bloom = 0.7f, knobs.bloom_levels = levels, knobs.bloom_threshold = threshold;
      Image image(97, 61);
      for (Rgb& p : image.pixels) p = {100, 40, 7};
      EXPECT_LT(worst_difference(on_processors(plan_of(knobs, 97, 61), image), image), 1e-6) << levels;
    }
}

TEST(HardCaseA18, BloomOfOddSizesKeepsItsEnergy) {
  RenderKnobs knobs;
  knobs.bloom = 1, knobs.bloom_threshold = 0, knobs.bloom_levels = 16, knobs.bloom_radius = 0.2f;
  for (int width = 1; width <= 17; ++width)
    for (const int height : {1, 2, 5, 17}) {
      Image image(width, height);
      for (Rgb& p : image.pixels) p = {3, 2, 1};
      EXPECT_LT(worst_difference(on_processors(plan_of(knobs, width, height), image), image), 1e-6);
    }
}

TEST(Bloom, WithoutHalvingIsTheExactKernel) {
  constexpr int kSize = 129;
  Image image(kSize, kSize);
  image.at(64, 64) = {1000, 1000, 1000};
  RenderKnobs knobs;
  knobs.bloom = 1, knobs.bloom_threshold = 0, knobs.bloom_levels = 0, knobs.bloom_radius = 8.0f / kSize;
  const Image out = on_processors(plan_of(knobs, kSize, kSize), image);
  for (const auto& [x, y] : std::vector<std::pair<int, int>>{{0, 0}, {1, 0}, {3, 4}, {10, 2}, {20, 20}}) {
    double expected = 0;
    for (const double sigma : {8.0, 2.0, 0.5}) {
      const Kernel kernel = gaussian_kernel(sigma, 48);
      expected += 1000.0 / 3 * kernel.taps[static_cast<size_t>(48 + x)] * kernel.taps[static_cast<size_t>(48 + y)];
    }
    // Kernels end at four standard deviations, 6e-5 of the light.
    EXPECT_NEAR(out.at(64 + x, 64 + y).g, expected, 1e-4 * expected + 1e-6) << x << " " << y;
  }
}

TEST(Bloom, HalvingsKeepEnergyAndStayNearTheKernel) {
  Image image(200, 160);
  image.at(90, 70) = {5000, 3000, 1000}, image.at(120, 77) = {100, 3000, 100};
  RenderKnobs knobs;
  knobs.bloom = 1, knobs.bloom_threshold = 0, knobs.bloom_radius = 0.08f;
  const auto with_levels = [&](int levels) {
    knobs.bloom_levels = levels;
    return on_processors(plan_of(knobs, 200, 160), image);
  };
  const auto energy = [](const Image& i) {
    double sum = 0;
    for (const Rgb& p : i.pixels) sum += double{p.r} + double{p.g} + double{p.b};
    return sum;
  };
  const Image exact = with_levels(0);
  double last = 0;
  for (const int levels : {1, 2, 16}) {
    const Image coarse = with_levels(levels);
    EXPECT_NEAR(energy(coarse), energy(image), 1e-3 * energy(image)) << levels;
    double squares = 0, of_exact = 0;
    for (size_t i = 0; i < coarse.pixels.size(); ++i) {
      squares += std::pow(double{coarse.pixels[i].g} - double{exact.pixels[i].g}, 2);
      of_exact += std::pow(double{exact.pixels[i].g}, 2);
    }
    const double error = std::sqrt(squares / of_exact);
    std::printf("bloom of %d halvings: RMS error %.4f of the picture's\n", levels, error);
    EXPECT_GE(error, last) << levels;
    EXPECT_LT(error, 0.5) << levels;
    last = error;
  }
}

TEST(Vignette, IsTheCosineToTheFourth) {
  RenderKnobs knobs;
  knobs.vignette = 1;
  Image image(101, 51);
  for (Rgb& p : image.pixels) p = {10, 10, 10};
  const Image out = on_processors(plan_of(knobs, 101, 51), image);
  EXPECT_FLOAT_EQ(out.at(50, 25).g, 10);
  const PixelRays rays(wide_camera(), 101, 51);
  for (const auto& [x, y] : std::vector<std::pair<int, int>>{{0, 0}, {100, 50}, {0, 25}, {73, 12}}) {
    const double cosine = 1 / glm::length(rays.direction(x + 0.5, y + 0.5));
    EXPECT_NEAR(out.at(x, y).g, 10 * std::pow(cosine, 4), 1e-4) << x << " " << y;
  }
}

TEST(ChromaticAberration, MovesRedOutwardsAndBlueInwards) {
  constexpr int kSize = 201;
  Image image(kSize, kSize);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const float edge = x < 180 ? 0.0f : 100.0f;
      image.at(x, y) = {edge, edge, edge};
    }
  RenderKnobs knobs;
  knobs.chromatic_aberration = 0.05f;
  const Image out = on_processors(plan_of(knobs, kSize, kSize), image);
  // The edge lies 79.5 pixels from the middle: red's is at 1.05 times that (to first order), blue's at 0.95.
  const auto first_bright = [&](auto band) {
    int x = 0;
    while (band(out.at(x, 100)) < 50) ++x;
    return x;
  };
  EXPECT_NEAR(first_bright([](const Rgb& p) { return p.r; }), 180 + 4, 1);
  EXPECT_EQ(first_bright([](const Rgb& p) { return p.g; }), 180);
  EXPECT_NEAR(first_bright([](const Rgb& p) { return p.b; }), 180 - 4, 1);
}

TEST(Grain, HasTheMeanOfThePictureAndTheDeviationOfTheKnob) {
  RenderKnobs knobs;
  knobs.grain = 0.1f;
  Image image(300, 200);
  const float middle = 0.5f * kWhiteRadiance;
  for (Rgb& p : image.pixels) p = {middle, 0, kWhiteRadiance};
  const auto seeded = [&](int seed) {
    knobs.grain_seed = seed;
    return on_processors(plan_of(knobs, 300, 200), image);
  };
  const Image out = seeded(1);
  double sum = 0, squares = 0;
  for (const Rgb& p : out.pixels) {
    const double off = p.r / double{kWhiteRadiance} - 0.5;
    sum += off, squares += off * off;
    EXPECT_EQ(p.g, 0.0f);
    EXPECT_EQ(p.b, kWhiteRadiance);
  }
  const double n = 300 * 200;
  EXPECT_NEAR(sum / n, 0, 4 * 0.1 / std::sqrt(n));
  EXPECT_NEAR(std::sqrt(squares / n), 0.1, 0.002);
  EXPECT_TRUE(equal_bits(out, seeded(1)));
  EXPECT_FALSE(equal_bits(out, seeded(2)));
}

TEST(ToneMap, CurvesHaveTheirKnownValues) {
  using namespace shared;
  EXPECT_FLOAT_EQ(reinhard_curve(0), 0);
  EXPECT_FLOAT_EQ(reinhard_curve(4), 1);  // its white
  EXPECT_NEAR(reinhard_curve(1), 0.53125, 1e-6);
  EXPECT_FLOAT_EQ(filmic_curve(0), 0);
  EXPECT_NEAR(filmic_curve(1 / 0.6f), 2.54 / 3.16, 1e-6);
  EXPECT_FLOAT_EQ(filmic_curve(1e30f), 1);
  for (const uint32_t curve : {kToneReinhard, kToneFilmic}) {
    float last = -1;
    for (float x = 1e-4f; x < 4; x *= 1.1f) {
      const float y = tone_mapped(curve, {x, x, x}).y;
      EXPECT_GT(y, last);
      last = y;
    }
  }
}

TEST(Exposure, TheMeanIsShownAsTheKey) {
  for (const ExposureMode mode : {ExposureMode::log_mean, ExposureMode::histogram})
    for (const float radiance : {0x1p-23f, 1e-3f, 0.7f, 90.0f, 20000.0f}) {
      RenderKnobs knobs;
      knobs.exposure_mode = mode, knobs.exposure = 3, knobs.exposure_least = -64, knobs.exposure_most = 64;
      Image image(64, 64);
      // Two octaves around it, evenly in the logarithm; black pixels are not metered.
      for (size_t i = 0; i < image.pixels.size(); ++i) {
        const float l = radiance * std::exp2(2 * (static_cast<float>(i) + 0.5f) / 4096 - 1);
        image.pixels[i] = i % 16 == 5 ? Rgb{} : Rgb{l, l, l};
      }
      EffectOutcome outcome;
      const Image out = on_processors(plan_of(knobs, 64, 64), image, &outcome);
      const double scale = 8 / double{kWhiteRadiance};
      EXPECT_NEAR(std::log2(radiance * scale * std::exp2(outcome.metered_ev) / 0.18), 0, 0.01) << radiance;
      EXPECT_NEAR(out.at(32, 32).r / image.at(32, 32).r, std::exp2(outcome.metered_ev),
                  1e-3 * std::exp2(outcome.metered_ev));
    }
}

TEST(Exposure, StopsStayWithinTheirBoundsWhateverTheFixedOnesAre) {
  OnDevice device;
  Image night(32, 32), day(32, 32);
  for (Rgb& p : night.pixels) p = {1e-6f, 1e-6f, 1e-6f};
  for (Rgb& p : day.pixels) p = {30000, 30000, 30000};
  for (const ExposureMode mode : {ExposureMode::log_mean, ExposureMode::histogram})
    for (const float exposure : {0.0f, 7.0f}) {
      RenderKnobs knobs;
      knobs.exposure_mode = mode, knobs.exposure = exposure;
      const auto stops = [&](const Image& image) {
        const EffectPlan plan = plan_of(knobs, 32, 32);
        EffectOutcome here, there;
        on_processors(plan, image, &here);
        device.apply(plan, image, &there);
        EXPECT_NEAR(here.metered_ev, there.metered_ev, 1e-5);
        return exposure + here.metered_ev;
      };
      EXPECT_NEAR(stops(night), 20, 1e-5) << "without a bound it were 24.7";
      EXPECT_NEAR(stops(day), -10, 1e-5) << "without a bound it were -10.1";
      knobs.exposure_least = 2, knobs.exposure_most = 3.5f;
      EXPECT_NEAR(stops(night), 3.5, 1e-5);
      EXPECT_NEAR(stops(day), 2, 1e-5);
    }
}

TEST(Exposure, AFewLampsDontMoveTheHistogramsMean) {
  RenderKnobs knobs;
  Image image(100, 100);
  for (Rgb& p : image.pixels) p = {5, 5, 5};
  const auto ev = [&](ExposureMode mode) {
    knobs.exposure_mode = mode;
    EffectOutcome outcome;
    on_processors(plan_of(knobs, 100, 100), image, &outcome);
    return outcome.metered_ev;
  };
  const double before = ev(ExposureMode::histogram), mean_before = ev(ExposureMode::log_mean);
  for (int i = 0; i < 500; ++i) image.pixels[static_cast<size_t>(i)] = {60000, 60000, 60000};
  EXPECT_NEAR(ev(ExposureMode::histogram), before, 0.01);
  EXPECT_LT(ev(ExposureMode::log_mean), mean_before - 0.5);
}

TEST(Exposure, APictureWithoutLightIsLeftAsItIs) {
  RenderKnobs knobs;
  knobs.exposure_mode = ExposureMode::histogram;
  const Image black(8, 8);
  EffectOutcome outcome;
  EXPECT_TRUE(equal_bits(on_processors(plan_of(knobs, 8, 8), black, &outcome), black));
  EXPECT_EQ(outcome.metered_ev, 0);
}

TEST(LensFlare, LiesOnTheLineThroughTheSpotAndTheMiddleAndFollowsTheIris) {
  RenderKnobs knobs;
  knobs.lens_flare = 1;
  const Image black(300, 200);
  const std::vector<FlareSpot> one{{0.6, -0.4, {100, 100, 100}}};
  const auto flare = [&](int blades) {
    knobs.lens_flare_blades = blades;
    auto plan = plan_effects(wide_camera(), knobs, 300, 200, one);
    EXPECT_TRUE(plan.ok());
    return on_processors(*plan, black);
  };
  const Image out = flare(6);
  // The image of the iris at -0.52 of the way: bright there, dark as far off the line.
  const auto at = [&](double x, double y) { return out.at(int(150 + 100 * x), int(100 + 100 * y)); };
  EXPECT_GT(at(-0.52 * 0.6, 0.52 * 0.4).r, 15);
  EXPECT_LT(at(-0.52 * 0.6, -0.52 * 0.4).r, 3);
  EXPECT_GT(at(0.6, -0.4).r, 90);  // the spot itself
  EXPECT_FALSE(equal_bits(out, flare(5)));
}

TEST(LensFlare, IsHiddenWithItsSpot) {
  world::World w(world::standard_blocks());
  w.environment.sun_direction = glm::normalize(Vec3d(0.095, 0.2, -1));
  world::EditBatch batch;
  batch.set({0, 0, -500}, block(w, "stone"));
  apply(w, batch);
  const Camera camera = camera_at({}, {0.5, 0.5, 0.5}, {0, 0, -1});
  const auto spots_now = [&] {
    const world::WorldView view(w);
    return flare_spots(view, camera, {}, 160, 90);
  };
  const auto open = spots_now();
  ASSERT_EQ(open.size(), 1u);
  EXPECT_NEAR(open[0].x, 0.095 / std::tan(camera.vertical_fov / 2), 1e-6);
  EXPECT_NEAR(open[0].y, -0.2 / std::tan(camera.vertical_fov / 2), 1e-6);
  world::EditBatch half;  // its edge runs through the sun: x = 0.5 + 0.095 * 99.5
  half.fill({{10, -40, -99}, {60, 60, -99}}, block(w, "stone"));
  apply(w, half);
  const auto part = spots_now();
  ASSERT_EQ(part.size(), 1u);
  EXPECT_GT(part[0].radiance.r, 0.05f * open[0].radiance.r);
  EXPECT_LT(part[0].radiance.r, 0.95f * open[0].radiance.r);
  world::EditBatch all;
  all.fill({{-60, -40, -99}, {60, 60, -99}}, block(w, "stone"));
  apply(w, all);
  EXPECT_TRUE(spots_now().empty());
  // And where no spot is seen there is no pass.
  RenderKnobs knobs;
  knobs.lens_flare = 1;
  const world::WorldView view(w);
  auto plan = plan_effects(view, camera, knobs, 160, 90);
  ASSERT_TRUE(plan.ok());
  EXPECT_TRUE(plan->empty());
}

TEST(LensFlare, IsHiddenByCloudsAsFarAsTheyHideTheSun) {
  world::World w(world::standard_blocks());
  w.environment.sun_direction = glm::normalize(Vec3d(0.02, 0.5, -1));
  w.environment.clouds.cover = 0.5f;
  Camera camera = camera_at({}, {0.5, 0.5, 0.5}, {0, 0, -1});
  camera.forward = glm::normalize(Vec3d(0, 0.5, -1));
  RenderKnobs knobs;
  knobs.cloud_steps = 64;
  const auto spots_of = [&](const RenderKnobs& k) {
    const world::WorldView view(w);
    return flare_spots(view, camera, k, 160, 90);
  };
  RenderKnobs none = knobs;
  none.cloud_steps = 0;
  const auto open = spots_of(none);
  ASSERT_EQ(open.size(), 1u);
  int hidden = 0, clear = 0, part = 0;
  for (int i = 0; i < 40; ++i) {
    w.environment.clouds.drifted = {160.0 * i, 0, 0};
    const auto spots = spots_of(knobs);
    const float seen = spots.empty() ? 0 : spots[0].radiance.g / open[0].radiance.g;
    EXPECT_LE(seen, 1.0001f);
    (seen < 0.02f ? hidden : seen > 0.98f ? clear : part) += 1;
  }
  EXPECT_GT(hidden, 5);
  EXPECT_GT(clear, 5);
  EXPECT_GT(part, 0);
  // From above them the sun is free.
  camera.position.voxel.y = 2000;
  const auto above = spots_of(knobs);
  ASSERT_EQ(above.size(), 1u);
  EXPECT_EQ(above[0].radiance.g, open[0].radiance.g);
}

TEST(Tiles, OfAPictureGetTheEffectsOfTheWhole) {
  RenderKnobs all;
  for (const Member& m : members()) m.on(all);
  all.bloom_levels = 0;
  constexpr int kWidth = 120, kHeight = 80;
  const Image before = bright_spots(kWidth, kHeight);
  WholePicture whole{kWidth, kHeight, plan_of(all, kWidth, kHeight), {}};
  Image expected = before;
  whole.outcome = apply_effects(whole.plan, expected);
  all.chromatic_aberration = 0;  // looks beyond a tile's edge
  Image of_whole = before;
  apply_effects(plan_of(all, kWidth, kHeight), of_whole);
  for (int y = 0; y < kHeight; y += 40)
    for (int x = 0; x < kWidth; x += 40) {
      Image tile(40, 40);
      for (int row = 0; row < 40; ++row) std::copy_n(&before.at(x, y + row), 40, &tile.at(0, row));
      Camera camera = wide_camera();
      camera.window = {double(x), double(y), kWidth, kHeight};
      apply_effects(plan_of(all, 40, 40, camera), whole, tile);
      Image part(40, 40);
      for (int row = 0; row < 40; ++row) std::copy_n(&of_whole.at(x, y + row), 40, &part.at(0, row));
      EXPECT_LT(worst_difference(tile, part), 1e-4) << x << " " << y;
    }
}

TEST(EveryEffect, KnobsOutOfRangeAreUsageErrors) {
  const auto refused = [](auto set) {
    RenderKnobs knobs;
    set(knobs);
    const auto plan = plan_effects(wide_camera(), knobs, 8, 8, {});
    return !plan.ok() && plan.error().kind == world::ErrorKind::usage;
  };
  EXPECT_TRUE(refused([](RenderKnobs& k) { k.bloom = 1.5f; }));
  EXPECT_TRUE(refused([](RenderKnobs& k) { k.bloom = kNaN; }));
  EXPECT_TRUE(refused([](RenderKnobs& k) { k.bloom_levels = -1; }));
  EXPECT_TRUE(refused([](RenderKnobs& k) { k.lens_flare_blades = 9; }));
  EXPECT_TRUE(refused([](RenderKnobs& k) { k.vignette = -1; }));
  EXPECT_TRUE(refused([](RenderKnobs& k) { k.grain = kInf; }));
  EXPECT_TRUE(refused([](RenderKnobs& k) { k.exposure_key = 0; }));
  const auto upside_down = [](RenderKnobs& k) { k.exposure_least = 2, k.exposure_most = 1; };
  EXPECT_FALSE(refused(upside_down)) << "nothing reads them";
  EXPECT_TRUE(refused([&](RenderKnobs& k) { upside_down(k), k.exposure_mode = ExposureMode::log_mean; }));
}

TEST(HardCaseH20, ColourFormatsStoreTheSameOnProcessorsAndOnTheDeviceWithinTheirError) {
  OnDevice device;
  struct Case {
    ColourFormat format;
    size_t bytes;
    float error, from, most;  // relative, of display values from `from` up to `most`
  };
  for (const Case& c :
       {Case{ColourFormat::half, 8, 0x1p-11f, 0x1p-14f, 65504},
        Case{ColourFormat::r11g11b10, 4, 0x1p-6f, 0x1p-14f, 64512},
        Case{ColourFormat::float7e3, 4, 0x1p-8f, 0.25f, 31.875f}, Case{ColourFormat::rgb9e5, 4, 0.06f, 1, 65408},
        Case{ColourFormat::rgba8, 4, 0.02f, 0x1p-4f, 1}, Case{ColourFormat::rgb565, 2, 0.16f, 0x1p-4f, 1}}) {
    RenderKnobs knobs;
    knobs.colour_format = c.format;
    for (const auto& [width, height] : std::vector<std::pair<int, int>>{{1, 1}, {7, 3}, {64, 33}}) {
      const EffectPlan plan = plan_of(knobs, width, height);
      const Image before = bright_spots(width, height), here = on_processors(plan, before);
      // pow of the device may fall to the other side of a half; else the codes are the same.
      const double a_code = c.most > 1 ? 1e-6 : 2.5 * double{c.error};
      EXPECT_LT(worst_difference(here, device.apply(plan, before), kWhiteRadiance / 16), a_code);
      EXPECT_EQ(finished_bytes(plan), (c.bytes * static_cast<size_t>(width * height) + 3) / 4 * 4);
      float worst = 0;
      for (size_t i = 0; i < before.pixels.size(); ++i) {
        const float was = before.pixels[i].g / kWhiteRadiance, is = here.pixels[i].g / kWhiteRadiance;
        if (was < c.from) continue;
        worst = std::max(worst, std::abs(is / std::min(was, c.most) - 1));
      }
      EXPECT_LE(worst, c.error * 1.001f) << static_cast<int>(c.format);
    }
  }
  const Image before = bright_spots(9, 9);
  EXPECT_TRUE(equal_bits(on_processors(plan_of({}, 9, 9), before), before));
}

TEST(Framebuffer, BuffersBelongToSeveralAndKeepTheirParts) {
  PixelBuffer sharp(PixelFormat::float32, 8, 4), small(PixelFormat::rgb565, 8, 4), both(PixelFormat::d24s8, 8, 4),
      other(PixelFormat::d32, 9, 4);
  Framebuffer first, second;
  ASSERT_TRUE(first.attach(BufferKind::colour, sharp).ok() && second.attach(BufferKind::colour, small).ok());
  // One buffer of depth and stencil for two pictures, as both.
  for (Framebuffer* f : {&first, &second})
    ASSERT_TRUE(f->attach(BufferKind::depth, both).ok() && f->attach(BufferKind::stencil, both).ok());
  first[BufferKind::depth]->set_depth(3, 2, 0.75f);
  second[BufferKind::stencil]->set_stencil(3, 2, 200);
  EXPECT_NEAR(second[BufferKind::depth]->depth(3, 2), 0.75f, 0x1p-25f);
  EXPECT_EQ(first[BufferKind::stencil]->stencil(3, 2), 200);
  // What doesn't fit is refused.
  EXPECT_FALSE(first.attach(BufferKind::depth, other).ok());
  EXPECT_FALSE(first.attach(BufferKind::normal, both).ok());
  EXPECT_EQ(first[BufferKind::motion], nullptr);
}

TEST(Framebuffer, EachFormatKeepsItsStatedError) {
  PixelBuffer normal(PixelFormat::normal, 1, 1), motion(PixelFormat::motion, 1, 1), d16(PixelFormat::d16, 1, 1);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto u = [&](uint64_t n) { return world::uniform01_double(world::mix64(uint64_t(i) * 7 + n)) * 2 - 1; };
    const Vec3d v(u(0), u(1), u(2));
    if (glm::length(v) < 1e-2) continue;
    const Vec3d unit = glm::normalize(v);
    normal.set_normal(0, 0, glm::vec3(unit));
    worst = std::max(worst, glm::length(glm::cross(unit, Vec3d(normal.normal(0, 0)))));
    d16.set_depth(0, 0, static_cast<float>(u(3)));
    EXPECT_NEAR(d16.depth(0, 0), std::max(u(3), 0.0), 0.5 / 65535 + 1e-7);
  }
  EXPECT_LT(worst, 7e-5);
  for (const auto& axis : {glm::vec3(0, 0, -1), glm::vec3(0, 0, 1), glm::vec3(-1, 0, 0), glm::vec3(0, 1, 0)}) {
    normal.set_normal(0, 0, axis);
    EXPECT_NEAR(glm::dot(normal.normal(0, 0), axis), 1, 1e-6);
  }
  motion.set_motion(0, 0, -3.5f, 0.25f);
  EXPECT_EQ(motion.motion(0, 0), glm::vec3(-3.5f, 0.25f, 0));
}

TEST(HardCaseX3, PipelinesAppearWithTheirEffectsAndOnlyThen) {
  OnDevice device;
  const Image before = bright_spots(32, 32);
  EXPECT_EQ(device.chain().pipelines(), 0u);
  EXPECT_EQ(device.chain().bytes(), 0u);
  RenderKnobs knobs;
  knobs.vignette = 0.5f;
  device.apply(plan_of(knobs, 32, 32), before);
  EXPECT_EQ(device.chain().pipelines(), 1u);
  const uint64_t small = device.chain().bytes();
  knobs.bloom = 0.1f;
  device.apply(plan_of(knobs, 32, 32), before);
  EXPECT_GT(device.chain().bytes(), small);
  const size_t most = device.chain().pipelines();
  const uint64_t bytes = device.chain().bytes();
  for (int i = 0; i < 20; ++i) {
    knobs.bloom = i % 2 ? 0.1f : 0.0f;
    device.apply(plan_of(knobs, 32, 32), before);
  }
  EXPECT_EQ(device.chain().pipelines(), most);
  EXPECT_EQ(device.chain().bytes(), bytes);
}

}  // namespace
}  // namespace render
