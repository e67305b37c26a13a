/// Rows of reactions for one palette, and what a reacting pair becomes. Internal to sim/matter.
#pragma once

#include <array>

#include "sim/matter/thermal.h"
#include "world/base/random.h"

namespace sim {

/// Blocks that take part in any row, by number: bit k of a page says that one of it is there.
struct KindSet {
  std::array<uint64_t, 4> bits = {};
  void add(int kind) { bits[static_cast<size_t>(kind) >> 6] |= 1ull << (kind & 63); }
  bool has(int kind) const { return bits[static_cast<size_t>(kind) >> 6] >> (kind & 63) & 1; }
  bool empty() const { return !(bits[0] | bits[1] | bits[2] | bits[3]); }
};
inline constexpr int kMostKinds = 256;
inline constexpr uint8_t kNoReactant = 255;

struct ReactionRow {
  world::BlockId a, b, c, d;
  int kind_a = -1, kind_b = -1;  // kind_b -1: of one voxel
  uint32_t faces = 0;            // bit f: b may be across face f of a
  uint32_t chance = 1, of = 1;
  Condition when = Condition::always;
  double at_k = kRestKelvin;
  int64_t ready_heat = 0;  // of a full voxel of a: that it is ready from, or to
  double heat = 0;         // units that a full voxel of a frees
  int amount_c = kFullVoxel, amount_d = kFullVoxel;
  size_t number = 0;  // in the list of rows
};

class ReactionRows {
 public:
  /// Rows whose blocks the palette doesn't know are left out. `more`: after the standard ones.
  ReactionRows(const world::BlockPalette& palette, const std::vector<Reaction>& more, double rest_k = kRestKelvin);
  const std::vector<ReactionRow>& rows() const { return rows_; }
  const std::vector<Reaction>& sources() const { return sources_; }  // by number
  /// The number of a block among those that take part, or kNoReactant.
  uint8_t kind(world::BlockId id) const { return id < kind_of_.size() ? kind_of_[id] : kNoReactant; }
  int kinds() const { return kinds_; }
  ThermalTraits& thermal() { return thermal_; }

  /// Whether a voxel of a is warm or cold enough, with the heat of the change to spare.
  bool is_ready(const ReactionRow& row, const Cell& a) const;
  /// What a and b become. `random`: for what depends on chance. Returns units of heat that didn't fit into 32 bits, and
  /// those that left with too little of a fluid for a solid, less those that came with a solid: on average none.
  int64_t react(const ReactionRow& row, const Cell& a, const Cell& b, uint64_t random, Cell& c, Cell& d) const;

 private:
  int add_kind(world::BlockId id);
  bool is_fluid(world::BlockId id) const;
  double chance_of(world::BlockId to, const Cell& from) const;
  Cell product(world::BlockId to, int amount_full, const Cell& from, uint64_t random) const;

  const world::BlockPalette* palette_;
  std::vector<Reaction> sources_;
  std::vector<ReactionRow> rows_;
  std::vector<uint8_t> kind_of_;
  int kinds_ = 0;
  ThermalTraits thermal_;
};

}  // namespace sim
