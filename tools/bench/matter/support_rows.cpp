#include "tools/bench/matter/support_rows.h"
#include "tools/bench/world_fill.h"

#include <cmath>

#include "sim/matter/matter.h"

namespace tools {

namespace {

using world::kAir;
using world::VoxelPos;
using world::World;

double support_ms(const sim::Matter& matter) {
  for (const sim::EffectReport& effect : matter.effects())
    if (effect.name == "support") return effect.ms;
  return std::nan("");
}
sim::MatterOptions support() {
  sim::MatterOptions options;
  options.effects = {"support"};
  return options;
}

/// A mountain of 256 x 128 x 256 m, hollowed by galleries, that is one structure.
struct Mountain {
  World world{world::standard_blocks()};
  std::unique_ptr<sim::Matter> matter;
  int next = 0;
  Mountain() {
    fill_block(world, {{0, 0, 0}, {255, 127, 255}}, "granite");
    for (int y = 8; y < 128; y += 16)
      for (int at = 8; at < 256; at += 16) {
        fill_block(world, {{0, y, at}, {255, y + 3, at + 3}}, "air");
        fill_block(world, {{at, y, 0}, {at + 3, y + 3, 255}}, "air");
      }
    matter = std::make_unique<sim::Matter>(world, support());
    for (int i = 0; i < 3; ++i) matter->step();
  }
  /// ms of support in one tick after one voxel was dug out, at places far from each other.
  double dig() {
    matter->flush();
    const uint64_t r = world::random_bits(1, next++, 0, 0);
    const VoxelPos v{static_cast<int>(r % 250), 20 + static_cast<int>((r >> 8) % 100),
                     static_cast<int>((r >> 16) % 250)};
    fill_block(world, {v, v}, "air");
    const double before = support_ms(*matter);
    matter->step();
    return support_ms(*matter) - before;
  }
};

Result<Prepared> prepare_dig(BenchContext& context) {
  const auto mountain = context.shared<Mountain>("matter/mountain", [] { return std::make_shared<Mountain>(); });
  constexpr int kDigs = 200;
  Prepared prepared;
  prepared.ours = {"flood of leaf masks", [=] {
                     double ms = 0;
                     for (int i = 0; i < kDigs; ++i) ms += mountain->dig();
                     return ms / kDigs * 1e3;
                   }};
  return prepared;
}

/// Voxels of a tower that go a voxel down, in a second.
Result<Prepared> prepare_fall(BenchContext&) {
  Prepared prepared;
  prepared.ours = {"in the grid", [] {
                     World world(world::standard_blocks());
                     fill_block(world, {{0, 0, 0}, {63, 1, 63}}, "granite");
                     fill_block(world, {{8, 100, 8}, {39, 131, 39}}, "brick_stone");
                     sim::Matter matter(world, support());
                     for (int i = 0; i < 3; ++i) matter.step();
                     matter.flush();
                     fill_block(world, {{8, 131, 8}, {8, 131, 8}}, "air");
                     matter.step();
                     const double before = support_ms(matter);
                     uint64_t voxels = 0;
                     for (int i = 0; i < 60; ++i) voxels += matter.step().voxels_changed;
                     return static_cast<double>(voxels) / (support_ms(matter) - before) * 1e-3;
                   }};
  return prepared;
}

}  // namespace

void add_support_rows(Registry& registry) {
  registry.add({.name = "support_edit",
                .what = "a voxel dug out of a mountain of 8 M voxels with galleries: what support takes in that tick",
                .unit = "us",
                .better = Better::lower,
                .timing = Timing::reported,
                .repetitions = 5,
                .reach = Reach{100, "the aim: the search ends at the ground or at support_reach"},
                .prepare = prepare_dig});
  registry.add({.name = "support_fall",
                .what = "a block of 32x32x32 falls 44 m: voxels times metres",
                .unit = "M/s",
                .timing = Timing::reported,
                .repetitions = 5,
                .prepare = prepare_fall});
}

}  // namespace tools
