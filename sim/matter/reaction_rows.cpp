#include "sim/matter/reaction_rows.h"

#include <cmath>
#include <limits>

namespace sim {

using world::BlockId;

ReactionRows::ReactionRows(const world::BlockPalette& palette, const std::vector<Reaction>& more, double rest_k)
    : palette_(&palette),
      sources_(standard_reactions().rows),
      kind_of_(palette.size(), kNoReactant),
      thermal_(palette, more, rest_k) {
  constexpr uint32_t kBeside =
      1u << world::kFaceNegX | 1u << world::kFacePosX | 1u << world::kFaceNegZ | 1u << world::kFacePosZ;
  constexpr uint32_t kAbove = 1u << world::kFacePosY, kBelow = 1u << world::kFaceNegY;
  constexpr uint32_t kFaces[] = {kBeside | kAbove | kBelow, kBeside, kAbove, kBelow};
  sources_.insert(sources_.end(), more.begin(), more.end());
  for (size_t n = 0; n < sources_.size(); ++n) {
    const Reaction& r = sources_[n];
    const auto a = palette.find(r.a), c = palette.find(r.c);
    const auto b = r.b.empty() ? std::optional<BlockId>(world::kAir) : palette.find(r.b);
    const auto d = r.d.empty() ? std::optional<BlockId>(world::kAir) : palette.find(r.d);
    if (!a || !b || !c || !d) continue;
    ReactionRow row{.a = *a, .b = *b, .c = *c, .d = *d};
    row.kind_a = add_kind(row.a);
    if (!r.b.empty()) row.kind_b = add_kind(row.b), row.faces = kFaces[static_cast<int>(r.where)];
    row.chance = r.chance, row.of = r.of;
    row.when = r.when;
    row.at_k = r.when == Condition::always ? rest_k : r.at_k;
    row.heat = r.heat_mj * 1e6 / kHeatUnitJ;
    row.amount_c = r.amount_c, row.amount_d = r.amount_d;
    row.number = n;
    const int64_t at = thermal_.heat_at(row.a, kFullVoxel, row.at_k), bound = std::llround(row.heat);
    row.ready_heat = row.when == Condition::from ? at + std::max<int64_t>(-bound, 0) : at - std::max<int64_t>(bound, 0);
    rows_.push_back(row);
  }
}

int ReactionRows::add_kind(BlockId id) {
  if (kind_of_[id] == kNoReactant) {
    CHECK_LT(kinds_, kMostKinds - 1);
    kind_of_[id] = static_cast<uint8_t>(kinds_++);
  }
  return kind_of_[id];
}

bool ReactionRows::is_fluid(BlockId id) const {
  const world::Phase phase = (*palette_)[id].phase;
  return id != world::kAir && (phase == world::Phase::liquid || phase == world::Phase::gas);
}

bool ReactionRows::is_ready(const ReactionRow& row, const Cell& a) const {
  if (row.when == Condition::always) return true;
  const double part = is_fluid(row.a) ? a.amount / static_cast<double>(kFullVoxel) : 1.0;
  const int amount = is_fluid(row.a) ? a.amount : kFullVoxel;
  const int64_t above = a.heat - thermal_.heat_at(row.a, amount, row.at_k), bound = std::llround(row.heat * part);
  // What the change binds must be there; what it frees must have been taken.
  return row.when == Condition::from ? above >= std::max<int64_t>(-bound, 0) : -above >= std::max<int64_t>(bound, 0);
}

/// A solid comes whole, or by chance not at all where there is less fluid than it takes, so that mass is right on
/// average. Below 1 there only.
double ReactionRows::chance_of(BlockId to, const Cell& from) const {
  if (is_fluid(to) || !is_fluid(from.block) || to == world::kAir || from.amount >= kFullVoxel) return 1;
  const double part = from.amount / static_cast<double>(kFullVoxel) * (*palette_)[from.block].density.value /
                      (*palette_)[to].density.value;
  return std::min(part, 1.0);
}

/// How much of `to` comes of a cell.
Cell ReactionRows::product(BlockId to, int amount_full, const Cell& from, uint64_t random) const {
  Cell cell{.block = to};
  if (is_fluid(to)) {
    const int64_t of = is_fluid(from.block) ? from.amount : kFullVoxel;
    cell.amount =
        static_cast<uint16_t>(std::clamp<int64_t>((of * amount_full + kFullVoxel / 2) / kFullVoxel, 1, 65535));
    return cell;
  }
  const double chance = chance_of(to, from);
  if (chance < 1 && world::uniform01_double(random) >= chance) cell.block = world::kAir;
  return cell;
}

int64_t ReactionRows::react(const ReactionRow& row, const Cell& a, const Cell& b, uint64_t random, Cell& c,
                            Cell& d) const {
  const auto amount = [&](const Cell& cell) { return is_fluid(cell.block) ? cell.amount : kFullVoxel; };
  const auto above = [&](const Cell& cell) { return cell.heat - thermal_.heat_at(cell.block, amount(cell), row.at_k); };
  const double part = is_fluid(row.a) ? a.amount / static_cast<double>(kFullVoxel) : 1.0;
  const bool pair = row.kind_b >= 0;
  c = product(row.c, row.amount_c, a, random);
  if (row.c == row.a) c.amount = a.amount;
  d = b;
  const int64_t freed = std::llround(row.heat * part);
  if (pair) {
    d = product(row.d, row.amount_d, b, world::mix64(random));
    if (row.d == row.b) d.amount = b.amount;
  }
  // What is freed warms both alike; what is bound is taken from what is warm.
  double part_c = thermal_.capacity(c.block, amount(c)), part_d = thermal_.capacity(d.block, amount(d));
  if (freed < 0 && pair && (above(a) > 0 || above(b) > 0)) {
    part_c = static_cast<double>(std::max<int64_t>(above(a), 0));
    part_d = static_cast<double>(std::max<int64_t>(above(b), 0));
  }
  const int64_t to_c = pair ? std::llround(static_cast<double>(freed) * (part_c / (part_c + part_d))) : freed;
  int64_t lost = 0;
  using Limits = std::numeric_limits<int32_t>;
  // A solid that came by chance has the heat of all of its mass, and one that didn't took its heat along: so energy, as
  // mass, is right on average, and nothing is as hot as what little air could hold of it.
  const auto set = [&](Cell& cell, BlockId wanted, const Cell& from, int64_t units) {
    const int64_t base = thermal_.heat_at(cell.block, amount(cell), row.at_k);
    int64_t now = units + base;
    if (const double chance = chance_of(wanted, from); chance < 1) {
      const double kelvin = row.at_k + static_cast<double>(above(from)) / thermal_.capacity(from.block, amount(from));
      now = cell.block == wanted ? base + std::llround(static_cast<double>(units) / chance)
                                 : std::min(thermal_.heat_at(cell.block, kFullVoxel, kelvin), now);
    }
    const int64_t kept = std::clamp<int64_t>(now, Limits::min() / 2, Limits::max() / 2);
    lost += units + base - kept;
    cell.heat = static_cast<int32_t>(kept);
  };
  set(c, row.c, a, above(a) + to_c);
  if (pair) set(d, row.d, b, above(b) + freed - to_c);
  return lost;
}

}  // namespace sim
