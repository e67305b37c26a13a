/// Light as an automaton, beside the voxel-by-voxel queues of block games.
#include <chrono>
#include <cmath>

#include <fmt/format.h>

#include "sim/light/flood.h"
#include "sim/light/flux.h"
#include "tools/bench/benchmark.h"
#include "tools/bench/rivals/light_queue.h"
#include "world/base/jobs.h"

namespace tools {

namespace {

using sim::FloodLight;
using world::BlockId;
using world::EditBatch;
using world::kAir;
using world::LightModel;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The queue over a box of a world, with no more than what lies in it.
std::shared_ptr<LightQueue> make_queue(const World& world, const VoxelBox& box) {
  const sim::LightRules rules = sim::light_rules(*world.palette);
  // Blocks that treat light alike are one kind: a byte holds them.
  std::vector<sim::BlockOptics> kinds;
  std::vector<uint8_t> kind_of;
  for (const sim::BlockOptics& optics : rules.all_bands) {
    size_t k = 0;
    while (k < kinds.size() && kinds[k] != optics) ++k;
    if (k == kinds.size()) kinds.push_back(optics);
    kind_of.push_back(static_cast<uint8_t>(k));
  }
  auto queue = std::make_shared<LightQueue>(box, rules.sky_level, kinds);
  world::StoreReader reader(world.store);
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) queue->put({x, y, z}, kind_of[reader.get({x, y, z})]);
  return queue;
}

/// Voxels of the regions that hold blocks.
double region_voxels(const World& world) {
  return static_cast<double>(world.store.regions().size()) * std::pow(world::kRegionSize, 3);
}

/// Whether both say the same where neither sees beyond the box.
Status same_light(const FloodLight& light, const LightQueue& queue) {
  const VoxelBox box = queue.box();
  for (int x = box.min.x + 16; x <= box.max.x - 16; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z + 16; z <= box.max.z - 16; ++z) {
        const VoxelPos v{x, y, z};
        const int sky = light.volume().sky().get(v), lamps = light.volume().block().get(v);
        if (sky != queue.sky(v) || lamps != queue.lamps(v))
          return world::input_error(fmt::format("at ({}, {}, {}) sky {} and lamps {}, by the queue {} and {}", x, y, z,
                                                sky, lamps, queue.sky(v), queue.lamps(v)));
      }
  return {};
}

Result<Prepared> prepare_initial(BenchContext& context, LightModel model) {
  TRY(const World* valley, context.world("valley"));
  // Those that other parts of the program use as well.
  valley->store.masks(world::MaskKind::opaque);
  const auto light = std::make_shared<FloodLight>(valley->store, model);
  const VoxelBox whole = valley->store.bounds();
  const int side = context.quick() ? 128 : 256;
  const VoxelPos low{(whole.min.x + whole.max.x - side) / 2 & ~127, whole.min.y,
                     (whole.min.z + whole.max.z - side) / 2 & ~127};
  const VoxelBox box{low, {low.x + side - 1, whole.max.y, low.z + side - 1}};
  const double voxels = region_voxels(*valley), queue_voxels = static_cast<double>(box.volume());
  Prepared prepared;
  prepared.ours = {"leaf masks", [=] {
                     keep(light->compute().windows);
                     return voxels;
                   }};
  if (model == LightModel::flood4) {
    const auto queue = context.shared<LightQueue>("light/queue", [&] { return make_queue(*valley, box); });
    prepared.rivals = {{"scalar queue, one thread, a part of it", [=] {
                          queue->light_all();
                          return queue_voxels;
                        }}};
    prepared.check = [=] {
      light->compute();
      queue->light_all();
      return same_light(*light, *queue);
    };
  }
  prepared.counters = [=] {
    const sim::LightReport report = light->compute();
    return std::map<std::string, double>{
        {"leaves_computed", static_cast<double>(report.leaves_computed)},
        {"windows", static_cast<double>(report.windows)},
        {"bits_per_voxel", 8.0 * static_cast<double>(light->volume().bytes()) / voxels},
        {"hash", static_cast<double>(light->volume().content_hash() >> 12)}};
  };
  return prepared;
}

Result<Prepared> prepare_memory(BenchContext& context, LightModel model) {
  TRY(const World* valley, context.world("valley"));
  Prepared prepared;
  prepared.ours = {"light volume", [=] {
                     FloodLight light(valley->store, model);
                     light.compute();
                     return 8.0 * static_cast<double>(light.volume().bytes()) / region_voxels(*valley);
                   }};
  return prepared;
}

/// Something that is put into a world and taken out again; only the time of the light counts.
struct Toggled {
  World world{world::standard_blocks()};
  std::unique_ptr<FloodLight> light;
  std::shared_ptr<LightQueue> queue;  // null: too large for it
  VoxelBox what;
  BlockId on = kAir, off = kAir;
  uint8_t queue_on = 0, queue_off = 0;

