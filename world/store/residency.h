/// What a streamer asks of the regions of a store.
#pragma once

#include "world/store/store.h"

namespace world {

/// Raised by each edit of the region; 0 where it is not there.
uint64_t region_edits(const Store& store, RegionPos r);
/// Bytes that bulk reads unpacked, and that Store::refreeze gives back.
size_t region_thaw_bytes(const Store& store, RegionPos r);

}  // namespace world
