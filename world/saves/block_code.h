/// The blocks of a region in few bytes: a third of what Zstandard makes of its stream. Voxels come leaf by leaf, and
/// the three that came before on each side say what to expect: of the blocks that were seen beside the same three, each
/// is a question that arithmetic coding answers in a small part of a bit where it is no surprise. Internal to
/// world/saves.
///
///   count - 1 u16, then the ids of the region's blocks [count] u16, ascending: a symbol is a place among them
///   one arithmetic code: of each leaf, in order of index_in_region, its symbol where it is uniform, else `count`, and
///   then the symbols of its 512 voxels, by index_in_leaf
///
/// cost   13 to 20 ns a voxel of a mixed leaf of Minecraft's terrain, either way (a Zstandard frame: 8 to 12); where
///        nothing predicts, of 2 blocks at random 22, of 17 70, of 65,536 270; measured on a core of an AMD EPYC, 2026
/// source Witten, Neal, Cleary. Arithmetic Coding for Data Compression. 1987; the coder of 32-bit bounds and 16-bit
///        probabilities: Mahoney. Data Compression Explained, section 4.1. 2010
#pragma once

#include <string>
#include <string_view>

#include "world/store/packed_region.h"

namespace world {

/// The same region always gives the same bytes.
std::string encode_block_code(const PackedRegion& region);

/// Fails, with a reason that names no file, where the bytes are none of encode_block_code or hold ids outside the
/// palette. Memory is that of one region, whatever the bytes claim.
Result<RegionBuilder> decode_block_code(std::string_view bytes, RegionPos pos, size_t palette_size);

}  // namespace world
