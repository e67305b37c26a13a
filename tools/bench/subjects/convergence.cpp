/// How fast pictures by the reference come near the truth: 1 to 64 samples a pixel, independent (random) or stratified
/// (sobol), of each scene of light.
///
/// Pictures are small and light scatters at most 8 times, in the reference too, so that only noise is measured. The
/// truth is known by two halves A and B, made from other seeds: (X - A)(X - B) is, in the mean, the squared error of X
/// exactly, whatever the noise of the halves. Each error is the root of its mean over pixels, bands and a few seeds,
/// over the mean of the truth; trimmed, without the 1 % of pixels that lie furthest off. Independent samples must show
/// 1/sqrt(N), slope -1/2.
/// source  Eric Veach. Robust Monte Carlo Methods for Light Transport Simulation. 1997, section 2.4
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "render/backend.h"
#include "tools/bench/benchmark.h"
#include "tools/picture.h"
#include "world/base/random.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

using render::Image;
using render::SampleSequence;

constexpr int kMostScatterings = 8;
constexpr double kTrimmed = 0.01;

struct Stage {
  const world::World* world = nullptr;
  render::Camera camera;
  render::RenderKnobs knobs;
  int width = 0, height = 0, half_samples = 0;
};

std::optional<Image> picture(const Stage& stage, SampleSequence sequence, int spp, uint64_t seed) {
  const auto backend = make_backend("reference");
  if (!backend.ok()) return std::nullopt;
  render::RenderKnobs knobs = stage.knobs;
  knobs.spp = spp, knobs.sample_sequence = sequence;
  (*backend)->sampling.seed = seed;
  auto frame = (*backend)->render(world::WorldView(*stage.world), stage.camera, knobs, stage.width, stage.height);
  if (!frame.ok() || frame->report.nan_samples > 0) return std::nullopt;
  return std::move(frame->image);
}

/// Two independent pictures of many samples, and the mean over both, pixels and bands.
struct Halves {
  std::optional<Image> a, b;
  double mean = 0;
};

std::shared_ptr<Halves> make_halves(const Stage& stage, uint64_t seed) {
  auto halves = std::make_shared<Halves>();
  const auto half = [&](uint64_t salt) {
    return picture(stage, SampleSequence::sobol, stage.half_samples, world::hash_combine(seed, salt));
  };
  halves->a = half(0xa), halves->b = half(0xb);
  if (!halves->a || !halves->b) return halves;
  for (const auto* image : {&*halves->a, &*halves->b})
    for (const render::Rgb& p : image->pixels) halves->mean += double{p.r} + double{p.g} + double{p.b};
  halves->mean /= 6.0 * static_cast<double>(halves->a->pixels.size());
  return halves;
}

/// Of one pixel, over its bands.
struct PixelError {
  double squares = 0;   // (X - A)(X - B): in the mean the squared error
  double distance = 0;  // squared, from the mean of the halves
  double bias = 0;
};

PixelError pixel_error(const render::Rgb& x, const render::Rgb& a, const render::Rgb& b) {
  PixelError e;
  for (const auto& [x_band, a_band, b_band] :
       {std::array<double, 3>{x.r, a.r, b.r}, {x.g, a.g, b.g}, {x.b, a.b, b.b}}) {
    const double from_a = x_band - a_band, from_b = x_band - b_band, from_mean = 0.5 * (from_a + from_b);
    e.squares += from_a * from_b / 3, e.distance += from_mean * from_mean / 3, e.bias += from_mean / 3;
  }
  return e;
}

ErrorSample errors_of(const Stage& stage, const Halves& halves, SampleSequence sequence, int spp, uint64_t seed) {
  const ErrorSample failed{{std::nan(""), std::nan("")}, std::nan("")};
  if (!halves.a || !halves.b) return failed;
  std::vector<PixelError> errors;
  for (int i = 0, seeds = std::max(2, 16 >> (spp > 1) >> (spp > 4) >> (spp > 16)); i < seeds; ++i) {
    const auto image = picture(stage, sequence, spp, world::hash_combine(seed, static_cast<uint64_t>(i)));
    if (!image) return failed;
    for (size_t p = 0; p < image->pixels.size(); ++p)
      errors.push_back(pixel_error(image->pixels[p], halves.a->pixels[p], halves.b->pixels[p]));
  }
  std::sort(errors.begin(), errors.end(),
            [](const PixelError& l, const PixelError& r) { return l.distance < r.distance; });
  const size_t kept = errors.size() - static_cast<size_t>(kTrimmed * static_cast<double>(errors.size()));
  double sum = 0, trimmed = 0, bias = 0;
  for (size_t i = 0; i < errors.size(); ++i) {
    sum += errors[i].squares, bias += errors[i].bias;
    if (i + 1 == kept) trimmed = sum;
  }
  const auto relative = [&](double squares, size_t count) {
    return std::sqrt(std::max(squares, 0.0) / static_cast<double>(count)) / halves.mean;
  };
  return {{relative(sum, errors.size()), relative(trimmed, kept)},
          bias / static_cast<double>(errors.size()) / halves.mean};
}

Result<std::shared_ptr<const Stage>> make_stage(BenchContext& context, const std::string& name) {
  auto stage = std::make_shared<Stage>();
  TRY(stage->world, context.world(name));
  TRY(const world::CameraPlacement placement, world::camera_of(*stage->world, ""));
  TRY(stage->knobs, resolve_knobs("usual", stage->world->knobs, {}, {}));
  stage->camera = render::Camera::from(placement);
  stage->knobs.max_depth = kMostScatterings;
  stage->width = context.quick() ? 16 : 24, stage->height = context.quick() ? 12 : 18;
  stage->half_samples = context.quick() ? 512 : 2048;
  return std::shared_ptr<const Stage>(std::move(stage));
}

}  // namespace

void add_subject_convergence(Registry& registry) {
  static constexpr std::array kScenes{"cornell", "nightclub", "furnace", "caustics", "fog_volumes", "gobo"};
  Subject subject{.question = "how many samples a pixel does a picture by the reference need?",
                  .reference = "path tracing itself, two independent halves of 2048 samples a pixel (quick: 512)",
                  .metrics = {"RMS error of radiance (relative)", "the same without the worst 1 % of pixels"},
                  .work_unit = "camera samples",
                  .knob_unit = "samples a pixel"};
  for (const char* scene : kScenes) subject.expected_slopes[fmt::format("{} random", scene)] = {-0.5, 1};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    for (const char* scene : kScenes) {
      TRY(const std::shared_ptr<const Stage> stage, make_stage(context, scene));
      for (const auto& [sequence, name] :
           {std::pair{SampleSequence::random, "random"}, {SampleSequence::sobol, "sobol"}})
        for (const int spp : {1, 4, 16, 64}) {
          const std::string method = fmt::format("{} {}", scene, name);
          Setting s{.method = method, .setting = fmt::format("{}@{}", method, spp), .problem = scene};
          s.knob = spp;
          s.is_default = sequence == SampleSequence::sobol && spp == 64;
          // The halves are made when the first error is asked for, and serve all settings of the scene.
          s.measure = [=, sequence = sequence, &context](uint64_t seed) {
            const auto halves = context.shared<Halves>(fmt::format("convergence {}", scene),
                                                       [&] { return make_halves(*stage, context.seed()); });
            return errors_of(*stage, *halves, sequence, spp, seed);
          };
          s.run = [=, sequence = sequence] {
            if (!picture(*stage, sequence, spp, 1)) return std::nan("");
            return static_cast<double>(stage->width * stage->height * spp);
          };
          settings.push_back(std::move(s));
        }
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
