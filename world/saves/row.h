/// One row of a save's table `region`: what it holds beside its key, its payload, and the hash over all of it.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "world/blocks/block.h"
#include "world/store/layer.h"
#include "world/store/packed_region.h"

namespace world {

/// How the bytes of a row hold the OpenVDB stream of its region.
enum class Codec {
  stream,   // the stream itself, with Blosc inside (also all rows of version 1)
  zstd,     // a Zstandard frame, with its size and checksum, around a stream without Blosc
  context,  // of blocks: what the stream holds, each voxel coded by those beside it (block_code.h); since version 4
};
std::string_view codec_name(Codec codec);
std::optional<Codec> codec_from_name(std::string_view name);

struct PayloadOptions {
  Codec codec = Codec::zstd;
  int level = 3;  // Zstandard's, -7..19; see `loam bench pareto save_compression`
};
/// For files that are written once: a third of the bytes, for more time where blocks lie at random.
constexpr PayloadOptions kSmallPayload{.codec = Codec::context};

struct RegionRow {
  Layer layer = Layer::block;
  RegionPos pos;
  int64_t save = 0;    // the number of the save that wrote it
  int64_t voxels = 0;  // not air; 0 of other layers
  std::string census;  // a line a block: "id count name"; so a region says what its ids mean
  Codec codec = Codec::stream;
  int64_t hash = 0;  // XXH3, 64 bits, of everything above and the bytes
  std::string bytes;
};

int64_t hash_of(const RegionRow& row);
/// Version 1 hashed the bytes only.
int64_t hash_of_bytes(std::span<const char> bytes);

std::string census_text(const Census& census, std::span<const std::string> names);  // names by id
/// Fails where a line is not "id count name".
Result<Census> parse_census(std::string_view text);

Result<std::string> encode_payload(const PackedRegion& region, RegionPos pos, const PayloadOptions& options);
Result<std::string> encode_payload(const AnyLayer& layer, RegionPos pos, const PayloadOptions& options);
/// The row's OpenVDB stream, of all codecs but `context`. Memory is bounded by kMostPayloadBytes, whatever the frame
/// claims.
Result<std::string> stream_of(const RegionRow& row);
/// The values of a row of a layer, added to it.
Status decode_values(const RegionRow& row, AnyLayer& layer);
/// Checks the row's hash, then its blocks against its census.
Result<RegionBuilder> decode_blocks(const RegionRow& row, size_t palette_size);

}  // namespace world
