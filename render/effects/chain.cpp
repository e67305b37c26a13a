#include "render/effects/chain.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include <fmt/format.h>

#include "render/effects/chain.shared.h"
#include "render/image/display.h"
#include "render/image/formats.shared.h"
#include "render/knob_ranges.h"
#include "world/base/jobs.h"

namespace render {

namespace {

using shared::BloomStep;
using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

constexpr double kPi = 3.14159265358979323846;
constexpr const char* kNames[] = {
#define EFFECT(name) #name,
#include "render_effects.list.h"
#undef EFFECT
};

/// Lays levels, a row's blur and lobes out in one buffer.
class BloomPlanner {
 public:
  explicit BloomPlanner(EffectPlan& plan) : plan_(plan) {
    levels_.push_back({-1, plan.frame.size.x, plan.frame.size.y});
  }

  void add_lobe(int index, double sigma_px, int most_halvings) {
    const int halvings = std::min(most_halvings, static_cast<int>(std::floor(std::log2(std::max(sigma_px, 1.0)))));
    while (static_cast<int>(levels_.size()) <= halvings) halve();
    const Level& from = levels_[static_cast<size_t>(halvings)];
    // What halving and looking up between texels blur already: variances of 1 3 3 1 / 8 a level, and of a tent.
    const double h2 = std::exp2(2.0 * halvings);
    const double before = halvings > 0 ? 5 * h2 / 12 - 1.0 / 6 : 0;
    const double rest = std::max(sigma_px * sigma_px - before, 1e-4) / h2;
    const auto sigma = static_cast<float>(std::sqrt(rest));
    const Level rows = take(from.width, from.height), lobe = take(from.width, from.height);
    plan_.bloom_steps.push_back(step(from, rows, shared::kBloomRows, sigma));
    plan_.bloom_steps.push_back(step(rows, lobe, shared::kBloomColumns, sigma));
    plan_.frame.lobe[index] = {lobe.first, lobe.width, lobe.height, halvings};
  }

 private:
  struct Level {
    int first, width, height;
  };
  Level take(int width, int height) {
    const Level level{static_cast<int>(plan_.blurred_numbers), width, height};
    plan_.blurred_numbers += size_t{3} * static_cast<size_t>(width) * static_cast<size_t>(height);
    return level;
  }
  void halve() {
    const Level from = levels_.back(), to = take((from.width + 1) / 2, (from.height + 1) / 2);
    plan_.bloom_steps.push_back(step(from, to, shared::kBloomHalve, 0));
    levels_.push_back(to);
  }
  static BloomStep step(const Level& from, const Level& to, uint32_t kind, float sigma) {
    return {from.first, from.width, from.height, to.first, to.width, to.height, kind, sigma};
  }

  EffectPlan& plan_;
  std::vector<Level> levels_;
};

constexpr size_t kGrain = 16384;  // pixels a task

uint64_t count_not_finite(const Image& image) {
  return world::ordered_reduce(
      image.pixels.size(), kGrain, uint64_t{0},
      [&](size_t begin, size_t end) {
        uint64_t count = 0;
        for (size_t i = begin; i < end; ++i) {
          const Rgb& p = image.pixels[i];
          count += !(shared::is_finite(p.r) && shared::is_finite(p.g) && shared::is_finite(p.b));
        }
        return count;
      },
      [](uint64_t a, uint64_t b) { return a + b; });
}

float meter(const EffectPlan& plan, const shared::EffectSource& source) {
  using Counts = std::array<uint32_t, shared::kMeterBuckets>;
  const shared::EffectFrame& f = plan.frame;
  const Counts counts = world::ordered_reduce(
      static_cast<size_t>(f.size.y), 16, Counts{},
      [&](size_t begin, size_t end) {
        Counts part{};
        for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
          for (int x = 0; x < f.size.x; ++x)
            if (const int bucket = shared::meter_bucket(shared::texel(source, f, x, y)); bucket >= 0)
              ++part[static_cast<size_t>(bucket)];
        return part;
      },
      [](Counts a, const Counts& b) {
        for (size_t i = 0; i < a.size(); ++i) a[i] += b[i];
        return a;
      });
  uint32_t all = 0;
  for (const uint32_t count : counts) all += count;
  shared::MeterSum sum{0, 0, 0};
  for (int i = 0; i < shared::kMeterBuckets; ++i)
    sum = shared::meter_add(f, sum, static_cast<float>(all), i, static_cast<float>(counts[static_cast<size_t>(i)]));
  return shared::metered_ev(f, sum);
}

template <class EachPixel>
void each_row(int width, int height, EachPixel each) {
  const size_t rows = std::max<size_t>(1, kGrain / static_cast<size_t>(std::max(width, 1)));
  world::parallel_ranges(static_cast<size_t>(height), rows, [&](size_t begin, size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y)
      for (int x = 0; x < width; ++x) each(x, y);
  });
}

void gather(const EffectPlan& plan, const shared::EffectSource& source, Image& image) {
  Image out(image.width, image.height);
  each_row(image.width, image.height, [&](int x, int y) {
    glm::vec3 c = shared::effects_at(source, plan.frame, plan.effects, {x, y});
    if (plan.format != shared::kFormatFloat32)
      c = shared::unpack_colour(plan.format, shared::pack_colour(plan.format, c * plan.frame.window.z)) *
          plan.frame.window.w;
    out.at(x, y) = {c.x, c.y, c.z};
  });
  image = std::move(out);
}

}  // namespace

