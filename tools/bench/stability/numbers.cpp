/// Numbers as they are stored and added up: N1 to N21 of the catalogue.
#include <cmath>

#include "render/image/display.h"
#include "render/trace/film.h"
#include "tools/bench/stability.h"
#include "world/numbers/normalized.shared.h"
#include "world/numbers/robust.h"
#include "world/numbers/shared_exponent.h"
#include "world/numbers/small_float.h"

namespace tools {

namespace {

/// Ten million samples of one pixel, all 0.7 as a float: their mean must be 0.7.
double mean_of_many(bool naive) {
  constexpr int kSamples = 10'000'000;
  const float sample = 0.7f;
  if (naive) {
    float sum = 0;
    for (int i = 0; i < kSamples; ++i) sum += sample;
    return sum / kSamples / double{sample} - 1;
  }
  render::PixelSamples pixel;
  for (int i = 0; i < kSamples; ++i) pixel.add({sample, sample, sample});
  render::Film film(1, 1);
  film.at(0, 0) = pixel;
  return double{film.mean().pixels[0].r} / double{sample} - 1;
}

/// Codes of `bits` that don't come back.
int lost_codes(uint32_t bits) {
  int lost = 0;
  for (uint32_t c = 0; c < (1u << bits); ++c)
    lost += world::shared::unorm_from_float(world::shared::float_from_unorm(c, bits), bits) != c;
  return lost;
}

/// The same by cutting off, and by 1/256 steps.
int lost_codes_naive() {
  int lost = 0;
  for (int c = 0; c < 256; ++c) lost += static_cast<int>(static_cast<float>(c) / 255.0f * 256.0f) >> 0 != c;
  return lost;
}

int lost_srgb_codes(bool through_eight_linear_bits) {
  int lost = 0;
  for (int c = 0; c < 256; ++c) {
    float linear = render::linear_from_srgb(static_cast<float>(c) / 255);
    if (through_eight_linear_bits)
      linear = world::shared::float_from_unorm(world::shared::unorm_from_float(linear, 8), 8);
    lost += static_cast<int>(std::floor(render::srgb_from_linear(linear) * 255 + 0.5f)) != c;
  }
  return lost;
}

double worst_half() {
  double worst = 0;
  for (double x = 0x1p-14; x < 65504; x *= 1.00037) {
    const float f = static_cast<float>(x);
    worst = std::max(worst, std::abs(world::float_from_half(world::half_from_float(f)) / double{f} - 1));
  }
  return worst;
}

double worst_shared_exponent() {
  double worst = 0;
  for (double x = 1e-3; x < 6e4; x *= 1.0007) {
    const glm::vec3 rgb(static_cast<float>(x), static_cast<float>(0.37 * x), static_cast<float>(0.011 * x));
    const glm::vec3 back = world::Rgb9e5::from(rgb).value();
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(double{back[c]} - double{rgb[c]}) / double{rgb.x});
  }
  return worst;
}

}  // namespace

void add_stability_numbers(std::vector<StabilityCase>& cases) {
  cases.push_back({"N1", "every code of 8 bits comes back from a float", "codes", 0, "exactness",
                   [](BenchContext&) -> Result<double> { return lost_codes(8) + lost_codes(10); },
                   [] { return double(lost_codes_naive()); }});
  cases.push_back({"N4", "every sRGB code survives linear light in float", "codes", 0, "exactness",
                   [](BenchContext&) -> Result<double> { return lost_srgb_codes(false); },
                   [] { return double(lost_srgb_codes(true)); }});
  cases.push_back({"N7", "half floats round to nearest", "relative", 0x1p-11, "IEEE 754-2019, 11 bits",
                   [](BenchContext&) -> Result<double> { return worst_half(); }});
  cases.push_back({"N8", "three bands share an exponent", "of the largest band", 1.0 / 511, "9 bits of mantissa",
                   [](BenchContext&) -> Result<double> { return worst_shared_exponent(); }});
  cases.push_back({"N10", "the mean of ten million samples is right", "relative", 1e-6, "the catalogue",
                   [](BenchContext&) -> Result<double> { return mean_of_many(false); },
                   [] { return mean_of_many(true); }});
}

}  // namespace tools
