#include "tools/bench/matter/heat_rows.h"

#include <memory>

#include "tools/bench/matter/rule_bench.h"
#include "world/base/jobs.h"
#include "world/base/random.h"

namespace tools {

namespace {

using world::VoxelBox;
using world::VoxelPos;

VoxelBox box_of(BenchContext& context) {
  const int side = context.quick() ? 64 : 192;
  return {{0, 0, 0}, {side - 1, side - 1, side - 1}};
}

/// STREAM's triad on arrays that no cache holds; what it moves is counted as 8 bytes a voxel, a read and a write of
/// heat. source John McCalpin. Memory bandwidth and machine balance in current high performance computers. 1995
Contender triad() {
  struct Arrays {
    std::vector<float> a, b, c;
  };
  constexpr size_t kCount = 8u << 20;
  const auto arrays = std::make_shared<Arrays>();
  arrays->a.resize(kCount), arrays->b.resize(kCount, 1.0f), arrays->c.resize(kCount, 2.0f);
  return {"STREAM triad, 8 bytes a voxel", [arrays] {
            float *a = arrays->a.data(), *b = arrays->b.data(), *c = arrays->c.data();
            world::parallel_ranges(kCount, kCount / 64, [=](size_t begin, size_t end) {
              for (size_t i = begin; i < end; ++i) a[i] = b[i] + 3.0f * c[i];
            });
            keep(arrays->a);
            return static_cast<double>(kCount) * 12 / 8;
          }};
}

enum class Rock { one_kind, layers, by_chance };

/// Rock in which every voxel is as warm as chance says: of one kind, of layers, or of cubes of two kinds by chance, so
/// that no leaf is like another.
Result<Prepared> prepare_heat(BenchContext& context, Rock rock) {
  const VoxelBox box = box_of(context);
  const auto bench = std::make_shared<RuleBench>();
  bench->fill(box, "granite");
  for (int y = 0; rock == Rock::layers && y <= box.max.y; y += 4)
    bench->fill({{0, y, 0}, {box.max.x, y + 1, box.max.z}}, "copper_ore");
  if (rock == Rock::by_chance) {
    world::EditBatch batch;
    const world::BlockId ore = bench->world.palette->find("copper_ore").value();
    for (int x = 0; x <= box.max.x; ++x)
      for (int y = 0; y <= box.max.y; ++y)
        for (int z = 0; z <= box.max.z; ++z)
          if (world::random_bits(8, x / 2, y / 2, z / 2) % 2 == 0) batch.set({x, y, z}, ore);
    CHECK(bench->world.store.apply(batch).ok());
  }
  bench->options.knobs.heat_interval = 1;
  bench->start("heat", box);
  for (const sim::PageId p : bench->pages) {
    sim::Cells::Heats& heats = bench->cells->heats(p);
    for (size_t i = 0; i < heats.size(); ++i)
      heats[i] = static_cast<int32_t>(world::hash_combine(bench->cells->hash(p), i) >> 35);
    bench->cells->stir_heat(p);
  }
  bench->cells->spread();
  Prepared prepared;
  prepared.ours = {"leaves", [bench] { return bench->step(); }};
  prepared.rivals = {triad()};
  return prepared;
}

/// Every leaf awake, of a ground in which nothing finds a partner.
Result<Prepared> prepare_idle(BenchContext& context, const char* rule) {
  const VoxelBox box = box_of(context);
  const auto bench = std::make_shared<RuleBench>();
  bench->fill(box, "granite");
  for (int y = 0; y < box.max.y; y += 6) bench->fill({{0, y, 0}, {box.max.x, y + 2, box.max.z}}, "dirt");
  bench->start(rule, box);
  Prepared prepared;
  prepared.ours = {"leaf masks", [bench] {
                     bench->wake();
                     return bench->step();
                   }};
  return prepared;
}

/// Lava and water in a chequer of 8 m, which reacts at its faces until it is done: from the start again for each call.
Result<Prepared> prepare_reacting(BenchContext& context) {
  const VoxelBox box = {{0, 0, 0}, {context.quick() ? 47 : 95, 31, context.quick() ? 47 : 95}};
  const auto bench = std::make_shared<std::unique_ptr<RuleBench>>();
  Prepared prepared;
  prepared.ours = {
      "leaf masks",
      [bench] {
        double voxels = 0;
        for (int i = 0; i < 16; ++i) voxels += (*bench)->step();
        return voxels;
      },
      [bench, box] {
        *bench = std::make_unique<RuleBench>();
        (*bench)->fill(box, "water");
        for (int x = 0; x <= box.max.x; x += 16)
          for (int z = 0; z <= box.max.z; z += 16)
            (*bench)->fill({{x, 0, z}, {std::min(x + 7, box.max.x), box.max.y, std::min(z + 7, box.max.z)}}, "lava");
        (*bench)->start("reactions", box);
        (*bench)->wake();
      }};
  return prepared;
}

/// A wood of leaves that burns through, by either model; 256 ticks of it.
Result<Prepared> prepare_fire(BenchContext& context, sim::FireModel model) {
  const int side = context.quick() ? 48 : 96;
  const VoxelBox box = {{0, 0, 0}, {side - 1, 31, side - 1}};
  const auto bench = std::make_shared<std::unique_ptr<RuleBench>>();
  Prepared prepared;
  prepared.ours = {"leaf masks",
                   [bench] {
                     double voxels = 0;
                     for (int i = 0; i < 256; ++i) voxels += (*bench)->step();
                     return voxels;
                   },
                   [bench, box, model] {
                     *bench = std::make_unique<RuleBench>();
                     (*bench)->options.knobs.fire_model = model;
                     world::EditBatch batch;
                     const world::BlockId leaves = (*bench)->world.palette->find("oak_leaves").value();
                     const world::BlockId fire = (*bench)->world.palette->find("fire").value();
                     for (int x = 0; x <= box.max.x; ++x)
                       for (int y = 0; y <= box.max.y; ++y)
                         for (int z = 0; z <= box.max.z; ++z) {
                           const uint64_t r = world::random_bits(8, x, y, z);
                           if (r % 2 == 0) batch.set({x, y, z}, leaves);
                           if (r % 4001 == 1) batch.set({x, y, z}, fire);
                         }
                     CHECK((*bench)->world.store.apply(batch).ok());
                     (*bench)->start("fire", box);
                     (*bench)->wake();
                   }};
  return prepared;
}

}  // namespace

void add_heat_rows(Registry& registry) {
  const Reach bandwidth{0.5, "half of what the memory moves in the same run", true};
  const Reach updates{0.5, "the aim of this rule: 500 M voxels a second on two threads"};
  const auto add = [&](const char* name, const char* what, std::optional<Reach> reach,
                       std::function<Result<Prepared>(BenchContext&)> prepare) {
    registry.add({.name = name,
                  .what = what,
                  .unit = "G voxels/s",
                  .scale = 1e9,
                  .clock = Clock::wall,
                  .reach = std::move(reach),
                  .prepare = std::move(prepare)});
  };
  add("heat_one_block", "conducts in 192^3 voxels of granite, all awake, each as warm as chance says", bandwidth,
      [](BenchContext& c) { return prepare_heat(c, Rock::one_kind); });
  add("heat_two_blocks", "the same in layers of granite and ore of 2 m", std::nullopt,
      [](BenchContext& c) { return prepare_heat(c, Rock::layers); });
  add("heat_no_leaf_alike", "the same in cubes of granite and ore of 2 m by chance, so that no leaf is like another",
      std::nullopt, [](BenchContext& c) { return prepare_heat(c, Rock::by_chance); });
  add("reactions_idle", "looks for partners in 192^3 voxels that have none, all awake", updates,
      [](BenchContext& c) { return prepare_idle(c, "reactions"); });
  add("reactions_busy", "lava and water in a chequer of 8 m, the first 16 ticks, voxels of visited leaves",
      std::nullopt, prepare_reacting);
  add("fire_idle", "looks for what burns in 192^3 voxels that don't, all awake", updates,
      [](BenchContext& c) { return prepare_idle(c, "fire"); });
  add("fire_by_chance", "a wood of leaves burns, the first 256 ticks, voxels of visited leaves", std::nullopt,
      [](BenchContext& c) { return prepare_fire(c, sim::FireModel::chance); });
  add("fire_by_heat", "the same by heat", std::nullopt,
      [](BenchContext& c) { return prepare_fire(c, sim::FireModel::heat); });
}

}  // namespace tools
