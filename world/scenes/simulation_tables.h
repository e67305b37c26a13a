/// Tables of a scene's file about what moves in it. Errors name file, line and column.
#pragma once

#include "world/base/toml_reader.h"
#include "world/scenes/simulation_request.h"

namespace world {

///   [[body]]  name = "crate", position = [x, y, z] of the middle of its bottom, size_m = [1, 1, 1],
///             velocity_mps = [0, 0, 0], density_kg_per_m3 = 1000, restitution = 0, friction = 0.5
BodyRequest read_body(TomlTable& table, VoxelPos offset);

///   [[particles]]  kind = "rain", min = [x, y, z], max = [x, y, z] of the box where they begin, per_s = 500,
///                  velocity_mps = [0, 0, 0], spread_mps = 0, brings = "water", mm_per_h = 50
ParticleSource read_particles(TomlTable& table, VoxelPos offset);

}  // namespace world