  void start() {
    light = std::make_unique<FloodLight>(world.store, LightModel::flood4);
    light->compute();
  }
  void put(BlockId block) {
    EditBatch batch;
    batch.fill(what, block);
    CHECK(world.store.apply(batch).ok());
  }
  /// Seconds of light, of `on` and of `off`, in the middle of `count` turns.
  std::pair<double, double> turn(int count) {
    std::vector<double> ons, offs;
    for (int i = 0; i < count; ++i) {
      put(on);
      ons.push_back(seconds_of([&] { light->update(); }));
      put(off);
      offs.push_back(seconds_of([&] { light->update(); }));
    }
    return {median_of(ons), median_of(offs)};
  }
  std::pair<double, double> turn_queue(int count) {
    std::vector<double> ons, offs;
    for (int i = 0; i < count; ++i) {
      ons.push_back(seconds_of([&] { queue->set(what.min, queue_on); }));
      offs.push_back(seconds_of([&] { queue->set(what.min, queue_off); }));
    }
    return {median_of(ons), median_of(offs)};
  }
  static double median_of(std::vector<double>& times) {
    std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2), times.end());
    return times[times.size() / 2];
  }
  Status check() {
    for (const BlockId block : {on, off}) {
      put(block);
      light->update();
      FloodLight anew(world.store, LightModel::flood4);
      anew.compute();
      if (anew.volume().content_hash() != light->volume().content_hash())
        return world::input_error("an edit's light differs from all light anew");
    }
    return {};
  }
};

/// Ground with a lamp above it. `name` of the lamp's block.
std::shared_ptr<Toggled> lamp_in_the_open(const char* name, int height) {
  auto toggled = std::make_shared<Toggled>();
  World& world = toggled->world;
  EditBatch batch;
  batch.fill({{0, 0, 0}, {127, 15, 127}}, *world.palette->find("stone"));
  CHECK(world.store.apply(batch).ok());
  const VoxelPos v{61, 15 + height, 67};
  toggled->what = {v, v};
  toggled->on = *world.palette->find(name);
  toggled->start();
  const sim::LightRules& rules = toggled->light->rules();
  const VoxelBox box{v - VoxelPos{32, 32, 32}, v + VoxelPos{32, 32, 32}};
  toggled->queue = std::make_shared<LightQueue>(
      box, 15, std::vector<sim::BlockOptics>{rules.all_bands[kAir], {.loss = 0}, rules.all_bands[toggled->on]});
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= std::min(15, box.max.y); ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) toggled->queue->put({x, y, z}, 1);
  toggled->queue_on = 2;
  toggled->queue->light_all();
  return toggled;
}

Result<Prepared> prepare_lamp(BenchContext& context, const char* name, int height, bool place) {
  const int turns = context.quick() ? 50 : 400;
  const auto toggled =
      context.shared<Toggled>(fmt::format("light/{}/{}", name, height), [&] { return lamp_in_the_open(name, height); });
  Prepared prepared;
  prepared.ours = {"leaf masks", [=] {
                     const auto [on, off] = toggled->turn(turns);
                     return 1e6 * (place ? on : off);
                   }};
  prepared.rivals = {{"scalar queue", [=] {
                        const auto [on, off] = toggled->turn_queue(turns);
                        return 1e6 * (place ? on : off);
                      }}};
  prepared.check = [=] { return toggled->check(); };
  return prepared;
}

/// A hall of 64^3 in rock, whose roof is taken away and put back.
Result<Prepared> prepare_roof(BenchContext& context, bool open) {
  const auto toggled = context.shared<Toggled>("light/roof", [] {
    auto made = std::make_shared<Toggled>();
    World& world = made->world;
    const BlockId stone = *world.palette->find("stone");
    EditBatch batch;
    batch.fill({{0, 0, 0}, {191, 99, 191}}, stone);
    batch.fill({{60, 20, 60}, {123, 83, 123}}, kAir);
    CHECK(world.store.apply(batch).ok());
    made->what = {{60, 84, 60}, {123, 99, 123}};
    made->on = kAir, made->off = stone;
    made->start();
    return made;
  });
  const int turns = context.quick() ? 3 : 12;
  Prepared prepared;
  prepared.ours = {"leaf masks", [=] {
                     const auto [on, off] = toggled->turn(turns);
                     return 1e6 * (open ? on : off);
                   }};
  prepared.check = [=] { return toggled->check(); };
  return prepared;
}

/// The Cornell box in 64^3 voxels: walls found, the lamp's light by rays, reflection to the residual.
Result<Prepared> prepare_flux(BenchContext& context, bool solved_before) {
  TRY(const World* box, context.world("cornell_voxels"));
  const auto light = [=](const sim::Flux* before) {
    auto flux = std::make_unique<sim::Flux>(box->store, VoxelBox{{0, 0, 0}, {63, 63, 63}}, box->environment);
    flux->set_direct({}, sim::lamps_on_surfaces(box->store, flux->grid(), 4));
    if (before) flux->continue_from(*before);
    const auto report = flux->solve({32, 0.01f});
    CHECK(report.ok());
    return std::pair(std::move(flux), *report);
  };
  const auto before = std::make_shared<sim::Flux>(std::move(*light(nullptr).first));
  Prepared prepared;
  prepared.ours = {"32 directions, 4 points of the lamp", [=] {
                     keep(light(solved_before ? before.get() : nullptr).second.sweeps);
                     return 0.0;
                   }};
  prepared.counters = [=] {
    const sim::FluxReport report = light(solved_before ? before.get() : nullptr).second;
    return std::map<std::string, double>{{"sweeps", report.sweeps},
                                         {"surfaces", static_cast<double>(report.surfaces)},
                                         {"bytes", static_cast<double>(report.bytes)}};
  };
  prepared.check = [=]() -> Status {
    const sim::FluxReport report = light(nullptr).second;
    for (int b = 0; b < 3; ++b) {
      const sim::FluxBooks& k = report.books;
      if (!(std::abs(k.absorbed[b] + k.escaped[b] + k.stored[b] - k.emitted[b]) <= 1e-5 * k.emitted[b]))
        return world::input_error("energy is not kept");
    }
    if (!(report.residual <= 0.01)) return world::input_error("the residual was not reached");
    return {};
  };
  return prepared;
}

