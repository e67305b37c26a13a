/// One region as the bytes that OpenVDB writes of it, made straight from its leaves. Internal to world/store.
#pragma once

#include <string>

#include "world/store/tree.h"

namespace world {

constexpr const char* kBlockGridName = "block_id";

/// One grid as bytes, which depend on its values only, uncompressed but for inactive values, which are left out.
/// May throw what OpenVDB throws.
std::string stream_bytes_without_statistics(const openvdb::GridBase::ConstPtr& grid);

/// The same of the Int32 tree that add_region_ids() fills, in a fifth of the time. Without the sizes by which OpenVDB
/// delays the loading of leaves from files, which it doesn't do for streams. May throw what OpenVDB throws.
/// source  OpenVDB 10.0, tree/*.h (writeTopology, writeBuffers) and io/Compression.h (writeCompressedValues)
std::string int32_stream(RegionPos pos, RegionLeaves leaves);

}  // namespace world
