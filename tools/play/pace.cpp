#include "tools/play/pace.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "world/base/errors.h"

namespace tools {

namespace {

struct Step {
  double least_scale;  // down to which pixels are left out before it is taken
  std::vector<std::pair<const char*, const char*>> knobs;
};

constexpr int kSlowPictures = 6;  // one after the other, until a step is taken: a hitch is none

const std::vector<Step>& all_steps() {
  static const std::vector<Step> steps = {
      {0.5, {{"texture_anisotropy", "1"}, {"lod_error_px", "2"}}},
      {0.5, {{"light_interpolation", "face"}}},
      {0.3, {{"sun_shadow", "none"}}},
  };
  return steps;
}

}  // namespace

bool Pace::took(double ms) {
  const auto& steps = all_steps();
  const bool more = static_cast<size_t>(steps_) < steps.size();
  const double least = more ? steps[static_cast<size_t>(steps_)].least_scale : 0.3;
  // Time goes with the number of pixels, and part of it doesn't: small steps towards the aim.
  const double wanted = scale_ * std::sqrt(kPictureAimMs / std::max(ms, 1.0));
  if (wanted < scale_ * 0.85 || wanted > scale_ * 1.2)
    scale_ = std::clamp(scale_ + 0.3 * (wanted - scale_), std::min(least, scale_), 1.0);
  slow_ = ms > kSlowMs && scale_ <= least + 1e-9 ? slow_ + 1 : 0;
  if (slow_ < kSlowPictures || !more) return false;
  slow_ = 0, ++steps_;
  return true;
}

void Pace::simplify(render::RenderKnobs& knobs) const {
  const auto& rows = render::render_knobs().rows();
  for (size_t n = 0; n < static_cast<size_t>(steps_); ++n)
    for (const auto& [name, value] : all_steps()[n].knobs)
      for (const auto& row : rows)
        if (row.name == name && row.get(knobs) == row.usual) CHECK(render::render_knobs().set(knobs, name, value).ok());
}

}  // namespace tools
