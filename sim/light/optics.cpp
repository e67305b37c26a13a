#include "sim/light/optics.h"

#include <algorithm>
#include <cmath>

namespace sim {

namespace {

int levels_of_ratio(double ratio) { return static_cast<int>(std::lround(std::log(ratio) / std::log(kLevelRatio))); }

BlockOptics optics_in_band(const world::Block& block, float absorption, float emission) {
  BlockOptics optics;
  if (emission > 0) {
    const int below = levels_of_ratio(std::min(1.0, emission / kFullLampWatts));
    optics.level = static_cast<uint8_t>(std::max(0, world::kMaxLight - below));
  }
  if (block.opaque) {
    optics.loss = 0;
    return optics;
  }
  // exp(-a) / ln(ratio): a metre of a block that absorbs a.
  const double more = std::min(std::round(absorption / -std::log(kLevelRatio)), 100.0);
  optics.loss = static_cast<uint8_t>(std::min(1 + static_cast<int>(more), world::kMaxLight));
  // Clear liquids too darken with depth: their loss is small, but never none.
  optics.passes_sky = optics.loss == 1 && block.phase != world::Phase::liquid;
  return optics;
}

}  // namespace

std::array<BlockOptics, 3> optics_of(const world::Block& block) {
  return {optics_in_band(block, block.absorption.r, block.emission.r),
          optics_in_band(block, block.absorption.g, block.emission.g),
          optics_in_band(block, block.absorption.b, block.emission.b)};
}

BlockOptics brightest(const std::array<BlockOptics, 3>& bands) {
  BlockOptics all{.loss = 0};
  for (const BlockOptics& band : bands) {
    all.level = std::max(all.level, band.level);
    if (band.loss > 0 && (all.loss == 0 || band.loss < all.loss)) all.loss = band.loss;
    all.passes_sky |= band.passes_sky;
  }
  return all;
}

LightRules light_rules(const world::BlockPalette& palette) {
  LightRules rules;
  for (size_t id = 0; id < palette.size(); ++id) {
    rules.bands.push_back(optics_of(palette[static_cast<world::BlockId>(id)]));
    rules.all_bands.push_back(brightest(rules.bands.back()));
  }
  return rules;
}

bool LightRules::filters_colour() const {
  return std::any_of(bands.begin(), bands.end(), [](const std::array<BlockOptics, 3>& b) {
    const auto passes_alike = [](const BlockOptics& x, const BlockOptics& y) {
      return x.loss == y.loss && x.passes_sky == y.passes_sky;
    };
    return !passes_alike(b[0], b[1]) || !passes_alike(b[0], b[2]);
  });
}

}  // namespace sim
