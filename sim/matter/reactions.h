/// What reacts with what, melts, boils and burns: the rows of sim/matter/reactions.toml, and those that a scene adds.
///
///   born_k.NAME = 1400           a voxel of this block is this warm where nothing heated or cooled it; others: 288.15
///   called_by = [...]            blocks that call for the rules of heat, fire and reactions
///   thins_out_per_s.NAME = 0.2   the part of a gas that mixes with the air in a second, where a voxel holds less than
///                                a sixteenth of a full one: rules/gas.cpp
///
///   [[reaction]]
///   what = "lava meets water"    for reports; unique
///   row = "lava + water -> obsidian + steam"      or "a -> c" of one voxel; a becomes c, b becomes d
///   where = "above"              of b, as seen from a: beside (four sides), above, below, any; by default any
///   rate = [1, 4]                chance in a tick, numerator and denominator; by default 1
///   from_k = 1683                a at least as warm; with heat_mj < 0 all of that heat must be there too
///   to_k = 273.15                a at most as warm; with heat_mj > 0 so much must have been taken from it first
///   heat_mj = -306               MJ that become free where a full voxel of a reacts; below 0: are bound; by default 0
///   amounts = [3761, 0]          1/4096 of c and d where a and b are full and c or d is a fluid; by default 4096
///   unbalanced = "why"           needed where the masses of a + b and c + d differ by over 1 %, and nowhere else
///
///   [[fuel]]                     what burns, beside the ignition of the block itself
///   blocks = ["coal_block"], mj_per_kg = 30, hours = 24, leaves = "ash"
///
/// Energy isn't lost: c holds what a held above the row's temperature (that of rest, where it has none), d what b held,
/// and heat_mj is shared: what is freed by their capacities, what is bound by how warm they are.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "world/base/errors.h"
#include "world/blocks/block.h"

namespace world {
class TomlTable;
}

namespace sim {

/// Where b is, as seen from a.
enum class Beside : int { any, beside, above, below };
enum class Condition : int { always, from, to };

struct Reaction {
  std::string what;
  std::string a, b, c, d;  // blocks; b and d empty: of one voxel
  Beside where = Beside::any;
  Condition when = Condition::always;
  double at_k = 0;                           // of `when`
  uint32_t chance = 1, of = 1;               // in a tick: chance / of, 1 <= chance <= of <= 2^20
  double heat_mj = 0;                        // freed by a full voxel of a
  int32_t amount_c = 4096, amount_d = 4096;  // 1/4096 m^3
  std::string unbalanced;
  std::string origin;  // file:line:column
};

struct Fuel {
  double mj_per_kg = 16;
  double hours = 12;  // that a voxel of it burns
  std::string leaves = "ash";
};

struct ReactionTable {
  std::vector<Reaction> rows;
  std::map<std::string, double> born_k;
  std::map<std::string, double> thins_out_per_s;  // by gas, 0..10
  std::vector<std::string> called_by;
  std::map<std::string, Fuel> fuels;  // by block; those that ignite and aren't here burn as Fuel{}

  bool is_called_by(std::string_view block) const;
};

/// Temperature of what nothing heats or cools, in K.
inline constexpr double kRestKelvin = 288.15;

/// Whether a block is one of called_by in the standard table: it calls for heat, fire and reactions.
bool calls_for_heat(const world::Block& block);

/// Compiled in; stops the program where the file is wrong.
const ReactionTable& standard_reactions();

world::Result<ReactionTable> read_reactions(std::string_view text, const std::string& file_name);
/// The [[reaction]] tables of a scene or of the file; problems are noted in the table's document.
std::vector<Reaction> read_reaction_rows(world::TomlTable& root);

/// Names that the palette knows, masses balanced or the row says why not, and chances and temperatures in range; the
/// error says where the row is.
world::Status check_reaction(const Reaction& row, const world::BlockPalette& palette);

/// Sets of rows of which each makes what the next needs, and the last what the first needs, by number: what could go
/// round for ever.
std::vector<std::vector<size_t>> reaction_loops(const std::vector<Reaction>& rows);

}  // namespace sim
