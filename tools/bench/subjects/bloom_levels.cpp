/// How often a picture may be halved before the lobes of bloom are blurred: the knob bloom_levels.
///
/// 640x360 of a dim ground with forty bright points and disks, up to 1000 times white, bloom with threshold 0. The
/// error is of what bloom adds alone, so that it can't hide in the rest of the picture.
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "render/effects/chain.h"
#include "render/image/convolve.h"
#include "render/image/display.h"
#include "tools/bench/benchmark.h"
#include "world/base/random.h"

namespace tools {

namespace {

using render::Image;
using render::Rgb;

constexpr int kWidth = 640, kHeight = 360;
constexpr double kRadius = 0.05;

Image bright_things() {
  Image image(kWidth, kHeight);
  for (Rgb& p : image.pixels) p = {4, 5, 7};
  for (uint64_t i = 0; i < 40; ++i) {
    const auto u = [&](uint64_t n) { return world::uniform01(world::mix64(i * 16 + n + 1)); };
    const float bright = render::kWhiteRadiance * std::exp2(10 * u(0)), radius = 6 * u(1) * u(1);
    const int cx = static_cast<int>(u(2) * kWidth), cy = static_cast<int>(u(3) * kHeight);
    for (int y = std::max(0, cy - 6); y < std::min(kHeight, cy + 7); ++y)
      for (int x = std::max(0, cx - 6); x < std::min(kWidth, cx + 7); ++x)
        if (static_cast<float>((x - cx) * (x - cx) + (y - cy) * (y - cy)) <= radius * radius)
          image.at(x, y) = {bright, bright * (0.4f + 0.6f * u(4)), bright * u(5)};
  }
  return image;
}

/// The lobes by direct convolution in double, to six standard deviations.
std::vector<double> exact_spread(const Image& image) {
  std::vector<double> spread(image.pixels.size() * 3);
  for (int lobe = 0; lobe < render::shared::kBloomLobes; ++lobe) {
    const double sigma = kRadius * kHeight * std::exp2(-2.0 * lobe);
    const render::Kernel kernel = render::gaussian_kernel(sigma, static_cast<int>(std::ceil(6 * sigma)));
    for (size_t band = 0; band < 3; ++band) {
      const int first = -kernel.radius, rows = kHeight + 2 * kernel.radius;
      render::Strip<double> in(kWidth, first, rows), blurred(kWidth, first, rows);
      for (int y = first; y < first + rows; ++y)
        for (int x = 0; x < kWidth; ++x)
          in.row(y)[x] = static_cast<double>((&image.at(x, std::clamp(y, 0, kHeight - 1)).r)[band]);
      render::convolve_rows(in, kernel, blurred);
      std::vector<double> out(kWidth);
      for (int y = 0; y < kHeight; ++y) {
        render::convolve_column(blurred, y, kernel, out.data());
        for (size_t x = 0; x < kWidth; ++x)
          spread[(static_cast<size_t>(y) * kWidth + x) * 3 + band] += out[x] / render::shared::kBloomLobes;
      }
    }
  }
  return spread;
}

}  // namespace

void add_subject_bloom_levels(Registry& registry) {
  Subject subject{.question = "how often may a picture be halved before it is blurred for bloom?",
                  .reference = "direct convolution with the exact kernel in double",
                  .metrics = {"RMS error of the bloom (relative)", "error of its energy (relative)"},
                  .work_unit = "taps",
                  .knob_unit = "halvings",
                  .threads = 1};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    const auto image = std::make_shared<Image>(bright_things());
    const auto truth = [=, &context] {
      return context.shared<std::vector<double>>(
          "bloom_levels", [&] { return std::make_shared<std::vector<double>>(exact_spread(*image)); });
    };
    std::vector<Setting> settings;
    for (const int levels : {0, 1, 2, 3, 4, 16}) {
      render::RenderKnobs knobs;
      knobs.bloom = 1, knobs.bloom_threshold = 0, knobs.bloom_radius = static_cast<float>(kRadius);
      knobs.bloom_levels = levels;
      TRY(const render::EffectPlan plan, render::plan_effects(render::Camera{}, knobs, kWidth, kHeight, {}));
      Setting s{.method = "halvings", .setting = fmt::format("halvings@{}", levels)};
      s.knob = levels;
      s.is_default = levels == render::RenderKnobs{}.bloom_levels;
      s.measure = [=](uint64_t) {
        Image out = *image;
        render::apply_effects(plan, out);
        const auto known = truth();
        double squares = 0, all = 0, sum = 0, known_sum = 0;
        for (size_t i = 0; i < known->size(); ++i) {
          const double got = static_cast<double>((&out.pixels[i / 3].r)[i % 3]), expected = (*known)[i];
          squares += (got - expected) * (got - expected), all += expected * expected;
          sum += got, known_sum += expected;
        }
        const double energy = sum / known_sum - 1;
        return ErrorSample{{std::sqrt(squares / all), std::abs(energy)}, energy};
      };
      double taps = 0;
      for (const render::shared::BloomStep& step : plan.bloom_steps)
        taps += double(step.to_width) * step.to_height *
                (step.kind == render::shared::kBloomHalve ? 16 : 2 * std::ceil(4 * step.sigma) + 1);
      s.run = [=] {
        Image out = *image;
        keep(render::apply_effects(plan, out));
        return taps;
      };
      settings.push_back(std::move(s));
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
