#include "world/saves/palette_rows.h"

#include <fmt/format.h>
#include <xxhash.h>

#include "world/saves/frame.h"

namespace world {

namespace {

constexpr int kLevel = 15;  // 10 ms for the 300 blocks of a .mca, once
constexpr size_t kMostTextBytes = kPaletteRowBlocks << 14;

}  // namespace

int64_t hash_of(const PaletteRow& row) {
  const std::string key = fmt::format("{} {}", row.id, row.blocks);
  return static_cast<int64_t>(
      XXH3_64bits_withSeed(row.bytes.data(), row.bytes.size(), XXH3_64bits(key.data(), key.size())));
}

Result<PaletteRow> make_palette_row(size_t first_id, std::span<const std::string> blocks_as_toml) {
  PaletteRow row{.id = static_cast<int64_t>(first_id), .blocks = static_cast<int64_t>(blocks_as_toml.size())};
  std::string text;
  for (const std::string& block : blocks_as_toml) text.append(block) += '\0';
  if (text.size() > kMostTextBytes)
    return input_error(fmt::format("the blocks from id {} on take {} bytes of text, and at most {} can be saved",
                                   first_id, text.size(), kMostTextBytes));
  TRY(row.bytes, to_frame(text, kLevel));
  row.hash = hash_of(row);
  return row;
}

Result<std::vector<std::string>> read_palette_row(const PaletteRow& row) {
  if (row.hash != hash_of(row)) return input_error("it differs from its hash");
  TRY(const std::string text, from_frame(row.bytes, kMostTextBytes));
  std::vector<std::string> blocks;
  for (size_t at = 0; at < text.size();) {
    const size_t end = text.find('\0', at);
    if (end == text.npos) break;
    blocks.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  if (blocks.empty() || blocks.size() > kPaletteRowBlocks || static_cast<int64_t>(blocks.size()) != row.blocks)
    return input_error("it holds another number of blocks than it states");
  return blocks;
}

Status add_saved_block(BlockPalette& palette, const std::string& toml, int version, const std::string& where) {
  const size_t before = palette.size();
  if (version >= 5) {
    TRY_STATUS(add_blocks_from_toml(palette, toml, where));
  } else {
    BlockPalette alone;
    TRY_STATUS(add_blocks_from_toml(alone, toml, where));
    for (size_t id = 1; id < alone.size(); ++id) {
      const Block& block = alone[static_cast<BlockId>(id)];
      const auto standard = standard_blocks().find(block.name);
      Block known = standard ? standard_blocks()[*standard] : block;
      known.repose_deg = block.repose_deg, known.viscosity_pa_s = block.viscosity_pa_s;
      const bool is_standard = standard && toml_from_block(known) == toml_from_block(block);
      TRY([[maybe_unused]] const BlockId added, palette.add(is_standard ? standard_blocks()[*standard] : block));
    }
  }
  return palette.size() == before + 1 ? Status{} : Status{input_error(where + " is not one block")};
}

}  // namespace world
