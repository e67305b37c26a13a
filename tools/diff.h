/// Compares two pictures by error metrics, or two worlds voxel by voxel. The verb is in tools/verbs/diff.cpp.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "render/image/error_metrics.h"
#include "world/base/errors.h"
#include "world/world.h"

namespace tools {

// ---- pictures ----

/// One picture file, as it is: 8 bits from a PNG, radiance from an EXR; the other is empty.
struct PictureFile {
  render::Image8 shown;
  render::Image radiance;
  bool linear() const { return radiance.width > 0; }
  int width() const { return linear() ? radiance.width : shown.width; }
  int height() const { return linear() ? radiance.height : shown.height; }
};

/// By the first bytes: the name may end in anything. False where the file cannot be read.
bool is_picture_file(const std::filesystem::path& path);
world::Result<PictureFile> read_picture(const std::filesystem::path& path);

/// Two PNGs as codes, two EXRs as radiance; of a PNG and an EXR, the EXR is shown at 0 EV. Fails where the sizes
/// differ.
world::Result<render::ImageComparison> compare_picture_files(const std::filesystem::path& a,
                                                             const std::filesystem::path& b);
/// The keys of design section 7; NaN and infinity become null.
nlohmann::json metrics_json(const render::ErrorMetrics& metrics);

// ---- worlds ----

struct VoxelDifference {
  world::VoxelPos pos;
  std::string a, b;  // names of blocks
};

/// One layer beside the blocks: amounts of liquid and gas, heat, ...
struct LayerDifference {
  std::string layer;
  uint64_t differing = 0;  // voxels
  // The first, by leaf and voxel; nothing where a world has no value there.
  world::VoxelPos pos;
  std::optional<double> a, b;
};

struct WorldDifference {
  uint64_t differing = 0, only_a = 0, only_b = 0;  // voxels; only_a: air in b
  std::vector<VoxelDifference> first;              // by region, leaf and voxel in the store's order
  std::vector<LayerDifference> layers;             // those that differ
  bool equal() const { return differing == 0 && layers.empty(); }
};

/// Blocks are compared by name, so palettes may differ; layers by their values, wherever either has one.
WorldDifference compare_worlds(const world::World& a, const world::World& b, size_t list_at_most = 10);
nlohmann::json difference_json(const WorldDifference& difference);

// ---- what is asked of a comparison ----

/// `name` is a key of metrics_json. The option is --max-NAME or --min-NAME.
struct Threshold {
  std::string option, name;
  bool at_most = true;
  double limit = 0;
};
/// A sentence for each threshold that does not hold. Fails for NaN, except that equal pictures pass everything.
std::vector<std::string> failed_thresholds(const render::ErrorMetrics& metrics, const std::vector<Threshold>& asked);

}  // namespace tools