world::Result<EffectPlan> plan_effects(const Camera& camera, const RenderKnobs& knobs, int width, int height,
                                       std::span<const FlareSpot> spots) {
  TRY_STATUS(check_ranges(knobs));
  EffectPlan plan;
  shared::EffectFrame& f = plan.frame;
  const PictureWindow& window = camera.window;
  const int whole_width = window.whole_width > 0 ? window.whole_width : width;
  const int whole_height = window.whole_height > 0 ? window.whole_height : height;
  const PixelRays rays(camera, width, height);
  const double scale = std::exp2(double{knobs.exposure}) / kWhiteRadiance;
  f.size = {width, height, whole_width, whole_height};
  f.window = {static_cast<float>(window.x), static_cast<float>(window.y), static_cast<float>(scale),
              static_cast<float>(1 / scale)};
  f.lens = {static_cast<float>(rays.tan_half_x), static_cast<float>(rays.tan_half_y), 0.5f * float(whole_height),
            2.0f / float(whole_height)};
  f.strength = {knobs.vignette, knobs.chromatic_aberration, knobs.bloom, knobs.grain};
  const auto turn_on = [&](bool on, uint32_t effect) { plan.effects |= on ? 1u << effect : 0u; };
  turn_on(knobs.vignette > 0, EFFECT_vignette);
  turn_on(knobs.chromatic_aberration > 0, EFFECT_chromatic_aberration);
  turn_on(knobs.grain > 0, EFFECT_grain);
  f.grain.x = static_cast<uint32_t>(knobs.grain_seed);

  turn_on(knobs.bloom > 0, EFFECT_bloom);
  if (knobs.bloom > 0) {
    f.bloom = {static_cast<float>(knobs.bloom_threshold / scale), 1.0f / shared::kBloomLobes, 0, 0};
    f.lobe_map = {1, 0, 0, 0};
    BloomPlanner planner(plan);
    for (int i = 0; i < shared::kBloomLobes; ++i)
      planner.add_lobe(i, knobs.bloom_radius * whole_height * std::exp2(-2.0 * i), knobs.bloom_levels);
  }

  if (knobs.lens_flare > 0 && !spots.empty()) {
    turn_on(true, EFFECT_lens_flare);
    f.modes.y = static_cast<uint32_t>(std::min<size_t>(spots.size(), shared::kMostFlareSpots));
    f.modes.z = static_cast<uint32_t>(knobs.lens_flare_blades);
    for (uint32_t s = 0; s < f.modes.y; ++s) {
      const FlareSpot& spot = spots[s];
      const Rgb r = spot.radiance * knobs.lens_flare;
      f.spots[2 * s] = {static_cast<float>(spot.x), static_cast<float>(spot.y), 0, 0};
      f.spots[2 * s + 1] = {r.r, r.g, r.b, 0};
    }
    for (uint32_t k = 0; k < f.modes.z; ++k) {
      const double angle = 2 * kPi * k / f.modes.z + 0.3;  // no side stands upright
      f.blades[k / 2][static_cast<int>(k % 2 * 2)] = static_cast<float>(std::cos(angle));
      f.blades[k / 2][static_cast<int>(k % 2 * 2 + 1)] = static_cast<float>(std::sin(angle));
    }
  }

  plan.meter = knobs.exposure_mode != ExposureMode::fixed;
  turn_on(plan.meter, EFFECT_exposure);
  const bool trimmed = knobs.exposure_mode == ExposureMode::histogram;
  if (plan.meter && knobs.exposure_least > knobs.exposure_most)
    return world::usage_error(fmt::format("exposure_least, {} EV, lies above exposure_most, {} EV",
                                          knobs.exposure_least, knobs.exposure_most));
  // Of stops that stand in the place of `exposure`, which the picture has already.
  f.meter = {trimmed ? 0.1f : 0.0f, static_cast<float>(std::log2(knobs.exposure_key / scale)),
             knobs.exposure_least - knobs.exposure, knobs.exposure_most - knobs.exposure};
  turn_on(knobs.tone_map != ToneMap::clamp, EFFECT_tone_map);
  f.modes.x = static_cast<uint32_t>(knobs.tone_map);
  f.modes.w = 3;
  plan.format = static_cast<uint32_t>(knobs.colour_format);
  return plan;
}

