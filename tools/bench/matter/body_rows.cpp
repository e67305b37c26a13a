#include "tools/bench/matter/body_rows.h"

#include <algorithm>
#include <memory>

#include "sim/bodies/particles.h"
#include "sim/bodies/player.h"
#include "sim/bodies/sweep.h"
#include "world/base/jobs.h"
#include "world/base/random.h"

namespace tools {

namespace {

using sim::Bodies;
using sim::BodyDescription;
using sim::Particles;
using sim::ParticleSettings;
using world::Vec3d;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

/// Rain over a whole world, as many drops and splashes at once as the limit allows.
struct Rain {
  Particles particles;
  ParticleSettings settings;
  VoxelBox sky;
  int kind;

  Rain(const World& world, const VoxelBox& over, size_t count)
      : particles(world.store, sim::particle_kinds(), count, 1), sky(over) {
    kind = *sim::find_particle_kind(sim::particle_kinds(), "rain");
    particles.set_origin({(sky.min.x + sky.max.x) / 2, (sky.min.y + sky.max.y) / 2, (sky.min.z + sky.max.z) / 2});
    settings.wind = {2, 0, 1};
    fill_up();
    for (int i = 0; i < 60; ++i) step(false);
    sky.min.y = sky.max.y - 4;
  }
  void fill_up() {
    particles.spawn_in(kind, sky, static_cast<int>(particles.limit() - particles.size()), {2, -6.5, 1}, 0.2, settings);
  }
  double step(bool plain) {
    settings.plain = plain;
    const double moved = static_cast<double>(particles.step(settings).moved);
    fill_up();
    return moved;
  }
};

Result<Prepared> prepare_particles(BenchContext& context, size_t count, bool terrain) {
  TRY(const World* valley, context.world("valley"));
  const size_t limit = context.quick() ? std::min<size_t>(count, 100'000) : count;
  struct Scene {
    World empty{world::standard_blocks()};
    std::unique_ptr<Rain> rain;
  };
  const auto scene = std::make_shared<Scene>();
  VoxelBox over = valley->store.bounds();
  over.min.y = (over.min.y + over.max.y) / 2;
  over.max.y += 40;
  scene->rain = std::make_unique<Rain>(terrain ? *valley : scene->empty, over, limit);
  const auto bytes = std::make_shared<std::vector<uint64_t>>(limit * 26 / 8);
  Prepared prepared;
  prepared.ours = {"SIMD", [=] { return scene->rain->step(false); }};
  prepared.rivals = {{"a plain loop", [=] { return scene->rain->step(true); }},
                     {"memory alone: their bytes read and written", [=] {
                        uint64_t* data = bytes->data();
                        world::parallel_ranges(bytes->size(), 1 << 15, [data](size_t begin, size_t end) {
                          for (size_t i = begin; i < end; ++i) data[i] += i;
                        });
                        keep(*data);
                        return static_cast<double>(limit);
                      }}};
  prepared.check = [=]() -> Status {
    // Both ways give the same bits.
    uint64_t hashes[2];
    for (const bool plain : {false, true}) {
      Rain rain(terrain ? *valley : scene->empty, over, 50'000);
      for (int i = 0; i < 120; ++i) rain.step(plain);
      hashes[plain] = rain.particles.content_hash();
    }
    if (hashes[0] != hashes[1]) return world::input_error("particles by SIMD and one by one differ");
    return {};
  };
  return prepared;
}

/// Debris on a slope of the valley: thrown up, falls, bounces, lies.
struct Debris {
  World world{world::standard_blocks()};
  std::unique_ptr<Bodies> bodies;
  sim::BodySettings settings;
  int ticks = 0;

  explicit Debris(int count) {
    world::EditBatch batch;
    const world::BlockId stone = *world.palette->find("stone");
    for (int x = 0; x < 128; ++x)
      for (int z = 0; z < 128; ++z) batch.fill({{x, -8, z}, {x, (x / 4 + z / 8) % 5, z}}, stone);
    CHECK(world.store.apply(batch).ok());
    bodies = std::make_unique<Bodies>(world.store);
    for (int i = 0; i < count; ++i) {
      BodyDescription d;
      const auto draw = [&](int j) { return world::uniform01_double(world::random_bits(5, i, j, 0)); };
      d.foot = world::WorldPoint::from(4 + 120 * draw(0), 8 + 10 * draw(1), 4 + 120 * draw(2));
      d.size = Vec3d(0.25 + 0.5 * draw(3)), d.restitution = 0.3;
      CHECK(bodies->add(d).ok());
    }
  }
  /// All are thrown again before they sleep.
  double step() {
    if (ticks++ % 60 == 0)
      for (const sim::Body& body : bodies->all()) {
        const uint64_t lot = world::random_bits(6, body.id, ticks, 0);
        bodies->set_velocity(body.id, {4 * world::uniform01_double(lot) - 2, 6, 2 - 4 * world::uniform01_double(~lot)});
      }
    return static_cast<double>(bodies->step(settings).awake);
  }
};

Result<Prepared> prepare_debris(BenchContext& context) {
  const auto debris = std::make_shared<Debris>(context.quick() ? 200 : 2000);
  Prepared prepared;
  prepared.ours = {"swept boxes", [=] {
                     double steps = 0;
                     for (int i = 0; i < 60; ++i) steps += debris->step();
                     return steps;
                   }};
  const auto alone = std::make_shared<Debris>(context.quick() ? 200 : 2000);
  prepared.rivals = {{"on one thread", [=] {
                        const world::ThreadLimit limit(1);
                        double steps = 0;
                        for (int i = 0; i < 60; ++i) steps += alone->step();
                        return steps;
                      }}};
  return prepared;
}

Result<Prepared> prepare_asleep(BenchContext& context) {
  const auto debris = std::make_shared<Debris>(context.quick() ? 200 : 2000);
  for (int i = 0; i < 1500; ++i) debris->bodies->step(debris->settings);
  Prepared prepared;
  prepared.ours = {"asleep", [=] {
                     keep(debris->bodies->step(debris->settings).awake);
                     return 0.0;
                   }};
  prepared.counters = [=] {
    return std::map<std::string, double>{{"awake", static_cast<double>(debris->bodies->step(debris->settings).awake)},
                                         {"hash", static_cast<double>(debris->bodies->content_hash() >> 12)}};
  };
  return prepared;
}

Result<Prepared> prepare_sweep(BenchContext& context, double way_m) {
  TRY(const World* valley, context.world("valley"));
  struct Scene {
    sim::BodyTerrain terrain;
    std::vector<sim::BodyBox> boxes;
    std::vector<sim::FixedVec3> ways;
  };
  const auto scene = std::make_shared<Scene>(Scene{sim::BodyTerrain(valley->store), {}, {}});
  scene->terrain.refresh();
  const VoxelBox all = valley->store.bounds();
  for (int i = 0; scene->boxes.size() < 2000; ++i) {
    const auto draw = [&](int j) { return world::uniform01_double(world::random_bits(8, i, j, 0)); };
    sim::BodyBox box;
    box.size = {sim::fixed_from(0.6), sim::fixed_from(1.8), sim::fixed_from(0.6)};
    for (int a = 0; a < 3; ++a) box.min[a] = sim::fixed_from(all.min[a] + draw(a) * (all.max[a] - all.min[a]));
    // Onto the ground below.
    if (scene->terrain.overlaps(box)) continue;
    const sim::FixedVec3 down{0, -sim::fixed_from(256), 0};
    scene->boxes.push_back(sim::moved(box, sim::sweep(box, down, scene->terrain).part_of(down)));
    scene->ways.push_back(sim::fixed_from(Vec3d(way_m * (2 * draw(4) - 1), 0, way_m * (2 * draw(5) - 1))));
  }
  Prepared prepared;
  prepared.ours = {"exact sweep", [=] {
                     int hits = 0;
                     for (size_t i = 0; i < scene->boxes.size(); ++i)
                       hits += sim::sweep(scene->boxes[i], scene->ways[i], scene->terrain).hit();
                     keep(hits);
                     return static_cast<double>(scene->boxes.size());
                   }};
  return prepared;
}

Result<Prepared> prepare_player(BenchContext&) {
  struct Scene {
    Debris debris{0};
    std::optional<sim::Player> player;
  };
  const auto scene = std::make_shared<Scene>();
  TRY(const sim::Player player, sim::Player::enter(*scene->debris.bodies, world::WorldPoint::from(64, 8, 64)));
  scene->player = player;
  Prepared prepared;
  prepared.ours = {"walks over steps of a metre, jumping", [=] {
                     for (int i = 0; i < 600; ++i) {
                       const double side = i < 300 ? 1 : -1;
                       scene->player->control(*scene->debris.bodies, {side, side / 2, i % 40 == 0}, {});
                       keep(scene->debris.bodies->step({}).contacts);
                     }
                     return 600.0;
                   }};
  return prepared;
}

}  // namespace

void add_body_rows(Registry& registry) {
  registry.add({.name = "particles_rain",
                .what = "a step of 1 M drops and splashes over the valley, with hits and what they spawn",
                .unit = "M steps/s",
                .scale = 1e6,
                .threads = 2,
                .clock = Clock::wall,
                .reach = Reach{200, "issue; bevy_enoki's 490 on 16 cores without voxels"},
                .prepare = [](BenchContext& context) { return prepare_particles(context, 1'000'000, true); }});
  registry.add({.name = "particles_open",
                .what = "the same in an empty world: motion alone",
                .unit = "M steps/s",
                .scale = 1e6,
                .threads = 2,
                .clock = Clock::wall,
                .prepare = [](BenchContext& context) { return prepare_particles(context, 1'000'000, false); }});
  registry.add({.name = "bodies_debris",
                .what = "steps of 2000 boxes thrown over ground of steps, with contacts among them",
                .unit = "M steps/s",
                .scale = 1e6,
                .threads = 2,
                .clock = Clock::wall,
                .prepare = prepare_debris});
  registry.add({.name = "bodies_asleep",
                .what = "a step of 2000 boxes that sleep",
                .unit = "us",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .scale = 1e-3,
                .threads = 1,
                .prepare = prepare_asleep});
  registry.add({.name = "sweep_walk",
                .what = "sweeps of a player's box on the valley's ground by up to 0.1 m",
                .unit = "M sweeps/s",
                .scale = 1e6,
                .threads = 1,
                .prepare = [](BenchContext& context) { return prepare_sweep(context, 0.1); }});
  registry.add({.name = "sweep_far",
                .what = "the same by up to 20 m",
                .unit = "M sweeps/s",
                .scale = 1e6,
                .threads = 1,
                .prepare = [](BenchContext& context) { return prepare_sweep(context, 20); }});
  registry.add({.name = "player",
                .what = "ticks of one player that walks and jumps",
                .unit = "M ticks/s",
                .scale = 1e6,
                .threads = 1,
                .prepare = prepare_player});
}

}  // namespace tools
