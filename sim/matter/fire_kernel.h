/// What the rule of fire asks of all voxels of a page at once. Internal to sim/matter.
#pragma once

#include <cstdint>

#include "world/blocks/block.h"
#include "world/store/leaf_mask.h"

namespace sim {

/// Voxels that hold a block; those that hold at least so much heat.
world::LeafMask voxels_of(const world::BlockId* ids, world::BlockId id);
world::LeafMask voxels_from(const int32_t* heats, int32_t least);

/// How often each voxel takes a share of heat, as bits of a number of 0..8: times[k] are those worth 2^k.
struct TimesMasks {
  world::LeafMask times[4];
};
/// Voxels that burn give a share to themselves and each side but the upper, which takes two. `beyond[face]`: those of
/// the page across. Only what is in `takes` counts.
TimesMasks count_burning(const world::LeafMask& burns, const world::LeafMask* const* beyond,
                         const world::LeafMask& takes);
/// heats += times * units. Nothing may overflow. Returns the sum of times.
int add_times(const TimesMasks& times, int32_t units, int32_t* heats);

/// Adds to what is spent of some voxels; where that is 2^16 or more, it is 0 again. Returns those.
world::LeafMask spend(const world::LeafMask& which, uint16_t part, uint16_t* spent);
/// All others are 0.
void keep_only(const world::LeafMask& which, uint16_t* values);

}  // namespace sim
