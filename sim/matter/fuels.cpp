#include "sim/matter/fuels.h"

namespace sim {

namespace {

constexpr double kGlowsFrom = 900;  // K: lights what is beside it; embers and lava do

}  // namespace

FireBlocks::FireBlocks(const world::BlockPalette& palette, const std::vector<Reaction>& more, double rest_k)
    : palette_(&palette), thermal_(palette, more, rest_k) {
  follow();
}

void FireBlocks::follow() {
  thermal_.follow();
  const ReactionTable& table = standard_reactions();
  while (traits_.size() < palette_->size()) {
    const auto id = static_cast<world::BlockId>(traits_.size());
    const world::Block& block = (*palette_)[id];
    FireTraits t;
    t.flame = block.name == "fire";
    t.air = id == world::kAir || block.name == "smoke";
    t.feeds = t.flame || t.air;
    if (t.flame) fire_ = id;
    if (block.name == "smoke") smoke_ = id;
    const auto born = table.born_k.find(block.name);
    t.hot = born != table.born_k.end() && born->second >= kGlowsFrom;
    if (block.ignition && block.phase == world::Phase::solid) {
      const auto found = table.fuels.find(block.name);
      const Fuel fuel = found == table.fuels.end() ? Fuel{} : found->second;
      t.fuel = true;
      t.ignition = thermal_[id].ignition;
      t.energy = fuel.mj_per_kg * 1e6 / kHeatUnitJ * block.density.value;
      t.hours = fuel.hours;
      t.leaves = palette_->find(fuel.leaves).value_or(world::kAir);
    }
    traits_.push_back(t);
  }
}

}  // namespace sim
