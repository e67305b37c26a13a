/// Rows of a save's table `palette`: up to kPaletteRowBlocks blocks each, as the TOML text of each and a zero byte, in
/// a Zstandard frame. Internal to world/saves.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "world/base/errors.h"
#include "world/blocks/block.h"

namespace world {

// What damage to one row costs; a third of the bytes of a row a block, and a sixth more than one row for all (measured:
// the 300 blocks of a .mca).
constexpr size_t kPaletteRowBlocks = 128;

struct PaletteRow {
  int64_t id = 0;      // of the first block
  int64_t blocks = 0;  // 1..kPaletteRowBlocks, one id after the other
  int64_t hash = 0;    // XXH3, 64 bits, of everything above and the bytes
  std::string bytes = {};
};

int64_t hash_of(const PaletteRow& row);
Result<PaletteRow> make_palette_row(size_t first_id, std::span<const std::string> blocks_as_toml);
/// The TOML of each block. Fails, with a reason that names no file, where the row is not whole.
Result<std::vector<std::string>> read_palette_row(const PaletteRow& row);

/// Adds the one block of the text that a save of that version holds. Before version 5 no text said how a block rests or
/// flows: it does as the standard block of its name, where it is that one in all else.
Status add_saved_block(BlockPalette& palette, const std::string& toml, int version, const std::string& where);

}  // namespace world
