/// What the rules of matter read of each block, by id: few bytes, so that all of a palette stays in the first cache.
#pragma once

#include <cstdint>
#include <vector>

#include "world/blocks/block.h"

namespace sim {

/// What a voxel is to things that move.
enum class Content : uint8_t { empty, closed, grain, liquid, gas };  // empty: air

struct BlockTraits {
  Content content = Content::closed;
  float density = 0;  // kg/m^3
  float viscosity_pa_s = 0.001f;
  uint32_t smooth_of = 0;  // of 65536 places, those where a grain of it rolls down a slope of one in two
  uint32_t steep_of = 0;   // those where it stands on a slope of two in one
};

/// One entry for each block of the palette.
class MatterTraits {
 public:
  explicit MatterTraits(const world::BlockPalette& palette);
  /// Takes blocks in that the palette has gained.
  void follow();
  const BlockTraits& operator[](world::BlockId id) const { return traits_[id]; }
  size_t size() const { return traits_.size(); }

 private:
  const world::BlockPalette* palette_;
  std::vector<BlockTraits> traits_;
};

/// How often a grain rests by the milder and by the stricter criterion, so that heaps of it stand at an angle, within
/// one voxel over a heap's radius. repose_deg from 29.4 to 67.6; what is beyond is taken for the nearest.
BlockTraits repose_traits(float repose_deg);

}  // namespace sim