world::Result<EffectPlan> plan_effects(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs,
                                       int width, int height) {
  std::vector<FlareSpot> spots;
  if (knobs.lens_flare > 0) spots = flare_spots(view, camera, knobs, width, height);
  return plan_effects(camera, knobs, width, height, spots);
}

EffectOutcome apply_effects(const EffectPlan& plan, Image& image) {
  EffectOutcome outcome;
  if (plan.empty()) return outcome;
  CHECK_EQ(image.width, plan.frame.size.x);
  CHECK_EQ(image.height, plan.frame.size.y);
  outcome.not_finite = count_not_finite(image);
  outcome.blurred.resize(plan.blurred_numbers);
  shared::EffectSource source{&image.pixels.data()->r, outcome.blurred.data(), plan.metered_ev};
  for (const BloomStep& step : plan.bloom_steps)
    each_row(step.to_width, step.to_height, [&](int x, int y) {
      const glm::vec3 made = shared::bloom_made(source, plan.frame, step, x, y);
      float* to = outcome.blurred.data() + step.to + 3 * (static_cast<ptrdiff_t>(y) * step.to_width + x);
      to[0] = made.x, to[1] = made.y, to[2] = made.z;
    });
  if (plan.meter) source.metered = meter(plan, source);
  outcome.metered_ev = source.metered;
  gather(plan, source, image);
  return outcome;
}

void apply_effects(const EffectPlan& of_tile, const WholePicture& whole, Image& tile) {
  if (of_tile.empty()) return;
  EffectPlan plan = of_tile;
  for (int i = 0; i < shared::kBloomLobes; ++i) plan.frame.lobe[i] = whole.plan.frame.lobe[i];
  plan.frame.lobe_map = {static_cast<float>(whole.width) / static_cast<float>(plan.frame.size.z), plan.frame.window.x,
                         plan.frame.window.y, 0};
  gather(plan, {&tile.pixels.data()->r, whole.outcome.blurred.data(), static_cast<float>(whole.outcome.metered_ev)},
         tile);
}

std::string effect_pass_name(const EffectPlan& plan) {
  std::string name;
  for (uint32_t i = 0; i < std::size(kNames); ++i)
    if (plan.effects & 1u << i) name += (name.empty() ? "" : "+") + std::string(kNames[i]);
  if (plan.format != shared::kFormatFloat32) name += (name.empty() ? "" : "+") + std::string("store");
  return name;
}

uint64_t finished_bytes(const EffectPlan& plan) {
  const uint64_t pixels = static_cast<uint64_t>(plan.frame.size.x) * static_cast<uint64_t>(plan.frame.size.y);
  if (plan.format == shared::kFormatRgb565) return (pixels + 1) / 2 * 4;
  return pixels * 4 * shared::format_words(plan.format);
}

std::vector<PassReport> effect_passes(const EffectPlan& plan) {
  std::vector<PassReport> passes;
  if (plan.empty()) return passes;
  const uint64_t picture =
      sizeof(Rgb) * static_cast<uint64_t>(plan.frame.size.x) * static_cast<uint64_t>(plan.frame.size.y);
  uint64_t blurred = 0;
  for (const BloomStep& step : plan.bloom_steps)
    blurred += sizeof(Rgb) * (uint64_t(step.from_width) * uint64_t(step.from_height) +
                              uint64_t(step.to_width) * uint64_t(step.to_height));
  if (!plan.bloom_steps.empty()) passes.push_back({"bloom_levels", 0, plan.bloom_steps.size(), blurred});
  if (plan.meter) passes.push_back({"exposure_meter", 0, 2, picture});
  passes.push_back({effect_pass_name(plan), 0, 1, picture + finished_bytes(plan)});
  return passes;
}

world::Status finish_picture(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs,
                             Frame& frame) {
  const auto start = Clock::now();
  TRY(const EffectPlan plan, plan_effects(view, camera, knobs, frame.image.width, frame.image.height));
  if (plan.empty()) return {};
  const EffectOutcome outcome = apply_effects(plan, frame.image);
  FrameReport& report = frame.report;
  report.metered_ev = outcome.metered_ev, report.not_finite = outcome.not_finite;
  const double ms = ms_since(start);
  std::vector<PassReport> passes = effect_passes(plan);
  passes.back().ms = ms;  // of all of them
  report.passes.insert(report.passes.end(), passes.begin(), passes.end());
  report.ms += ms;
  return {};
}

RenderKnobs without_display_effects(RenderKnobs knobs) {
  knobs.exposure_mode = ExposureMode::fixed, knobs.tone_map = ToneMap::clamp, knobs.grain = 0;
  knobs.colour_format = ColourFormat::float32;
  return knobs;
}

RenderKnobs without_effects(RenderKnobs knobs) {
  knobs = without_display_effects(knobs);
  knobs.bloom = knobs.lens_flare = knobs.vignette = knobs.chromatic_aberration = 0;
  return knobs;
}

}  // namespace render