Result<Prepared> prepare_sky_colour(BenchContext& context) {
  const auto toggled = context.shared<Toggled>("light/lantern/20", [&] { return lamp_in_the_open("lantern", 20); });
  Prepared prepared;
  prepared.ours = {"levels say how much of the sky, not its colour", [=] {
                     toggled->light->update();
                     uint64_t leaves = 0;
                     constexpr int kTimes = 1000;
                     const double seconds = seconds_of([&] {
                       for (int i = 0; i < kTimes; ++i) {
                         toggled->world.environment.sky_zenith.r = static_cast<float>(i);
                         leaves += toggled->light->update().leaves_computed;
                       }
                     });
                     CHECK_EQ(leaves, 0u);
                     return 1e6 * seconds / kTimes;
                   }};
  return prepared;
}

}  // namespace

void add_suite_light(Registry& registry) {
  registry.add({.name = "valley_flood4",
                .what = "all light of the valley (1024x256x1024) anew, sky and lamps, store to store",
                .unit = "G voxels/s",
                .scale = 1e9,
                .reach = Reach{50, "the queue of block games, 50 times", true},
                .prepare = [](BenchContext& context) { return prepare_initial(context, LightModel::flood4); }});
  registry.add({.name = "valley_flood_rgb",
                .what = "the same in three bands",
                .unit = "G voxels/s",
                .scale = 1e9,
                .prepare = [](BenchContext& context) { return prepare_initial(context, LightModel::flood_rgb); }});
  registry.add({.name = "valley_bits",
                .what = "light of the valley, flood4, per voxel of its regions",
                .unit = "bit/voxel",
                .better = Better::lower,
                .timing = Timing::reported,
                .repetitions = 3,
                .reach = Reach{2, "issue"},
                .prepare = [](BenchContext& context) { return prepare_memory(context, LightModel::flood4); }});
  const auto lamp = [&](const char* row, const char* what, const char* block, int height, bool place,
                        std::optional<Reach> reach) {
    registry.add({.name = row,
                  .what = what,
                  .unit = "us",
                  .better = Better::lower,
                  .timing = Timing::reported,
                  .threads = 1,
                  .reach = reach,
                  .prepare = [=](BenchContext& context) { return prepare_lamp(context, block, height, place); }});
  };
  const Reach ten{10, "Luanti takes 300 us for it on such a machine (measured)"};
  lamp("lamp_placed", "light after a lantern of level 15 appears in the open, 20 m up", "lantern", 20, true, ten);
  lamp("lamp_removed", "light after it goes", "lantern", 20, false, ten);
  lamp("opaque_lamp_placed", "an opaque lamp 3 m up, which shades its column too", "lamp_white", 3, true, std::nullopt);
  lamp("stone_placed", "a stone put on the ground by day", "stone", 1, true, std::nullopt);
  lamp("stone_removed", "and taken away", "stone", 1, false, std::nullopt);
  const auto roof = [&](const char* row, const char* what, bool open) {
    registry.add({.name = row,
                  .what = what,
                  .unit = "us",
                  .better = Better::lower,
                  .timing = Timing::reported,
                  .reach = Reach{300, "a twentieth of a frame at 60 Hz"},
                  .prepare = [=](BenchContext& context) { return prepare_roof(context, open); }});
  };
  roof("roof_opened", "light after 16 m of rock over a dark hall of 64^3 go", true);
  roof("roof_closed", "light after they come back", false);
  registry.add({.name = "flux_cornell",
                .what = "flux in the Cornell box of 64^3 voxels from nothing to a residual of 1 %",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .reach = Reach{100, "a tenth of a second after an edit of the room"},
                .prepare = [](BenchContext& context) { return prepare_flux(context, false); }});
  registry.add({.name = "flux_cornell_again",
                .what = "the same after an edit elsewhere, from what was found before",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .prepare = [](BenchContext& context) { return prepare_flux(context, true); }});
  registry.add({.name = "sky_colour",
                .what = "light after the sky has changed its colour: no leaf is found anew",
                .unit = "us",
                .better = Better::lower,
                .timing = Timing::reported,
                .repetitions = 3,
                .reach = Reach{1, "the sky's levels are visibility"},
                .prepare = prepare_sky_colour});
}

}  // namespace tools
