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
  // Slopes of heaps of 20,331 grains, as of cones of the same areas at each height, by the share of places that are
  // smooth and steep; measured on a flat floor, 2026-11-26.
  struct Measured {
    float slope, smooth, steep;
  };
  constexpr Measured kHeaps[] = {{0.563f, 1, 0},      {0.576f, 0.937f, 0}, {0.600f, 0.845f, 0}, {0.633f, 0.701f, 0},
                                 {0.675f, 0.547f, 0}, {0.729f, 0.380f, 0}, {0.840f, 0.199f, 0}, {1.032f, 0.069f, 0},
                                 {1.205f, 0, 0},      {1.229f, 0, 0.111f}, {1.289f, 0, 0.235f}, {1.409f, 0, 0.376f},
                                 {1.667f, 0, 0.600f}, {1.937f, 0, 0.804f}, {2.430f, 0, 1}};
  const float slope = std::clamp(std::tan(repose_deg * kDegree), kHeaps[0].slope, std::end(kHeaps)[-1].slope);
  size_t i = 0;
  while (i + 2 < std::size(kHeaps) && kHeaps[i + 1].slope < slope) ++i;
  const Measured &low = kHeaps[i], &high = kHeaps[i + 1];
  const float t = (slope - low.slope) / (high.slope - low.slope);
  const auto share = [&](float a, float b) { return static_cast<uint32_t>((a + (b - a) * t) * 65536.0f); };
  BlockTraits traits;
  traits.smooth_of = share(low.smooth, high.smooth);
  traits.steep_of = share(low.steep, high.steep);
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
