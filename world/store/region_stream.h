/// A region as bytes and back: an OpenVDB stream of one registered grid (Int32 block ids), which any OpenVDB program
/// reads.
#pragma once

#include <span>
#include <string>

#include "world/store/packed_region.h"
#include "world/store/store.h"

namespace world {

/// The block layer of one region. The same region always gives the same bytes.
Result<std::string> encode_region(const Store& store, RegionPos pos, StreamCompression compression);
Result<std::string> encode_region(const PackedRegion& region, RegionPos pos, StreamCompression compression);

/// Fails, with a reason that names no file, where the bytes are no such stream or hold ids outside the palette.
Result<RegionBuilder> decode_region(std::span<const char> bytes, RegionPos pos, size_t palette_size);

}  // namespace world
