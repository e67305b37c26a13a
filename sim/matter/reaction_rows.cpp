#include "sim/matter/reaction_rows.h"

#include <cmath>
#include <limits>

namespace sim {

using world::BlockId;

ReactionRows::ReactionRows(const world::BlockPalette& palette, const std::vector<Reaction>& more)
    : palette_(&palette),
      sources_(standard_reactions().rows),
      kind_of_(palette.size(), kNoReactant),
      thermal_(palette, more) {
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
    if (r.when != Condition::always) row.at_k = r.at_k;
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

/// How much of `to` comes of a cell. A solid comes whole, or by chance not at all where there is less fluid than it
/// takes, so that mass is right on average.
Cell ReactionRows::product(BlockId to, int amount_full, const Cell& from, uint64_t random) const {
  Cell cell{.block = to};
  const bool was_fluid = is_fluid(from.block);
  if (is_fluid(to)) {
    const int64_t of = was_fluid ? from.amount : kFullVoxel;
    cell.amount =
        static_cast<uint16_t>(std::clamp<int64_t>((of * amount_full + kFullVoxel / 2) / kFullVoxel, 1, 65535));
    return cell;
  }
  if (!was_fluid || to == world::kAir || from.amount >= kFullVoxel) return cell;
  const double part = from.amount / static_cast<double>(kFullVoxel) * (*palette_)[from.block].density.value /
                      (*palette_)[to].density.value;
  if (world::uniform01_double(random) >= part) cell.block = world::kAir;
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
  const auto set = [&](Cell& cell, int64_t units, int64_t most) {
    units += thermal_.heat_at(cell.block, amount(cell), row.at_k);
    using Limits = std::numeric_limits<int32_t>;
    const int64_t kept = std::clamp<int64_t>(units, Limits::min() / 2, most);
    lost += units - kept;
    cell.heat = static_cast<int32_t>(kept);
  };
  constexpr int64_t kMost = INT32_MAX / 2;
  // Where too little of a fluid is there for the solid, nothing is left of it, and air takes over none of its heat
  // beyond its temperature.
  const double kelvin = row.at_k + static_cast<double>(above(a)) / thermal_.capacity(a.block, amount(a));
  const bool vanished = c.block != row.c;
  set(c, above(a) + to_c, vanished ? std::min(kMost, thermal_.heat_at(c.block, kFullVoxel, kelvin)) : kMost);
  if (pair) set(d, above(b) + freed - to_c, kMost);
  return lost;
}

}  // namespace sim
