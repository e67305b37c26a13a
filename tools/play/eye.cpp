#include "tools/play/eye.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "render/image/display.h"

namespace tools {

namespace {

constexpr double kDay = 60;        // W/m^2 from sun and sky on a level surface: above it the eye is as at noon
constexpr double kDim = 0.05;      // display value that the median is lifted towards, ...
constexpr double kLifted = 0.85;   // ... by this part of the way in stops: a night stays darker than a day
constexpr double kBright = 0.8;    // display value that all is left below but ...
constexpr double kClipped = 0.02;  // ... this share of the picture: lamps themselves, not what they shine on
constexpr double kSeconds = 0.6;   // in which it has gone most of the way
constexpr size_t kEvery = 13;      // pixels of which one is looked at

}  // namespace

double stops_of_night(const render::SkyView& sky, double most) {
  if (!sky.light) return 0;
  const auto mean = [](const world::Irradiance3& e) { return static_cast<double>(e.r + e.g + e.b) / 3; };
  const double sun = std::max(0.0, sky.light->light_direction().y) * mean(sky.light->light_irradiance());
  const double all = sun + mean(sky.light->irradiance({0, 1, 0}));
  return std::clamp(std::log2(kDay / std::max(all, 1e-9)), 0.0, std::max(most, 0.0));
}

double Eye::adapt(const render::Image& image, double exposure_ev, double most_ev, double now_s) {
  std::vector<float> seen;
  const float scale = static_cast<float>(std::exp2(exposure_ev)) / render::kWhiteRadiance;
  for (size_t i = 0; i < image.pixels.size() && most_ev > 0; i += kEvery) {
    const render::Rgb& p = image.pixels[i];
    const float y = (0.2126f * p.r + 0.7152f * p.g + 0.0722f * p.b) * scale;
    if (std::isfinite(y)) seen.push_back(y);
  }
  double wanted = 0;
  if (!seen.empty()) {
    const auto at = [&](double share) {
      const auto n = seen.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(seen.size() - 1));
      std::nth_element(seen.begin(), n, seen.end());
      return std::max(static_cast<double>(*n), 1e-9);
    };
    wanted = kLifted * std::log2(kDim / at(0.5));
    wanted = std::clamp(std::min(wanted, std::log2(kBright / at(1 - kClipped))), 0.0, most_ev);
  }
  const double part = last_s_ < 0 ? 1 : 1 - std::exp(-std::max(0.0, now_s - last_s_) / kSeconds);
  last_s_ = now_s;
  return ev_ += part * (wanted - ev_);
}

}  // namespace tools
