/// Geometry by formula, by control points or by samples, made into voxels: [[source]] tables of a scene, and what
/// formats that hold surfaces or points use.
///
///   [[source]]
///   kind = "implicit"            one file a kind in world/sources/; each says its own keys at its head
///   block = "granite"            what it is made of; "air" carves
///   position, scale, rotate_deg, matrix    as of a mesh; the position is that of the source's origin
///   voxel_size_m = 1             metres of the source a voxel
///   supersampling = 1            points along each axis of a voxel, 1..16
///   coverage = 0.5               filled where this part of the points lies inside; 0: wherever the solid may touch
///   min = [x, y, z], max = [x, y, z]       voxels that it may fill; needed where the solid has no end
///
/// Sources are sampled in the order of the file, over what is there.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "world/base/toml_reader.h"
#include "world/sources/sampler.h"

namespace world {

/// What a kind may need beside its own keys.
struct SourceContext {
  std::filesystem::path folder;  // where files that a scene names lie
  Sampling sampling;
  double voxel_m = 1;  // the least length in the source's space that a voxel spans, by voxel size and transform
};

struct SourceKind {
  std::string name;
  std::string what;  // one line
  /// Reads the kind's own keys. What is wrong is noted in the table's document, and null returned.
  std::function<std::shared_ptr<const Shape>(TomlTable& table, const SourceContext& context)> read;
};

/// One a file of world/sources/, sorted by name.
const std::vector<SourceKind>& source_kinds();

/// A source of a scene, ready to be sampled.
struct SourceInstance {
  std::string kind;
  std::string block;
  std::shared_ptr<const Shape> shape;
  Placement placement;
  Sampling sampling;
  std::optional<VoxelBox> clip;
  std::string where;  // file:line:column of its table, for messages
};

/// `offset` is added to its positions. What is wrong is noted in the table's document.
SourceInstance read_source(TomlTable& table, VoxelPos offset, const std::filesystem::path& folder);

}  // namespace world
