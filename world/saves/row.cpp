#include "world/saves/row.h"

#include <charconv>

#include <fmt/format.h>
#include <xxhash.h>

#include "world/saves/block_code.h"
#include "world/saves/database.h"
#include "world/saves/frame.h"
#include "world/store/region_stream.h"

namespace world {

std::string_view codec_name(Codec codec) {
  return codec == Codec::stream ? "stream" : codec == Codec::zstd ? "zstd" : "context";
}

std::optional<Codec> codec_from_name(std::string_view name) {
  for (const Codec codec : {Codec::stream, Codec::zstd, Codec::context})
    if (codec_name(codec) == name) return codec;
  return std::nullopt;
}

int64_t hash_of_bytes(std::span<const char> bytes) {
  return static_cast<int64_t>(XXH3_64bits(bytes.data(), bytes.size()));
}

int64_t hash_of(const RegionRow& row) {
  // The key is hashed too: a flipped coordinate must not move a region silently.
  const std::string key =
      fmt::format("{} {} {} {} {} {} {}\n{}", layer_rows()[static_cast<size_t>(row.layer)].name, row.pos.x, row.pos.y,
                  row.pos.z, row.save, row.voxels, codec_name(row.codec), row.census);
  return static_cast<int64_t>(
      XXH3_64bits_withSeed(row.bytes.data(), row.bytes.size(), XXH3_64bits(key.data(), key.size())));
}

std::string census_text(const Census& census, std::span<const std::string> names) {
  std::string text;
  for (const auto& [block, n] : census) text += fmt::format("{} {} {}\n", block, n, names[block]);
  return text;
}

Result<Census> parse_census(std::string_view text) {
  Census census;
  while (!text.empty()) {
    const size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    unsigned id = 0;
    uint64_t count = 0;
    const char* const last = line.data() + line.size();
    const auto first = std::from_chars(line.data(), last, id);
    if (first.ec != std::errc() || first.ptr == last || *first.ptr != ' ' || id >= kMaxBlocks)
      return input_error("its census is not lines of \"id count name\"");
    const auto second = std::from_chars(first.ptr + 1, last, count);
    if (second.ec != std::errc() || second.ptr == last || *second.ptr != ' ' || count == 0)
      return input_error("its census is not lines of \"id count name\"");
    census[static_cast<BlockId>(id)] = count;
  }
  return census;
}

Result<std::string> encode_payload(const PackedRegion& region, RegionPos pos, const PayloadOptions& options) {
  if (options.codec == Codec::stream) return encode_region(region, pos, StreamCompression::blosc);
  if (options.codec == Codec::context) return encode_block_code(region);
  TRY(const std::string stream, encode_region(region, pos, StreamCompression::none));
  return to_frame(stream, options.level);
}

Result<std::string> encode_payload(const AnyLayer& layer, RegionPos pos, const PayloadOptions& options) {
  if (options.codec == Codec::context) return input_error("a layer has no blocks that the context codec could code");
  const auto encode = [&](StreamCompression compression) {
    return std::visit([&](const auto& values) { return values.encode_region(pos, compression); }, layer);
  };
  if (options.codec == Codec::stream) return encode(StreamCompression::blosc);
  TRY(const std::string stream, encode(StreamCompression::none));
  return to_frame(stream, options.level);
}

Result<std::string> stream_of(const RegionRow& row) {
  if (row.codec == Codec::stream) return row.bytes;
  if (row.codec == Codec::context) return input_error("it is packed as \"context\", which is for blocks");
  return from_frame(row.bytes, kMostPayloadBytes);
}

Status decode_values(const RegionRow& row, AnyLayer& layer) {
  TRY(const std::string stream, stream_of(row));
  return std::visit([&](auto& values) { return values.decode_region(stream, row.pos); }, layer);
}

Result<RegionBuilder> decode_blocks(const RegionRow& row, size_t palette_size) {
  if (row.codec == Codec::context) return decode_block_code(row.bytes, row.pos, palette_size);
  TRY(const std::string stream, stream_of(row));
  return decode_region(stream, row.pos, palette_size);
}

}  // namespace world
