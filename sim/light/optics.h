/// What blocks do to the levels of light: how many a voxel takes from what enters it, and which it gives.
///
/// A level is a step of brightness, not an amount: each stands for kLevelRatio of the one above it, what block games
/// draw them by. So what a block's absorption and emission say in physical units becomes levels by logarithms:
///   loss   1 for the step into the voxel, and ln(T) / ln(kLevelRatio) more where a metre of the block lets T pass
///   level  15 for a voxel that emits kFullLampWatts in a band, one less for each kLevelRatio of that
/// Rules of other games state both (sim/light/game_rules.h).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "world/blocks/block.h"
#include "world/store/light_volume.h"

namespace sim {

using world::kFullLampWatts, world::kLevelRatio;

/// One block in one band.
struct BlockOptics {
  uint8_t loss = 1;         // levels lost by light that enters, 1 to 15; 0: none enters
  uint8_t level = 0;        // given by the voxel itself, 0 to 15, also where none enters
  bool passes_sky = false;  // the full light of the sky goes straight down through it without loss; loss is then 1
  friend bool operator==(const BlockOptics&, const BlockOptics&) = default;
};

struct LightRules {
  int sky_level = 15;  // of the open sky, 1 to 15
  /// By block id. flood4 reads all_bands, which is the brightest of the three.
  std::vector<std::array<BlockOptics, 3>> bands;
  std::vector<BlockOptics> all_bands;

  /// Whether light of the sky changes colour anywhere.
  bool filters_colour() const;
};

/// Loam's own rules: from each block's opacity, absorption and emission.
LightRules light_rules(const world::BlockPalette& palette);
std::array<BlockOptics, 3> optics_of(const world::Block& block);
/// The same for all bands.
BlockOptics brightest(const std::array<BlockOptics, 3>& bands);

}  // namespace sim
