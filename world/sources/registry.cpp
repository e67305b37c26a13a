// The registry of sources: each file world/sources/NAME.cpp exposes `SourceKind NAME_source()`. This file and
// sampler.cpp are the only ones that are no source.
#include "world/sources/source.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <glm/matrix.hpp>

#include "world/base/text.h"
#include "world/meshes/placement.h"

namespace world {

#define SOURCE(name) SourceKind name##_source();
#include "world_sources.list.h"
#undef SOURCE

const std::vector<SourceKind>& source_kinds() {
  static const std::vector<SourceKind> all = {
#define SOURCE(name) name##_source(),
#include "world_sources.list.h"
#undef SOURCE
  };
  return all;
}

SourceInstance read_source(TomlTable& table, VoxelPos offset, const std::filesystem::path& folder) {
  constexpr double kBorder = kWorldBorder - 1;
  SourceInstance source;
  source.where = table.where();
  const bool has_kind = table.require("kind", source.kind);
  table.require("block", source.block);
  read_placement(table, offset, "source", source.placement.position, source.placement.transform);
  Sampling& sampling = source.sampling;
  table.read("voxel_size_m", sampling.voxel_size_m, {.min = 0, .max = 1e9, .open_min = true});
  table.read("supersampling", sampling.supersampling, {1, kMostSupersampling});
  table.read("coverage", sampling.coverage, {0, 1});
  std::array<int32_t, 3> min{}, max{};
  const bool low = table.read("min", std::span<int32_t>(min), {-kBorder, kBorder}),
             high = table.read("max", std::span<int32_t>(max), {-kBorder, kBorder});
  if (low != high) table.fail(low ? "min" : "max", "'min' and 'max' go together");
  if (low && high) {
    source.clip = VoxelBox{VoxelPos{min[0], min[1], min[2]} + offset, VoxelPos{max[0], max[1], max[2]} + offset};
    if (source.clip->empty()) table.fail("max", "'max' must not be below 'min'");
  }
  if (!has_kind) return source;
  const glm::dmat3 source_from_voxel = sampling.voxel_size_m * glm::inverse(source.placement.transform);
  const SourceContext context{folder, sampling,
                              std::min({glm::length(source_from_voxel[0]), glm::length(source_from_voxel[1]),
                                        glm::length(source_from_voxel[2])})};
  std::vector<std::string> names;
  for (const SourceKind& kind : source_kinds()) {
    names.push_back(kind.name);
    if (kind.name == source.kind) source.shape = kind.read(table, context);
  }
  if (std::find(names.begin(), names.end(), source.kind) == names.end()) {
    const std::string near = nearest_text(source.kind, names);
    table.fail("kind", fmt::format("there is no source \"{}\"{}; there are {}", source.kind,
                                   near.empty() ? "" : " (did you mean \"" + near + "\"?)", fmt::join(names, ", ")));
  }
  return source;
}

}  // namespace world
