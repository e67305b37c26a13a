#include "tests/tools/agreement/worlds.h"

#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "tests/render/raster/crowd.h"
#include "tests/render/raster/level_set_worlds.h"
#include "tests/render/raster/lit_worlds.h"
#include "tests/render/raster/see_through_worlds.h"
#include "tests/render/raster/shape_worlds.h"
#include "tests/render/raster/small_meshes.h"
#include "tests/support.h"
#include "tools/picture.h"
#include "world/scenes/scene.h"
#include "world/scenes/scene_reactions.h"
#include "world/store/density_field.h"

namespace tools {

namespace {

using render::camera_at;
using render::NamedCamera;
using world::VoxelPos;
using world::World;
using world::WorldPoint;

constexpr VoxelPos kFar{10'000'000, 0, -10'000'000};
constexpr double kPi = 3.14159265358979323846;

PicturedWorld seen(World w, const std::vector<NamedCamera>& cameras) {
  PicturedWorld made{std::move(w), {}, {}, nullptr, {}};
  made.world.cameras.clear();
  for (const auto& [name, camera] : cameras)
    made.world.cameras.push_back({name, camera.position, camera.forward, camera.vertical_fov * 180 / kPi});
  return made;
}
PicturedWorld seen(World w, const render::Camera& camera) { return seen(std::move(w), {{"one", camera}}); }

void fill(World& w, const world::VoxelBox& box, const char* block) {
  world::EditBatch batch;
  batch.fill(box, render::block(w, block));
  render::apply(w, batch);
}

/// A lamp that no picture shows, but for which the ray caster's tracer draws what its walk through the grid draws else.
World by_a_spark(World w) {
  world::Luminaire spark;
  spark.kind = "omni", spark.power = {1e-12f, 1e-12f, 1e-12f}, spark.position = WorldPoint::from(0, 500, 0);
  w.luminaires.push_back(spark);
  return w;
}

World without_glass(World w) {
  fill(w, {{-30, 10, 10}, {-30, 25, 40}}, "air");
  return w;
}

PicturedWorld room_by(const world::Luminaire& lamp) {
  World w = render::dark_room();
  // What lies at no place shines through the roof.
  if (lamp.kind == "directional" || lamp.at_infinity) fill(w, {{3, 6, 3}, {9, 6, 9}}, "air");
  w.luminaires = {lamp};
  return seen(std::move(w), render::in_the_room());
}
PicturedWorld room_by(const char* kind) {
  for (const world::Luminaire& lamp : render::one_of_each_kind())
    if (lamp.kind == kind && !lamp.at_infinity && lamp.shadows && !lamp.uniform_area) return room_by(lamp);
  CHECK(false);
  return room_by(world::Luminaire{});
}

PicturedWorld hills_under(world::Luminaire sky) {
  World w = render::hills();
  w.environment = render::dark_room().environment;
  w.luminaires = {std::move(sky)};
  return seen(std::move(w), render::hill_cameras());
}
world::Luminaire even_sky() {
  world::Luminaire sky = render::luminaire("hemisphere");
  sky.power = {}, sky.radiance = {20, 30, 50}, sky.axis = {0, 1, 0}, sky.up = {0, 0, 1};
  return sky;
}

PicturedWorld hills_in(std::vector<world::Medium> media) {
  World w = without_glass(render::hills());
  w.media = std::move(media);
  std::vector<NamedCamera> cameras = render::hill_cameras();
  cameras.push_back({"level", camera_at({}, {-60.2, 24.5, -3.4}, {1, 0, 0})});
  return seen(std::move(w), cameras);
}

/// Between the tops of the hills and what stands on them: of their cameras two are above, two within, one below.
World low_clouds(World w, float height = 18, float thickness = 24) {
  world::Clouds& clouds = w.environment.clouds;
  clouds.cover = 0.55f, clouds.height = height, clouds.thickness = thickness, clouds.size = 2.5f * thickness;
  clouds.extinction = 0.06f;
  return w;
}

PicturedWorld panes_in_fog(world::Vec3f half_extent) {
  World w = render::panes(4, {"glass_red", "glass", "lace"});
  w.media = {render::fog_box(half_extent)};
  return seen(std::move(w), camera_at({}, {3.2, 2.3, 4.5}, {-0.2, -0.1, -1}));
}

PicturedWorld room_with_meshes(const char* kind) {
  World w = render::dark_room();
  fill(w, {{2, 0, 8}, {2, 2, 9}}, "air");
  world::MeshInstance round = render::instance(w, render::ball(1.2, 40), "gold_block", {}, {7.2, 1.2, 6.1});
  round.smooth = true;
  w.meshes = {round, render::instance(w, render::sheet(1), "brick_red", {}, {3.4, 3.1, 8.2},
                                      glm::dmat3({1, 0.3, 0}, {0, 1, 0}, {0, 0.5, 1}))};
  w.luminaires = {render::luminaire(kind)};
  return seen(std::move(w), render::in_the_room());
}

/// Above a pool of mercury, or behind a pane of glass.
PicturedWorld meshes_by(bool pool) {
  World w(world::standard_blocks());
  fill(w, {{-20, -1, -20}, {20, -1, 20}}, "plaster");
  if (pool)
    fill(w, {{-8, -1, -8}, {8, -1, 8}}, "mercury");
  else
    fill(w, {{-9, 0, 4}, {9, 8, 4}}, "glass");
  world::MeshInstance round = render::instance(w, render::ball(2, 32), "brick_red", {}, {1.3, 3.4, -2.7});
  round.smooth = true;
  w.meshes = {round, render::instance(w, render::ball(1.5, 10), "marble", {}, {-3.2, 2.6, 0.4})};
  return seen(std::move(w), camera_at({}, {-3.3, 4.2, 12.4}, {0.1, -0.15, -1}));
}

PicturedWorld at_a_waters_edge() {
  World w(world::standard_blocks());
  fill(w, {{-32, -8, -32}, {31, -1, 31}}, "sand");
  fill(w, {{-30, -6, -30}, {29, -1, 29}}, "water");
  fill(w, {{4, -4, 4}, {6, 4, 6}}, "glass");
  std::vector<NamedCamera> cameras;
  for (const double gap : {0.3, 1e-3, 1e-7, 0.0}) {
    const auto add = [&](const char* what, world::Vec3d at, world::Vec3d along) {
      cameras.push_back({fmt::format("{} {}", what, gap), camera_at({}, at, along, 90)});
    };
    add("below the surface by", {0.5, -gap, 0.5}, {1, 0.3, 0.2});
    add("above it by", {0.5, gap, 0.5}, {1, -0.3, 0.2});
    add("in water before glass by", {4 - gap, -2.5, 5.5}, {1, 0.1, 0.2});
    add("within glass by", {4 + gap, 2.5, 5.5}, {-1, 0.1, 0.2});
  }
  return seen(std::move(w), cameras);
}

/// Panes that stand on water and in it: faces of both in one plane, and edges where planes of several axes meet.
PicturedWorld glass_in_water() {
  World w(world::standard_blocks());
  fill(w, {{-16, -4, -30}, {15, -1, -3}}, "water");
  for (int x = -14; x < 14; x += 3) fill(w, {{x, -3, -20}, {x + 1, 2 + (x & 3), -10}}, "glass_yellow");
  return seen(std::move(w), camera_at({}, {0, 3, 2}, {0, -0.3, -1}));
}

PicturedWorld rooms_wall() {
  std::vector<NamedCamera> cameras;
  for (const double gap : {1e-2, 1e-5, 1e-9, 0.0})
    cameras.push_back({fmt::format("before it by {}", gap), camera_at({}, {6.5, 2.5, gap}, {1, -0.1, 0.2}, 90)});
  cameras.push_back({"a hair below 12", camera_at({}, {6.5, 2.5, std::nextafter(12.0, 0.0)}, {1, 0, 0.2}, 90)});
  return seen(render::room(), cameras);
}

PicturedWorld crowd_over_hills() {
  PicturedWorld made = seen(render::hills(), render::hill_cameras());
  render::Crowd crowd;
  made.particles = std::move(crowd.particles), made.bodies = std::move(crowd.bodies);
  return made;
}

PicturedWorld with_bodies(World w, const std::vector<NamedCamera>& cameras,
                          const std::vector<render::BodyRecord>& bodies = render::kBodies) {
  PicturedWorld made = seen(std::move(w), cameras);
  made.bodies = bodies;
  return made;
}
World mirror_with_shapes() {
  World w = render::mirror();
  render::set_rows(w, {render::kBeforeTheMirror});
  return w;
}
World pool_with_shapes() {
  World w = render::pool();
  render::set_rows(w, {render::kBeyondThePool});
  return w;
}
/// Around a shape under water there is air. What its sides mirror is the sky, by the tracer what is there: this water
/// bends rays and mirrors little.
World shapes_under_water() {
  World w = render::ground();
  world::Block thin = (*w.palette)[render::block(w, "water")];
  thin.name = "thin_water", thin.index_of_refraction = 1.005f;
  CHECK(w.palette->add(thin).ok());
  render::fill_pool(w, "thin_water");
  render::set_rows(w, {render::kUnderWater});
  return w;
}

/// Two balls whose density falls from 1 in their middles, as the world's.
world::FloatLayer& set_balls(World& w) {
  world::FloatLayer& density = w.store.make_layer(world::Layer::density);
  for (int x = -16; x < 16; ++x)
    for (int y = -16; y < 16; ++y)
      for (int z = -16; z < 16; ++z) {
        const world::Vec3d p = world::Vec3d(x, y, z) + 0.5;
        const double d =
            std::max(1 - glm::length(p - world::Vec3d(-5, 0, 0)) / 9, 1 - glm::length(p - world::Vec3d(6, 4, 2)) / 7);
        if (d > 0) density.set({x, y, z}, static_cast<float>(d));
      }
  return density;
}

/// Of smoke.
PicturedWorld smoke() {
  World w(world::standard_blocks());
  fill(w, {{-40, -20, -40}, {40, -18, 40}}, "plaster");
  world::FloatLayer& density = set_balls(w);
  world::Medium grid = render::medium("density_grid");
  grid.position = WorldPoint::from(0, 0, 0);
  grid.scattering = {0.5f, 0.45f, 0.4f}, grid.absorption = {0.1f, 0.12f, 0.2f}, grid.emission = {20, 22, 26};
  w.media = {grid};
  CHECK(world::fill_density_grids(&density, w.media).ok());
  return seen(std::move(w), camera_at({}, {26.2, 12.1, 30.7}, {-0.8, -0.4, -1}, 50));
}

/// Of stone, as far as they reach.
PicturedWorld solid_balls() {
  World w(world::standard_blocks());
  const world::FloatLayer& density = set_balls(w);
  world::EditBatch batch;
  for (int x = -16; x < 16; ++x)
    for (int y = -16; y < 16; ++y)
      for (int z = -16; z < 16; ++z)
        if (density.get({x, y, z}) > 0) batch.set({x, y, z}, render::block(w, "granite"));
  render::apply(w, batch);
  return seen(std::move(w), camera_at({}, {26.2, 12.1, 30.7}, {-0.8, -0.4, -1}, 50));
}

PicturedWorld gloss_in_a_room() {
  World w = render::dark_room();
  fill(w, {{0, -1, 0}, {11, -1, 11}}, "gold_block");
  fill(w, {{7, 0, 3}, {8, 2, 4}}, "obsidian");
  w.luminaires = {render::luminaire("omni"), render::luminaire("rectangle")};
  w.luminaires[0].position = WorldPoint::from(4.4, 3.2, 9.3);  // the ray caster's panels hide what lies on them
  return seen(std::move(w), render::in_the_room());
}

PicturedWorld many_lamps() {
  World w(world::standard_blocks());
  fill(w, {{-40, -1, -40}, {40, -1, 40}}, "plaster");
  for (int i = 0; i < 6; ++i) fill(w, {{-30 + 11 * i, 0, -12}, {-28 + 11 * i, 5, -9}}, "brick_red");
  w.environment = render::dark_room().environment;
  for (int i = 0; i < 60; ++i) {
    world::Luminaire lamp = render::luminaire(i % 2 ? "omni" : "sphere");
    const uint64_t h = world::mix64(static_cast<uint64_t>(i) + 9);
    const double x = static_cast<double>(h % 700) / 10 - 35, z = static_cast<double>(h / 700 % 700) / 10 - 35;
    lamp.position = WorldPoint::from(x, 3.2 + static_cast<double>(i % 5), z);
    lamp.radius = 0.3f, lamp.power = {400, 300, 250};
    w.luminaires.push_back(lamp);
  }
  return seen(std::move(w), camera_at({}, {0.3, 14.2, 34.1}, {0.02, -0.45, -1}));
}

World low_sun(World w) {
  w.environment.sun_direction = glm::normalize(world::Vec3d(0.1, 0.12, -1));
  return w;
}

using Maker = std::function<PicturedWorld()>;

const std::map<std::string, Maker>& makers() {
  static const std::map<std::string, Maker> all = [] {
    std::map<std::string, Maker> m;
    const auto above = [](VoxelPos offset = {}) {
      std::vector<NamedCamera> cameras = render::hill_cameras();
      cameras.push_back({"above", camera_at({}, {-45.3, 41.7, -48.2}, {0.7, -0.5, 0.6})});
      cameras.push_back({"inside stone", camera_at({}, {10.5, 2.5, 20.5}, {0.3, 0.2, -1})});
      cameras.push_back({"inside glass", camera_at({}, {-29.5, 20.5, 20.5}, {1, -0.3, -0.2})});
      return seen(render::hills(offset), cameras);
    };
    m["hills"] = [above] { return above(); };
    m["hills, off by (0, 3, 1)"] = [above] { return above({0, 3, 1}); };
    m["hills, 10,000 km out"] = [] { return seen(render::hills(kFar), render::hill_cameras(kFar)); };
    m["hills, low sun"] = [] { return seen(low_sun(render::hills()), render::hill_cameras()); };
    m["dust"] = [] {
      return seen(render::dust(), {{"inside", camera_at({}, {0.2, 0.4, 0.3}, {0.5, 0.3, -0.8})},
                                   {"outside", camera_at({}, {90.2, 60.4, 100.3}, {-0.8, -0.5, -0.9})}});
    };
    m["a room's wall"] = rooms_wall;
    m["hills of gold"] = [] {
      World w = render::hills();
      fill(w, {{-64, 1, -64}, {63, 12, 63}}, "gold_block");
      return seen(std::move(w), render::hill_cameras());
    };
    m["hills of stone"] = [] {
      World w = without_glass(render::hills());
      fill(w, {{-64, 1, -64}, {63, 8, 63}}, "stone");
      return seen(std::move(w), render::hill_cameras());
    };

    for (const char* kind :
         {"omni", "spot", "gobo", "unified_point", "directional", "mesh", "rectangle", "disk", "sphere"})
      m[std::string("a room, ") + kind] = [kind] { return room_by(kind); };
    for (const world::Luminaire& lamp : render::one_of_each_kind()) {
      if (lamp.at_infinity) m["a room, unified_point at infinity"] = [lamp] { return room_by(lamp); };
      if (lamp.uniform_area) m["a room, rectangle by area"] = [lamp] { return room_by(lamp); };
      if (!lamp.shadows) m["a room, sphere without shadows or gloss"] = [lamp] { return room_by(lamp); };
    }
    m["a room of gold, two lamps"] = gloss_in_a_room;
    m["a yard of sixty lamps"] = many_lamps;
    m["hills under a hemisphere"] = [] { return hills_under(even_sky()); };
    m["hills under an image"] = [] {
      world::Luminaire sky = even_sky();
      sky.whole_sphere = true, sky.image = "sky", sky.light_image = render::picture_of_light();
      sky.radiance = {15, 15, 15};
      return hills_under(sky);
    };

    for (const char* kind : {"homogeneous", "height_fog", "box_fog", "ellipsoid_fog", "halfspace_fog"})
      m[std::string("hills in ") + kind] = [kind] { return hills_in({render::medium(kind)}); };
    m["hills in three fogs"] = [] {
      return hills_in({render::medium("box_fog"), render::medium("ellipsoid_fog"), render::medium("height_fog")});
    };
    m["hills among clouds"] = [] { return seen(low_clouds(render::hills()), render::hill_cameras()); };
    m["hills among clouds by the tracer"] = [] {
      return seen(low_clouds(by_a_spark(render::hills())), render::hill_cameras());
    };
    m["hills among clouds in height_fog"] = [] {
      PicturedWorld made = hills_in({render::medium("height_fog")});
      made.world = low_clouds(std::move(made.world));
      return made;
    };
    m["a crowd among clouds"] = [] {
      PicturedWorld made = crowd_over_hills();
      made.world = low_clouds(std::move(made.world));
      return made;
    };
    m["smoke"] = smoke;
    m["two balls of density"] = solid_balls;

    m["a garden of all shapes"] = [] { return seen(render::garden(), render::garden_cameras()); };
    m["a garden by the tracer"] = [] { return seen(by_a_spark(render::garden()), render::garden_cameras()); };
    m["a mirror, shapes and bodies"] = [] { return with_bodies(mirror_with_shapes(), render::kMirrorViews); };
    m["a pool, shapes and bodies"] = [] { return with_bodies(pool_with_shapes(), render::kPoolViews); };
    m["shapes and bodies under thin water"] = [] { return with_bodies(shapes_under_water(), render::kPoolViews); };

    m["panes by two lamps"] = [] {
      World w = render::panes(6, {"lace", "glass", "glass_red"});
      w.luminaires = {render::lamp_at(WorldPoint::from(1.5, 3.5, -1.2), 9000),
                      render::lamp_at(WorldPoint::from(-3, 2, -15.5), 20000)};
      return seen(std::move(w), camera_at({}, {3.2, 2.3, 4.5}, {-0.2, -0.1, -1}));
    };
    m["panes in fog"] = [] { return panes_in_fog({30, 30, 30}); };
    m["panes, some in fog"] = [] { return panes_in_fog({30, 30, 3}); };
    m["panes around fog"] = [] { return panes_in_fog({2, 1.5f, 6}); };
    m["a hundred panes"] = [] {
      return seen(render::panes(100, {"glass_white", "glass_pink", "ice"}),
                  camera_at({}, {0.5, 0.5, 0.5}, {0.01, 0.02, -1}, 30));
    };
    m["glass in water"] = glass_in_water;
    m["a water's edge"] = at_a_waters_edge;
    m["a hall under coloured glass"] = [] { return seen(render::window_hall(), render::hall_cameras()); };
    m["the hall in dust"] = [] {
      World w = render::window_hall();
      world::Medium dust = render::fog_box({40, 20, 40});
      dust.emission = {}, dust.absorption = {}, dust.scattering = {0.015f, 0.015f, 0.014f};
      w.media = {dust};
      return seen(std::move(w), render::hall_cameras());
    };
    m["the hall by the tracer"] = [] { return seen(by_a_spark(render::window_hall()), render::hall_cameras()); };
    m["a basin of films, slopes and falls"] = [] { return seen(render::spill(), render::spill_cameras()); };
    m["the basin by a lamp"] = [] {
      World w = render::spill();
      world::Luminaire lamp = render::lamp_at(WorldPoint::from(9.5, 6.2, 9.5), 900);
      lamp.kind = "sphere", lamp.radius = 0.3f;
      w.luminaires = {lamp};
      return seen(std::move(w), render::spill_cameras());
    };
    m["the basin, 10,000 km out"] = [] { return seen(render::spill(kFar), render::spill_cameras(kFar)); };

    m["meshes of each kind over hills"] = [] {
      World w = render::dry_hills();
      w.meshes = render::meshes_of_each_kind(w);
      return seen(std::move(w), {{"over the hills", render::over_the_hills()},
                                 {"from behind", camera_at({}, {30.2, 34.1, -14.6}, {-0.8, -0.25, 0.9})}});
    };
    m["the meshes, 10,000 km out"] = [] {
      World w = render::dry_hills(kFar);
      w.meshes = render::meshes_of_each_kind(w, kFar);
      return seen(std::move(w), {{"over the hills", render::over_the_hills(kFar)}});
    };
    m["a sheet before the eye"] = [] {
      World w = render::dry_hills();
      w.meshes = {render::instance(w, render::sheet(4), "brick_red", {}, {2.5, 40.0, 20.5},
                                   glm::dmat3({1, 0, 0}, {0, 0, 1}, {0, -1, 0}))};
      std::vector<NamedCamera> cameras;
      for (const double gap : {0.3, 0.02, 0.003})
        cameras.push_back({fmt::format("by {} m", gap), camera_at({}, {2.5, 40.2, 20.5 + gap}, {0.3, 0.1, -1}, 80)});
      return seen(std::move(w), cameras);
    };
    m["meshes by an omni"] = [] { return room_with_meshes("omni"); };
    m["meshes by a rectangle"] = [] { return room_with_meshes("rectangle"); };
    m["meshes over mercury"] = [] { return meshes_by(true); };
    m["meshes behind glass"] = [] { return meshes_by(false); };
    m["rings of a level set"] = [] { return seen(render::rings(false), render::at_rings()); };
    m["rings of a level set, twice as fine"] = [] {
      return seen(render::rings(false, {}, 2), render::at_rings({}, 2));
    };

    m["a crowd over hills"] = crowd_over_hills;
    m["bodies in water and behind glass"] = [] {
      return with_bodies(render::pond(), render::pond_cameras(), render::kBodiesByThePond);
    };
    m["bodies by the tracer"] = [] {
      return with_bodies(by_a_spark(render::pond()), render::pond_cameras(), render::kBodiesByThePond);
    };
    m["bodies and clouds by the pond"] = [] {
      return with_bodies(low_clouds(render::pond(), -1, 9), render::pond_cameras(), render::kBodiesByThePond);
    };
    m["bodies and clouds by the tracer"] = [] {
      return with_bodies(low_clouds(by_a_spark(render::pond()), -1, 9), render::pond_cameras(),
                         render::kBodiesByThePond);
    };
    return m;
  }();
  return all;
}

/// A mesh of a file over the hills, as a world's name says it: "hills with FILE at SCALE".
world::Result<std::optional<PicturedWorld>> hills_with_file(const std::string& file, double scale) {
  const auto path = world::shared_data(file);
  if (!path) return std::optional<PicturedWorld>();
  world::MeshReport report;
  TRY(world::TriangleMesh mesh, world::read_mesh_file(*path, report));
  World w = render::dry_hills();
  w.meshes = {render::instance(
      w, std::make_shared<const world::TriangleMesh>(std::move(mesh)), "marble", {},
      file.find("smallbox") == std::string::npos ? world::Vec3d(0.4, 24.3, 20.2) : world::Vec3d(-8.4, 24.3, 12.2),
      glm::dmat3(scale))};
  return std::optional(seen(std::move(w), camera_at({}, {3.3, 34.2, 38.4}, {-0.1, -0.4, -1})));
}

}  // namespace

render::Inhabitants PicturedWorld::inhabitants(const WorldPoint& eye) {
  if (!matter) return {{}, particles, bodies};
  records.take(*matter, eye.voxel);
  return records.view();
}

world::Result<std::optional<PicturedWorld>> pictured_world(const std::string& name, int ticks) {
  if (const auto maker = makers().find(name); maker != makers().end()) return std::optional(maker->second());
  constexpr std::string_view kWith = "hills with ", kAt = " at ";
  if (name.starts_with(kWith)) {
    const size_t at = name.find(kAt);
    return hills_with_file(name.substr(kWith.size(), at - kWith.size()), std::stod(name.substr(at + kAt.size())));
  }
  std::string from = name;
  if (name.find('/') != std::string::npos) {
    const auto path = world::shared_data(name);
    if (!path) return std::optional<PicturedWorld>();
    from = path->string();
  }
  TRY(const world::Scene scene, world::load_scene(from));
  world::ImportReport report;
  PicturedWorld made;
  TRY(made.world, build_picture_world(scene, report));
  if (ticks > 0) TRY_STATUS(world::add_scene_reactions(from, made.world));
  TRY(made.matter, simulate_before(made.world, static_cast<uint64_t>(ticks)));
  return std::optional(std::move(made));
}

}  // namespace tools
