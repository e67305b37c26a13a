#include "tools/bench/path_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/backend.h"
#include "tools/picture.h"
#include "world/base/random.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

using render::Image;

constexpr int kMostScatterings = 8;
constexpr double kTrimmed = 0.01;

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

}  // namespace

Result<std::shared_ptr<const PathStage>> path_stage(BenchContext& context, const world::World& world) {
  auto stage = std::make_shared<PathStage>();
  stage->world = &world;
  TRY(const world::CameraPlacement placement, world::camera_of(world, ""));
  TRY(stage->knobs, resolve_knobs("usual", world.knobs, {}, {}));
  stage->camera = render::Camera::from(placement);
  stage->knobs.max_depth = kMostScatterings;
  stage->width = context.quick() ? 16 : 24, stage->height = context.quick() ? 12 : 18;
  stage->half_samples = context.quick() ? 512 : 2048;
  return std::shared_ptr<const PathStage>(std::move(stage));
}

std::optional<Image> path_picture(const PathStage& stage, const render::RenderKnobs& knobs, uint64_t seed) {
  const auto backend = make_backend("reference");
  if (!backend.ok()) return std::nullopt;
  (*backend)->sampling.seed = seed;
  auto frame = (*backend)->render(world::WorldView(*stage.world), stage.camera, knobs, stage.width, stage.height);
  if (!frame.ok() || frame->report.nan_samples > 0) return std::nullopt;
  return std::move(frame->image);
}

std::shared_ptr<PictureHalves> picture_halves(const PathStage& stage, const render::RenderKnobs& knobs, uint64_t seed) {
  auto halves = std::make_shared<PictureHalves>();
  const auto half = [&](uint64_t salt) {
    render::RenderKnobs many = knobs;
    many.spp = stage.half_samples, many.sample_sequence = render::SampleSequence::sobol;
    return path_picture(stage, many, world::hash_combine(seed, salt));
  };
  halves->a = half(0xa), halves->b = half(0xb);
  if (!halves->a || !halves->b) return halves;
  for (const auto* image : {&*halves->a, &*halves->b})
    for (const render::Rgb& p : image->pixels) halves->mean += double{p.r} + double{p.g} + double{p.b};
  halves->mean /= 6.0 * static_cast<double>(halves->a->pixels.size());
  return halves;
}

ErrorSample path_errors(const PathStage& stage, const PictureHalves& halves, const render::RenderKnobs& knobs,
                        uint64_t seed) {
  const ErrorSample failed{{std::nan(""), std::nan("")}, std::nan("")};
  if (!halves.a || !halves.b) return failed;
  const int spp = knobs.spp;
  std::vector<PixelError> errors;
  for (int i = 0, seeds = std::max(2, 16 >> (spp > 1) >> (spp > 4) >> (spp > 16)); i < seeds; ++i) {
    const auto image = path_picture(stage, knobs, world::hash_combine(seed, static_cast<uint64_t>(i)));
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

std::vector<std::string> path_metrics() {
  return {"RMS error of radiance (relative)", "the same without the worst 1 % of pixels"};
}

}  // namespace tools
