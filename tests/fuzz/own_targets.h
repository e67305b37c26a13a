/// The targets of Loam's own files: scenes, tables of blocks and names, and saves; targets() holds them too.
#pragma once

#include "tests/fuzz/targets.h"

namespace world::fuzz {

std::vector<Target> own_targets();

/// OpenVDB streams of one grid, without compression and with Blosc: of blocks, then of floats. They are .vdb files too.
std::vector<Bytes> grid_stream_seeds();

}  // namespace world::fuzz
