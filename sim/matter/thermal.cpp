#include "sim/matter/thermal.h"

#include <cmath>

namespace sim {

namespace {

constexpr int kLeastAmount = kFullVoxel / 64;  // what holds less counts as so much, that few units aren't many K

}  // namespace

ThermalTraits::ThermalTraits(const world::BlockPalette& palette, const std::vector<Reaction>& more, double rest_k)
    : palette_(&palette), more_(more), rest_k_(rest_k) {
  follow();
}

void ThermalTraits::follow() {
  const ReactionTable& table = standard_reactions();
  while (traits_.size() < palette_->size()) {
    const world::Block& block = (*palette_)[static_cast<world::BlockId>(traits_.size())];
    Thermal t;
    const double capacity = block.density.value * block.heat_capacity.value;
    t.capacity = static_cast<float>(std::max(capacity / kHeatUnitJ, 1.0));
    t.conductivity = static_cast<float>(block.heat_conductivity.value);
    const auto born = table.born_k.find(block.name);
    if (born != table.born_k.end()) t.born = static_cast<float>(born->second - rest_k_);
    if (block.ignition) t.ignition = static_cast<float>(block.ignition->value - rest_k_);
    for (const std::vector<Reaction>* rows : std::initializer_list<const std::vector<Reaction>*>{&table.rows, &more_})
      for (const Reaction& row : *rows) {
        if (row.a != block.name || !row.b.empty()) continue;
        const float at = static_cast<float>(row.at_k - rest_k_);
        if (row.when == Condition::from && row.heat_mj < 0) t.high = std::min(t.high, at);
        if (row.when == Condition::to && row.heat_mj > 0) t.low = std::max(t.low, at);
      }
    largest_diffusivity_ = std::max(largest_diffusivity_, block.heat_conductivity.value / capacity);
    traits_.push_back(t);
  }
}

ThermalVoxel ThermalTraits::voxel(world::BlockId id, int amount) const {
  const Thermal &t = traits_[id], &air = traits_[world::kAir];
  float capacity = t.capacity, conductivity = t.conductivity;
  if (amount != kFullVoxel && amount != 0) {
    const float part = static_cast<float>(std::max(amount, kLeastAmount)) / static_cast<float>(kFullVoxel);
    const float rest = std::max(1.0f - part, 0.0f);
    capacity = capacity * part + air.capacity * rest;
    conductivity = conductivity * std::min(part, 1.0f) + air.conductivity * rest;
  }
  return {.inverse = 1.0f / capacity,
          .born = t.born,
          .low = t.low,
          .high = t.high,
          .resistance = 0.5f / conductivity,
          .share = capacity / 6.0f};
}

int64_t ThermalTraits::heat_at(world::BlockId id, int amount, double kelvin) const {
  return std::llround(capacity(id, amount) * (kelvin - rest_k_ - static_cast<double>(traits_[id].born)));
}

std::vector<uint8_t> blocks_out_of_rest(const world::BlockPalette& palette, double rest_k) {
  std::vector<uint8_t> out(palette.size(), 0);
  for (const auto& [name, kelvin] : standard_reactions().born_k)
    if (const auto id = palette.find(name)) out[*id] = kelvin != rest_k;
  return out;
}

}  // namespace sim
