/// Where a thing of a scene stands in the world: the keys that meshes and sources share.
#pragma once

#include <string_view>

#include <glm/mat3x3.hpp>

#include "world/base/toml_reader.h"
#include "world/space/world_point.h"

namespace world {

/// Reads
///   position = [x, y, z]       m; within the world's border
///   scale = 2 or [x, y, z]     each not 0; below 0 mirrors
///   rotate_deg = [x, y, z]     after scaling: about the x axis, then y, then z
///   matrix = [12 numbers]      instead of scale and rotate_deg: three rows of four, the fourth is added to position
/// `what` is the thing's kind, for messages; `offset` is added to the position.
void read_placement(TomlTable& table, VoxelPos offset, std::string_view what, WorldPoint& position,
                    glm::dmat3& transform);

}  // namespace world
