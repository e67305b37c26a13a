#include "sim/bodies/particle_kinds.h"

#include <algorithm>
#include <array>
#include <iostream>

#include "particle_files.h"
#include "world/base/embedded.h"
#include "world/base/toml_reader.h"

namespace sim {

namespace {

using world::TomlTable;

constexpr std::array<std::string_view, 2> kMeets = {"solid", "occupied"};
constexpr std::array<std::string_view, 3> kHits = {"die", "bounce", "slide"};
constexpr world::NumberRange kShare{.min = 0, .max = 1}, kLifetime{.min = 0, .max = 1000, .open_min = true};

ParticleKind read_kind(const std::string& name, TomlTable& table, std::string& spawns) {
  ParticleKind kind;
  kind.name = name;
  table.require("what", kind.what);
  table.read("gravity", kind.gravity, {.min = -10, .max = 10});
  table.read("drag_per_s", kind.drag_per_s, {.min = 0, .max = 1000});
  if (table.require("lifetime_s", std::span<double>(kind.lifetime_s), kLifetime) &&
      kind.lifetime_s[0] > kind.lifetime_s[1])
    table.fail("lifetime_s", "the second number must not be below the first");
  int choice = 0;
  if (table.read_choice("meets", choice, kMeets)) kind.meets = static_cast<ParticleMeets>(choice);
  choice = 0;
  if (table.read_choice("on_hit", choice, kHits)) kind.on_hit = static_cast<ParticleHit>(choice);
  table.read("restitution", kind.restitution, kShare);
  table.read("friction", kind.friction, kShare);
  if (table.read("spawns", spawns)) {
    kind.spawn_count = 1;
    if (kind.on_hit != ParticleHit::die) table.fail("spawns", "only particles that die by a hit spawn others");
  }
  table.read("spawn_count", kind.spawn_count, {.min = 0, .max = 16});
  table.read("spread_mps", kind.spread_mps, {.min = 0, .max = 100});
  table.read("priority", kind.priority, {.min = 0, .max = 100});
  table.read("size_m", kind.size_m, {.min = 0, .max = 10, .open_min = true});
  float colour[3] = {1, 1, 1};
  table.read("colour", std::span<float>(colour), kShare);
  kind.colour = {colour[0], colour[1], colour[2]};
  table.read("opacity", kind.opacity, kShare);
  float radiance[3] = {0, 0, 0};
  table.read("radiance", std::span<float>(radiance), {.min = 0, .max = 1e6});
  kind.radiance = {radiance[0], radiance[1], radiance[2]};
  return kind;
}

}  // namespace

world::Result<std::vector<ParticleKind>> read_particle_kinds(std::string_view text, const std::string& file_name) {
  TRY(world::TomlDocument document, world::TomlDocument::parse(text, file_name));
  TomlTable root = document.root();
  std::vector<ParticleKind> kinds;
  std::vector<std::string> spawns;
  auto tables = root.tables();
  for (auto& [name, table] : tables) kinds.push_back(read_kind(name, table, spawns.emplace_back()));
  for (size_t i = 0; i < kinds.size(); ++i) {
    if (spawns[i].empty()) continue;
    if (const auto spawned = find_particle_kind(kinds, spawns[i]))
      kinds[i].spawns = *spawned;
    else
      tables[i].second.fail("spawns", "there is no kind of particles '" + spawns[i] + "'");
  }
  if (kinds.size() > kMostParticleKinds)
    root.fail({}, "there are at most " + std::to_string(kMostParticleKinds) + " kinds of particles");
  TRY_STATUS(document.finish());
  return kinds;
}

std::span<const ParticleKind> particle_kinds() {
  static const std::vector<ParticleKind> kinds = [] {
    auto read = read_particle_kinds(world::particle_files[0].text, world::particle_files[0].name);
    if (!read.ok()) std::cerr << read.error().message << '\n';
    CHECK(read.ok());
    return std::move(*read);
  }();
  return kinds;
}

std::optional<int> find_particle_kind(std::span<const ParticleKind> kinds, std::string_view name) {
  for (size_t i = 0; i < kinds.size(); ++i)
    if (kinds[i].name == name) return static_cast<int>(i);
  return std::nullopt;
}

}  // namespace sim
