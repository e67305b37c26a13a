#include "sim/matter/traits.h"

#include <algorithm>
#include <cmath>

namespace sim {

namespace {

constexpr float kDegree = 3.14159265f / 180;

BlockTraits traits_of(world::BlockId id, const world::Block& block) {
  BlockTraits traits;
  switch (block.phase) {
    case world::Phase::gas:
      traits.content = id == world::kAir ? Content::empty : Content::gas;
      break;
    case world::Phase::liquid:
      traits.content = Content::liquid;
      break;
    case world::Phase::granular:
      traits = repose_traits(static_cast<float>(block.repose_deg));
      traits.content = Content::grain;
      break;
    case world::Phase::solid:
      traits.content = Content::closed;
      break;
  }
  traits.density = static_cast<float>(block.density.value);
  traits.viscosity_pa_s = static_cast<float>(block.viscosity_pa_s);
  return traits;
}

}  // namespace

BlockTraits repose_traits(float repose_deg) {
  // Slopes of 1/2, 1 and 2 are what three criteria of rest give; between them a share of the places has either.
  const float slope = std::tan(std::clamp(repose_deg, 15.0f, 70.0f) * kDegree);
  const auto share = [](float part) { return static_cast<uint32_t>(std::clamp(part, 0.0f, 1.0f) * 65536.0f); };
  BlockTraits traits;
  traits.smooth_of = share((1.0f - slope) / 0.5f);
  traits.steep_of = share(slope - 1.0f);
  return traits;
}

MatterTraits::MatterTraits(const world::BlockPalette& palette) : palette_(&palette) { follow(); }

void MatterTraits::follow() {
  while (traits_.size() < palette_->size()) {
    const auto id = static_cast<world::BlockId>(traits_.size());
    traits_.push_back(traits_of(id, (*palette_)[id]));
  }
}

}  // namespace sim
