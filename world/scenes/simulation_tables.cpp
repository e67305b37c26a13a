#include "world/scenes/simulation_tables.h"

namespace world {

namespace {

constexpr double kBorder = kWorldBorder - 1;
constexpr NumberRange kSpeed{.min = -1000, .max = 1000};  // m/s

bool read_vector(TomlTable& table, const char* key, Vec3d& out, NumberRange range) {
  double v[3];
  if (!table.read(key, std::span<double>(v), range)) return false;
  out = {v[0], v[1], v[2]};
  return true;
}

}  // namespace

BodyRequest read_body(TomlTable& table, VoxelPos offset) {
  BodyRequest body;
  table.read("name", body.name);
  double at[3];
  if (table.require("position", std::span<double>(at), NumberRange{-kBorder, kBorder})) {
    body.position = WorldPoint::from(at[0], at[1], at[2]);
    body.position.voxel = body.position.voxel + offset;
  }
  read_vector(table, "size_m", body.size, {.min = 1.0 / 256, .max = 64});
  read_vector(table, "velocity_mps", body.velocity, kSpeed);
  table.read("density_kg_per_m3", body.density_kg_per_m3, {.min = 1, .max = 1e5});
  table.read("restitution", body.restitution, {.min = 0, .max = 1});
  table.read("friction", body.friction, {.min = 0, .max = 10});
  return body;
}

ParticleSource read_particles(TomlTable& table, VoxelPos offset) {
  ParticleSource source;
  table.require("kind", source.kind);
  int32_t min[3] = {}, max[3] = {};
  const NumberRange inside{-kBorder, kBorder};
  if (table.require("min", std::span<int32_t>(min), inside) && table.require("max", std::span<int32_t>(max), inside)) {
    source.box = {VoxelPos{min[0], min[1], min[2]} + offset, VoxelPos{max[0], max[1], max[2]} + offset};
    if (source.box.empty()) table.fail("max", "no coordinate of max may lie below that of min");
  }
  table.read("per_s", source.per_s, {.min = 0, .max = 1e8});
  read_vector(table, "velocity_mps", source.velocity, kSpeed);
  table.read("spread_mps", source.spread_mps, {.min = 0, .max = 1000});
  table.read("brings", source.brings);
  table.read("mm_per_h", source.mm_per_h, {.min = 0, .max = 1e6});
  if (source.brings.empty() && source.mm_per_h > 0) table.fail("mm_per_h", "say of what: brings = \"water\"");
  return source;
}

}  // namespace world
