#include "sim/matter/matter.h"
#include "world/base/toml_reader.h"
#include "world/scenes/scene_reactions.h"

namespace sim {

namespace {

world::Result<std::vector<Reaction>> scene_reactions(const world::World& world) {
  const auto text = world.metadata.find(world::kReactionsKey);
  if (text == world.metadata.end()) return std::vector<Reaction>{};
  const auto file = world.metadata.find(world::kReactionsFileKey);
  TRY(world::TomlDocument document,
      world::TomlDocument::parse(text->second, file == world.metadata.end() ? "reactions" : file->second));
  world::TomlTable root = document.root();
  std::vector<Reaction> rows = read_reaction_rows(root);
  TRY_STATUS(document.finish());
  for (const Reaction& row : rows) {
    for (const Reaction& known : standard_reactions().rows)
      if (known.what == row.what)
        return world::input_error(row.origin + ": there is a reaction '" + row.what + "' already, in " + known.origin);
    TRY_STATUS(check_reaction(row, *world.palette));
  }
  return rows;
}

}  // namespace

world::Result<MatterOptions> matter_options(const world::World& world, world::Accuracy accuracy) {
  MatterOptions options;
  options.seed = world.simulation.seed;
  options.effects = world.simulation.effects;
  options.knobs = sim_knobs().preset(accuracy);
  for (const auto& [name, value] : world.simulation.knobs)
    if (const world::Status set = sim_knobs().set(options.knobs, name, value); !set.ok())
      return world::input_error("[simulation.knobs]: " + set.error().message);
  TRY(options.reactions, scene_reactions(world));
  options.rest_k = world.environment.temperature.value;
  return options;
}

}  // namespace sim
