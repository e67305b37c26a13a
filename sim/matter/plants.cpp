#include "sim/matter/plants.h"

#include <algorithm>
#include <array>

namespace sim {

namespace {

constexpr std::array<TreeKind, 3> kTrees = {{{"oak_sapling", "oak_log", "oak_leaves", 4, 3},
                                             {"birch_sapling", "birch_log", "birch_leaves", 5, 3},
                                             {"spruce_sapling", "spruce_log", "spruce_needles", 7, 5, true}}};
constexpr std::array<StalkKind, 2> kStalks = {{{"reed", 3, true}, {"cactus", 3, false}}};
constexpr std::string_view kBears[] = {"dirt", "grass",    "dry_grass", "forest_floor", "moss",     "podzol", "mud",
                                       "sand", "red_sand", "wet_sand",  "farmland",     "mycelium", "gravel"};

template <class Names>
bool is_one_of(std::string_view name, const Names& names) {
  return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

}  // namespace

uint16_t plant_bits(const world::Block& block) {
  const std::string_view name = block.name;
  unsigned bits = 0;
  if (name == "air") bits |= plant::open;
  if (name == "dirt") bits |= plant::dirt;
  if (name == "grass") bits |= plant::grass;
  if (is_one_of(name, kBears)) bits |= plant::bears;
  if (name == "farmland") bits |= plant::farmland;
  if (name == "wheat") bits |= plant::wheat;
  if (name == "water") bits |= plant::water;
  if (name.ends_with("_leaves") || name.ends_with("_needles")) bits |= plant::leaves;
  if (name.ends_with("_log")) bits |= plant::log;
  if (name.ends_with("_sapling")) bits |= plant::sapling;
  for (const StalkKind& stalk : kStalks)
    if (name == stalk.name) bits |= plant::stalk;
  // Leaves stand in each other's half light.
  if (!block.opaque || (bits & (plant::open | plant::leaves))) bits |= plant::passes;
  return static_cast<uint16_t>(bits);
}

void PlantBlocks::follow(const world::BlockPalette& palette) {
  if (bits_.size() == palette.size()) return;
  while (bits_.size() < palette.size()) bits_.push_back(plant_bits(palette[static_cast<world::BlockId>(bits_.size())]));
  trees_.clear();
  stalks_.clear();
  const auto named = [&](std::string_view name) { return palette.find(name).value_or(world::kAir); };
  for (TreeKind tree : kTrees) {
    tree.sapling = named(tree.sapling_name), tree.log = named(tree.log_name), tree.leaves = named(tree.leaves_name);
    if (tree.sapling != world::kAir && tree.log != world::kAir && tree.leaves != world::kAir) trees_.push_back(tree);
  }
  for (StalkKind stalk : kStalks)
    if ((stalk.block = named(stalk.name)) != world::kAir) stalks_.push_back(stalk);
  grass_ = named("grass"), wheat_ = named("wheat");
}

const TreeKind* PlantBlocks::tree(world::BlockId sapling) const {
  for (const TreeKind& tree : trees_)
    if (tree.sapling == sapling) return &tree;
  return nullptr;
}

const StalkKind* PlantBlocks::stalk(world::BlockId block) const {
  for (const StalkKind& stalk : stalks_)
    if (stalk.block == block) return &stalk;
  return nullptr;
}

}  // namespace sim
