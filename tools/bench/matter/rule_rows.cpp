#include "tools/bench/matter/rule_rows.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include <fmt/format.h>

#include "sim/matter/matter.h"
#include "world/base/random.h"

namespace tools {

namespace {

using world::BlockId;
using world::kAir;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}
BlockId named(const World& world, const char* name) { return world.palette->find(name).value(); }
void fill(World& world, const VoxelBox& box, BlockId block) {
  world::EditBatch batch;
  batch.fill(box, block);
  CHECK(world.store.apply(batch).ok());
}

/// A tray of 256 x 128 x 256 in which a quarter of the voxels are grains, of `kinds` by turns of a hash.
World strewn(const std::vector<const char*>& kinds) {
  World world(world::standard_blocks());
  std::vector<BlockId> ids;
  for (const char* kind : kinds) ids.push_back(named(world, kind));
  const BlockId wall = named(world, "granite");
  std::array<BlockId, world::kLeafVoxels> values;
  for (const world::RegionPos r : {world::RegionPos{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {1, 0, 1}}) {
    world::RegionBuilder region(r);
    for (int l = 0; l < world::kLeavesPerRegion; ++l) {
      const VoxelPos low = world::voxel_from_leaf(world::leaf_from_region(r) + world::leaf_offset_in_region(l));
      for (int i = 0; i < world::kLeafVoxels; ++i) {
        const VoxelPos v = low + world::offset_in_leaf(i);
        const bool rim = v.y == 0 || v.x == 0 || v.z == 0 || v.x == 255 || v.z == 255;
        const uint64_t h = world::random_bits(1, v.x, v.y, v.z);
        values[static_cast<size_t>(i)] = rim ? wall : (h & 3) == 0 ? ids[(h >> 8) % ids.size()] : kAir;
      }
      region.set_leaf(l, values);
    }
    world.store.adopt(std::move(region));
  }
  return world;
}

/// Voxels of the leaves that a rule looked at in a second, over `ticks` ticks after the pages are open.
double visited_per_s(World& world, int ticks) {
  sim::Matter matter(world, {});
  for (int i = 0; i < 3; ++i) matter.step();
  uint64_t leaves = 0;
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < ticks; ++i) leaves += matter.step().leaves_visited;
  return static_cast<double>(leaves) * world::kLeafVoxels / seconds_since(start);
}

/// The rule of grains as it is often written: bytes in a dense box, from one buffer to another, below and the four
/// sides in a fixed order. Voxels of the box in a second.
double dense_grains_per_s(int ticks) {
  constexpr int kX = 256, kY = 128, kZ = 256;
  const auto at = [](int x, int y, int z) {
    return (static_cast<size_t>(x) * kY + static_cast<size_t>(y)) * kZ + static_cast<size_t>(z);
  };
  std::vector<uint8_t> now(size_t{kX} * kY * kZ), next;
  for (int x = 0; x < kX; ++x)
    for (int y = 0; y < kY; ++y)
      for (int z = 0; z < kZ; ++z) {
        const bool rim = y == 0 || x == 0 || z == 0 || x == kX - 1 || z == kZ - 1 || y == kY - 1;
        now[at(x, y, z)] = rim ? 2 : (world::random_bits(1, x, y, z) & 3) == 0;
      }
  constexpr int kSteps[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  const auto start = std::chrono::steady_clock::now();
  for (int t = 0; t < ticks; ++t) {
    next = now;
    for (int x = 1; x < kX - 1; ++x)
      for (int y = 1; y < kY - 1; ++y)
        for (int z = 1; z < kZ - 1; ++z) {
          if (now[at(x, y, z)] != 1) continue;
          if (now[at(x, y - 1, z)] == 0) {
            if (next[at(x, y - 1, z)] == 0) next[at(x, y, z)] = 0, next[at(x, y - 1, z)] = 1;
            continue;
          }
          for (const auto& [dx, dz] : kSteps) {
            const size_t side = at(x + dx, y, z + dz);
            if (now[side] != 0 || now[at(x + dx, y - 1, z + dz)] != 0 || next[side] != 0) continue;
            next[at(x, y, z)] = 0, next[side] = 1;
            break;
          }
        }
    now.swap(next);
  }
  keep(now);
  return static_cast<double>(now.size()) * ticks / seconds_since(start);
}

Result<Prepared> prepare_grains(BenchContext& context, const std::vector<const char*>& kinds) {
  const int ticks = context.quick() ? 20 : 100;
  Prepared prepared;
  prepared.ours = {"bit planes of awake leaves", [=] {
                     World world = strewn(kinds);
                     return visited_per_s(world, ticks) * 1e-9;
                   }};
  prepared.rivals = {{"bytes in a dense box, one thread", [=] { return dense_grains_per_s(ticks / 10) * 1e-9; }}};
  return prepared;
}

/// A tank of 128 x 64 x 128, half of which is a wall of water.
Result<Prepared> prepare_liquid(BenchContext& context) {
  const int ticks = context.quick() ? 20 : 60;
  Prepared prepared;
  prepared.ours = {"amounts of awake leaves", [=] {
                     World world(world::standard_blocks());
                     fill(world, {{-8, -8, -8}, {135, 63, 135}}, named(world, "granite"));
                     fill(world, {{0, 0, 0}, {127, 63, 127}}, kAir);
                     fill(world, {{0, 0, 0}, {63, 50, 127}}, named(world, "water"));
                     return visited_per_s(world, ticks) * 1e-9;
                   }};
  return prepared;
}

/// us of a tick in which nothing is awake.
Result<Prepared> prepare_settled(BenchContext& context) {
  struct Settled {
    World world{world::standard_blocks()};
    std::unique_ptr<sim::Matter> matter;
  };
  const auto settled = context.shared<Settled>("matter/settled", [] {
    auto made = std::make_shared<Settled>();
    fill(made->world, {{0, 0, 0}, {255, 127, 255}}, named(made->world, "granite"));
    fill(made->world, {{10, 128, 10}, {200, 130, 200}}, named(made->world, "sand"));
    made->matter = std::make_unique<sim::Matter>(made->world, sim::MatterOptions{});
    for (int i = 0; i < 2000 && !made->matter->settled(); ++i) made->matter->step();
    return made;
  });
  constexpr int kTicks = 1000;
  Prepared prepared;
  prepared.ours = {"Matter::step", [=] {
                     const auto start = std::chrono::steady_clock::now();
                     uint64_t leaves = 0;
                     for (int i = 0; i < kTicks; ++i) leaves += settled->matter->step().leaves_visited;
                     return leaves == 0 ? seconds_since(start) / kTicks * 1e6 : std::nan("");
                   }};
  prepared.counters = [=] {
    return std::map<std::string, double>{
        {"leaves_visited", static_cast<double>(settled->matter->step().leaves_visited)},
        {"awake_leaves", static_cast<double>(settled->matter->awake_leaves())}};
  };
  return prepared;
}

/// A cube of rock with a pond of 32 x 32 on it, at rest.
struct Pond {
  World world{world::standard_blocks()};
  std::unique_ptr<sim::Matter> matter;
  explicit Pond(int side) {
    const BlockId rock = named(world, "granite");
    for (int x = 0; x * world::kRegionSize < side; ++x)
      for (int y = 0; y * world::kRegionSize < side; ++y)
        for (int z = 0; z * world::kRegionSize < side; ++z) {
          world::RegionBuilder region({x, y, z});
          for (int l = 0; l < world::kLeavesPerRegion; ++l) region.set_uniform(l, rock);
          world.store.adopt(std::move(region));
        }
    const int top = (side + world::kRegionSize - 1) / world::kRegionSize * world::kRegionSize;
    fill(world, {{30, top - 6, 30}, {61, top - 1, 61}}, kAir);
    fill(world, {{30, top - 6, 30}, {61, top - 4, 61}}, named(world, "water"));
    matter = std::make_unique<sim::Matter>(world, sim::MatterOptions{});
    for (int i = 0; i < 1000 && !matter->settled(); ++i) matter->step();
    bucket = {45, top - 1, 45};
  }
  VoxelPos bucket;
  /// Seconds of the ticks in which a bucket poured in comes to rest; 400 at most.
  double pour() {
    matter->flush();
    fill(world, {bucket, bucket}, named(world, "water"));
    const auto start = std::chrono::steady_clock::now();
    int ticks = 0;
    do matter->step();
    while (++ticks < 400 && !matter->settled());
    return seconds_since(start) / ticks;
  }
};

Result<Prepared> prepare_world_size(BenchContext& context) {
  const int large = context.quick() ? 512 : 1024;
  const auto small_pond = context.shared<Pond>("matter/pond", [] { return std::make_shared<Pond>(128); });
  const auto large_pond =
      context.shared<Pond>(fmt::format("matter/pond{}", large), [=] { return std::make_shared<Pond>(large); });
  Prepared prepared;
  prepared.ours = {"a tick in the large world, in ticks of the small one", [=] {
                     // By turns, so that what else the machine does hits both.
                     double of_small = 0, of_large = 0;
                     for (int i = 0; i < 5; ++i) of_small += small_pond->pour(), of_large += large_pond->pour();
                     return of_large / of_small;
                   }};
  return prepared;
}

}  // namespace

void add_rule_rows(Registry& registry) {
  registry.add({.name = "granular_one_kind",
                .what = "looks at awake voxels of 256x128x256 strewn with sand: the first 100 ticks",
                .unit = "G voxels/s",
                .timing = Timing::reported,
                .threads = 2,
                .repetitions = 5,
                .reach = Reach{5, "the aim; a prototype of bit planes: 14 to 46 on a core with AVX-512"},
                .prepare = [](BenchContext& c) { return prepare_grains(c, {"sand"}); }});
  registry.add({.name = "granular_mixed",
                .what = "the same of sand and gravel, voxel by voxel beside each other",
                .unit = "G voxels/s",
                .timing = Timing::reported,
                .threads = 2,
                .repetitions = 5,
                .reach = Reach{0.5, "the aim: ids move along with the bits"},
                .prepare = [](BenchContext& c) {
                  return prepare_grains(c, {"sand", "gravel"});
                }});
  registry.add({.name = "liquid",
                .what = "looks at awake voxels of a tank of 128x64x128 in which a wall of water breaks: 60 ticks",
                .unit = "G voxels/s",
                .timing = Timing::reported,
                .threads = 2,
                .repetitions = 5,
                .reach = Reach{0.5, "the aim; Luanti visits 1.6 M a second, Sandspiel in the plane 50 M"},
                .prepare = prepare_liquid});
  registry.add({.name = "settled_tick",
                .what = "a tick of a world of 8 M voxels in which nothing moves",
                .unit = "us",
                .better = Better::lower,
                .timing = Timing::reported,
                .repetitions = 5,
                .reach = Reach{10, "the aim: it visits no leaf"},
                .prepare = prepare_settled});
  registry.add({.name = "world_size",
                .what = "a bucket of water poured into a pond in a world of 10^9 voxels, and in one of 2 10^6",
                .unit = "times",
                .better = Better::lower,
                .timing = Timing::reported,
                .repetitions = 5,
                .reach = Reach{1.1, "the aim: what is far away costs nothing"},
                .prepare = prepare_world_size});
}

}  // namespace tools
