#include "world/scenes/fog.h"

#include <algorithm>
#include <cmath>

#include "world/store/copies.h"
#include "world/store/density_field.h"

namespace world {

namespace {

// Across a ball of the fog's volume: edges are soft, the inside is not seen through.
constexpr double kOpticalDepth = 12;
constexpr double kScattered = 0.99;  // of what the fog takes from a ray; of a cloud's drops nearly all

/// The mean of the densities above 0, and how many they are.
std::pair<double, double> mean_density(const DensityField& field) {
  double sum = 0, count = 0;
  field.for_each_leaf([&](const FieldLeaf& leaf) {
    for (const float v : leaf.values) sum += v, count += v > 0;
  });
  return {count > 0 ? sum / count : 0, count};
}

std::optional<BlockId> block_of_fog(const World& world) {
  const auto grid = world.metadata.find("vdb.grid");
  if (grid == world.metadata.end() || !world.store.find_layer(Layer::density)) return std::nullopt;
  return world.palette->find("vdb:" + grid->second);
}

}  // namespace

bool is_fog(const World& world) { return block_of_fog(world).has_value(); }

Status show_fog(World& world) {
  const std::optional<BlockId> block = block_of_fog(world);
  if (!block) return {};
  const bool is_there = std::any_of(world.media.begin(), world.media.end(),
                                    [](const Medium& m) { return m.kind == "density_grid" && m.field; });
  if (!is_there) {
    Medium fog;
    fog.name = "fog", fog.kind = "density_grid", fog.where = "the fog volume";
    const std::vector<std::string> kinds = medium_kinds();
    fog.kind_number = static_cast<int>(std::find(kinds.begin(), kinds.end(), fog.kind) - kinds.begin());
    std::vector<Medium> media{fog};
    TRY_STATUS(fill_density_grids(world.store.find_layer(Layer::density), media));
    const auto [mean, voxels] = mean_density(*media[0].field);
    if (!(mean > 0)) return {};
    const double diameter = std::cbrt(6 / 3.14159265358979323846 * voxels),
                 extinction = kOpticalDepth / (mean * diameter);
    const auto scattering = static_cast<float>(kScattered * extinction),
               absorption = static_cast<float>((1 - kScattered) * extinction);
    media[0].scattering = {scattering, scattering, scattering};
    media[0].absorption = {absorption, absorption, absorption};
    world.media.push_back(std::move(media[0]));
  }
  world.store = without_block(world.store, *block, *world.palette);
  return {};
}

}  // namespace world
