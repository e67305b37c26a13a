/// Block names of other games -> Loam's blocks, by the tables world/formats/translation/<game>.toml.
///
/// A state is "name" or "name[property=value,...]". A table says of a name either that a block of Loam is the same
/// thing, and then the world gets that block; or what it looks like, and then the world gets a block under its own name
/// and with the properties that matter ("minecraft:oak_stairs[facing=east,half=top]"), made from one of Loam's with
/// another shape, phase or colour. What no rule knows becomes a placeholder, bright magenta, under its own name.
/// "loam:NAME" is NAME: so our own exports come back as they were.
///
///   namespace = "minecraft"                 left out of names in the table
///   [list.colour]                           {colour} in a match stands for each key, in block, like and proxy for its
///   light_gray = "light_grey"               value, in base for the key
///   [blocks]                                the same things
///   andesite = "andesite"
///   [like]                                  what looks like a block of Loam
///   chest = "oak_planks"
///   [[rule]]                                after those; the first that fits and leads to a block counts
///   match = ["*_stairs"]                    names; one * stands for any text
///   when = "half=top"                       only with these values, "" for a property that isn't there
///   block | like | base = ["*_planks"]      one of Loam's; one that it looks like; names of the same game, tried in
///   turn keep = ["level"]                        properties that stay in its name proxy = "stairs_{facing}_{half}"
///   shape, from properties; where there is no such shape it stays a cube albedo, emission_w, opaque, phase, bsdf
///   instead of those of the block it looks like [ids], [id.53]                          numeric ids of old versions,
///   see numeric_ids.h
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "world/blocks/block.h"
#include "world/formats/cubes/states.h"
#include "world/formats/format.h"

namespace world {

struct BlockState {
  std::string name;
  std::map<std::string, std::string> properties;
};
BlockState parse_state(std::string_view text);
/// Properties sorted by name; no brackets where there are none.
std::string state_text(const BlockState& state);

class TranslationTable;
/// "minecraft" or "luanti"; compiled in.
const TranslationTable& translation_table(std::string_view game);
/// "oak_log[axis=y]" for "17:0"; empty where the table has no such numeric id.
std::string numeric_state(const TranslationTable& table, std::string_view text);
/// What is wrong with a table, with its file, line and column: the first thing. `file_name` is for that.
Status check_translation_table(std::string_view text, const std::string& file_name);

/// What the table makes of a state, or nothing.
struct Translated {
  Block block;
  bool same = false;  // one of Loam's own; else a block under its own name
};
std::optional<Translated> translate(const TranslationTable& table, const BlockState& state);
/// The name of the game for one of Loam's blocks: the first that translates to it. Empty where there is none.
std::string foreign_name(const TranslationTable& table, std::string_view loam_name);

/// What a file of the game says for a block: the game's own name where that reads back as the same block, else
/// "loam:NAME", and then the file must define the block, if anything is to know what it is.
std::string written_state(const TranslationTable& table, const Block& block);

/// What files of games hold beside blocks, and worlds don't.
struct LeftBehind {
  size_t entities = 0, block_entities = 0;
};

/// Translates the states of one file into the palette of one world.
class Translator {
 public:
  /// `definitions`: blocks that the file itself defines, for names "loam:NAME".
  Translator(const TranslationTable& table, BlockPalette& palette, const BlockPalette* definitions = nullptr);

  /// Never fails: what has no match, or no room in the palette, gets a placeholder.
  BlockId block(std::string_view state);
  /// All, by number; ids are given in order of the texts, so that they don't depend on threads.
  std::vector<BlockId> blocks(const StateTable& states);
  /// Names a numeric id whose meaning the file itself gives.
  void name_id(int id, std::string name) { id_names_[id] = std::move(name); }

  /// How every reader of a game's files ends: the table says what was left behind and how many voxels are placeholders
  /// (an error where they must not be), and the metadata say where the world came from. A voxel is a metre.
  Status finish(World& world, std::string_view format, const std::filesystem::path& file, const ImportOptions& options,
                ImportReport& report, const std::optional<LeftBehind>& left_behind = {}) const;

 private:
  BlockId placeholder(const std::string& name);

  const TranslationTable& table_;
  BlockPalette& palette_;
  const BlockPalette* definitions_;
  std::map<int, std::string> id_names_;
  std::map<BlockId, std::string> placeholders_;  // -> name in the file
};

/// Bytes of a file as a block's or a report's name: printable, no spaces, quotes or backslashes, at most 256.
std::string plain_name(std::string_view bytes);

}  // namespace world
