#include "world/scenes/scene.h"

#include <fstream>

#include <gtest/gtest.h>

#include "tests/support.h"
#include "world/scenes/effects.h"

namespace world {
namespace {

Result<Scene> scene_of(const std::string& text) {
  TemporaryFolder folder;
  std::ofstream(folder / "a.toml") << text;
  return load_scene((folder / "a.toml").string());
}

std::string error_of(const std::string& text) {
  const auto scene = scene_of(text);
  return scene.ok() ? "" : scene.error().message;
}

constexpr const char* kSmall = "[world]\ngenerator = \"flat\"\nsize = [16, 16, 16]\n";

TEST(EveryScene, LoadsHasACameraAndSaysWhatItShows) {
  EXPECT_FALSE(scene_names().empty());
  for (const std::string& name : scene_names()) {
    const auto scene = load_scene(name);
    ASSERT_TRUE(scene.ok()) << scene.error().message;
    EXPECT_FALSE(scene->what.empty()) << name;
    EXPECT_FALSE(scene->cameras.empty()) << name;
    for (const CameraPlacement& camera : scene->cameras) EXPECT_NEAR(glm::length(camera.forward), 1, 1e-12) << name;
    EXPECT_NEAR(glm::length(scene->environment.sun_direction), 1, 1e-12) << name;
  }
}

TEST(Scene, ErrorsNameFileLineColumnAndWhatWasExpected) {
  EXPECT_NE(error_of("[world]\ngenerator = \"flat\"\n").find("size"), std::string::npos);
  EXPECT_NE(error_of("what = \"x\"\n").find("[world]"), std::string::npos);
  EXPECT_NE(error_of(std::string(kSmall) + "[sun]\nirradiance = [1, -2, 3]\n").find(":5:"), std::string::npos);
  EXPECT_NE(
      error_of(std::string(kSmall) + "[[camera]]\nname = \"a\"\nposition = [1, 2, 3]\nfov_deg = 180\n").find("fov_deg"),
      std::string::npos);
  EXPECT_NE(error_of(std::string(kSmall) + "[[camera]]\nname = \"a\"\nposition = [1, 2, 3]\nlook_at = [1, 2, 3]\n")
                .find("look_at"),
            std::string::npos);
  EXPECT_NE(error_of(std::string(kSmall) + "offset = [100, 0, 0]\n").find("128"), std::string::npos);
  EXPECT_NE(error_of("[world]\ngenerator = \"flat\"\nfile = \"x.vox\"\nsize = [1, 1, 1]\n").find("either"),
            std::string::npos);
}

TEST(Scene, AFillOfAnUnknownBlockSuggestsTheNearest) {
  const auto scene = scene_of(std::string(kSmall) + "[[fill]]\nmin = [0,0,0]\nmax = [1,1,1]\nblock = \"stoen\"\n");
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  ImportReport report;
  const auto world = build_world(*scene, report);
  ASSERT_FALSE(world.ok());
  EXPECT_NE(world.error().message.find("\"stone\""), std::string::npos) << world.error().message;
}

TEST(Scene, AnUnknownGeneratorOrParameterIsAnError) {
  for (const char* text : {"[world]\ngenerator = \"flatt\"\nsize = [8, 8, 8]\n",
                           "[world]\ngenerator = \"flat\"\nsize = [8, 8, 8]\n[world.parameters]\nhieght = 3\n"}) {
    const auto scene = scene_of(text);
    ASSERT_TRUE(scene.ok()) << scene.error().message;
    ImportReport report;
    EXPECT_FALSE(build_world(*scene, report).ok()) << text;
  }
}

TEST(Scene, AnOffsetMovesWorldFillsAndCamerasByExactlyThat) {
  const std::string rest =
      "[[fill]]\nmin = [3, 3, 3]\nmax = [3, 9, 3]\nblock = \"lamp_warm\"\n"
      "[[camera]]\nname = \"a\"\nposition = [1.25, 2.5, 3.75]\nyaw_deg = 90\n";
  const auto here = scene_of(std::string(kSmall) + rest),
             far = scene_of(std::string(kSmall) + "offset = [10000000, -1280, 16777216]\n" + rest);
  ASSERT_TRUE(here.ok() && far.ok()) << far.error().message;
  ImportReport report;
  const auto a = build_world(*here, report), b = build_world(*far, report);
  ASSERT_TRUE(a.ok() && b.ok());
  const VoxelPos offset{10'000'000, -1280, 16'777'216};
  EXPECT_EQ(b->store.bounds().min, a->store.bounds().min + offset);
  EXPECT_EQ(a->store.census(), b->store.census());
  EXPECT_EQ(b->store.get(VoxelPos{3, 5, 3} + offset), *b->palette->find("lamp_warm"));
  EXPECT_EQ(far->cameras[0].position.voxel, here->cameras[0].position.voxel + offset);
  EXPECT_EQ(far->cameras[0].position.fraction, here->cameras[0].position.fraction);
  EXPECT_NEAR(far->cameras[0].forward.x, 1, 1e-12);
}

TEST(Scene, TheOverviewCameraSeesAllCornersOfAThing) {
  World world(standard_blocks());
  EditBatch batch;
  batch.fill({{100, 50, -300}, {140, 120, -280}}, 1);
  ASSERT_TRUE(world.store.apply(batch).ok());
  const auto camera = camera_of(world, "");
  ASSERT_TRUE(camera.ok());
  const Vec3d right = glm::normalize(glm::cross(camera->forward, Vec3d(0, 1, 0))),
              up = glm::cross(right, camera->forward);
  const double tan_y = std::tan(camera->vertical_fov_deg / 2 * 3.14159265358979 / 180);
  for (int i = 0; i < 8; ++i) {
    const Vec3d to = WorldPoint::from(i & 1 ? 100 : 141, i & 2 ? 50 : 121, i & 4 ? -300 : -279) - camera->position;
    const double depth = glm::dot(to, camera->forward);
    EXPECT_GT(depth, 0);
    EXPECT_LT(std::abs(glm::dot(to, up)), depth * tan_y);
    EXPECT_LT(std::abs(glm::dot(to, right)), depth * tan_y * 16 / 9);
  }
}

TEST(Scene, SaysHowWarmItIsAndWhatItAsksOfTheSimulation) {
  const auto plain = scene_of(kSmall);
  ASSERT_TRUE(plain.ok()) << plain.error().message;
  EXPECT_EQ(plain->environment.temperature, Kelvin{288.15});
  EXPECT_EQ(plain->simulation, SimulationRequest{});
  const auto cold = scene_of("temperature_k = 250.5\n" + std::string(kSmall) +
                             "[simulation]\nseed = 9007199254740993\neffects = [\"rain\", \"heat\"]\n"
                             "[simulation.knobs]\nliquid_rule = \"pipes\"\nticks = \"3\"\n");
  ASSERT_TRUE(cold.ok()) << cold.error().message;
  EXPECT_EQ(cold->environment.temperature, Kelvin{250.5});
  EXPECT_EQ(cold->simulation.seed, 9007199254740993u);
  EXPECT_EQ(cold->simulation.effects, (std::vector<std::string>{"rain", "heat"}));
  EXPECT_EQ(cold->simulation.knobs, (std::map<std::string, std::string>{{"liquid_rule", "pipes"}, {"ticks", "3"}}));
  ImportReport report;
  const auto world = build_world(*cold, report);
  ASSERT_TRUE(world.ok()) << world.error().message;
  EXPECT_EQ(world->environment.temperature, Kelvin{250.5});
  EXPECT_EQ(world->simulation, cold->simulation);
  const std::vector<EffectCall> effects = called_effects(*world);
  const auto rain = std::find_if(effects.begin(), effects.end(), [](const EffectCall& e) { return e.name == "rain"; });
  ASSERT_NE(rain, effects.end());
  EXPECT_TRUE(rain->called_for);
  EXPECT_EQ(rain->why, "the scene asks for it");

  EXPECT_NE(error_of("temperature_k = 0\n" + std::string(kSmall))
                .find("a.toml:1:17: 'temperature_k' is 0, but must be in (0, 6000]"),
            std::string::npos);
  EXPECT_NE(error_of(std::string(kSmall) + "[simulation]\nsed = 3\n").find("did you mean 'seed'"), std::string::npos);
  EXPECT_NE(error_of(std::string(kSmall) + "[simulation]\nseed = -1\n").find("seed"), std::string::npos);
}

TEST(Scene, SaysWhatCloudsAreOverIt) {
  const std::string all =
      "[clouds]\ncover = 0.5\nheight_m = 800\nthickness_m = 90\nsize_m = 300\nextinction_per_m = 0.5\n"
      "drift_mps = [1, -2]\nseed = 4000000000\n";
  const auto scene = scene_of(std::string(kSmall) + all);
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_EQ(scene->environment.clouds, (Clouds{0.5f, 800, 90, 300, 0.5f, {1, 0, -2}, {}, 4000000000u}));
  const auto raised = scene_of(std::string(kSmall) + "offset = [128, 256, 0]\n" + all);
  ASSERT_TRUE(raised.ok()) << raised.error().message;
  EXPECT_EQ(raised->environment.clouds.height, 800 + 256) << "the base moves with the land";
  const auto called = [](const Scene& s) {
    ImportReport report;
    for (const EffectCall& effect : called_effects(build_world(s, report).value()))
      if (effect.name == "clouds") return effect.called_for;
    return false;
  };
  EXPECT_TRUE(called(*scene));
  EXPECT_FALSE(called(scene_of(kSmall).value()));

  const auto wrong = [](const std::string& rest) { return error_of(std::string(kSmall) + "[clouds]\n" + rest); };
  EXPECT_NE(wrong("cover = 1.5\n").find("a.toml:5:9: 'cover' is 1.5, but must be in [0, 1]"), std::string::npos)
      << wrong("cover = 1.5\n");
  EXPECT_NE(wrong("seed = 3\n").find("cover"), std::string::npos);
  EXPECT_NE(wrong("cover = 0\ncovre = 1\n").find("did you mean 'cover'"), std::string::npos);
  for (const char* row : {"height_m = 1e7", "thickness_m = 0", "size_m = 1", "extinction_per_m = -1",
                          "drift_mps = [1, 2, 3]", "drift_mps = [1, 1e9]", "seed = -1", "seed = 4294967296"})
    EXPECT_NE(wrong(std::string("cover = 0.1\n") + row + "\n"), "") << row;
}

TEST(Scene, SaysWhichBodiesFallAndWhereParticlesComeFrom) {
  const auto scene = scene_of(std::string(kSmall) +
                              "[[body]]\nname = \"crate\"\nposition = [1.5, 20, -3.25]\nsize_m = [2, 1, 0.5]\n"
                              "velocity_mps = [0, -3, 1]\ndensity_kg_per_m3 = 600\nrestitution = 0.5\nfriction = 0.1\n"
                              "[[body]]\nposition = [0, 0, 0]\n"
                              "[[particles]]\nkind = \"rain\"\nmin = [-8, 30, -8]\nmax = [8, 32, 8]\nper_s = 200\n"
                              "velocity_mps = [1, -6, 0]\nspread_mps = 0.5\nbrings = \"water\"\nmm_per_h = 40\n");
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  ImportReport report;
  const auto world = build_world(*scene, report);
  ASSERT_TRUE(world.ok()) << world.error().message;
  const std::vector<BodyRequest> bodies = {
      {"crate", WorldPoint::from(1.5, 20, -3.25), {2, 1, 0.5}, {0, -3, 1}, 600, 0.5, 0.1}, {}};
  EXPECT_EQ(world->simulation.bodies, bodies);
  const std::vector<ParticleSource> sources = {{"rain", {{-8, 30, -8}, {8, 32, 8}}, 200, {1, -6, 0}, 0.5, "water", 40}};
  EXPECT_EQ(world->simulation.particles, sources);
  for (const EffectCall& effect : called_effects(*world))
    if (effect.name == "bodies" || effect.name == "particles") {
      EXPECT_TRUE(effect.called_for) << effect.name;
    }
  const auto wrong = [](const std::string& table) { return error_of(std::string(kSmall) + table); };
  EXPECT_NE(wrong("[[body]]\nposition = [0, 0, 0]\nsize_m = [0, 1, 1]\n").find("size_m"), std::string::npos);
  EXPECT_NE(wrong("[[body]]\nname = \"a\"\n").find("position"), std::string::npos);
  EXPECT_NE(wrong("[[particles]]\nkind = \"rain\"\nmin = [0, 0, 0]\nmax = [0, -1, 0]\n").find("max"),
            std::string::npos);
  EXPECT_NE(wrong("[[particles]]\nkind = \"rain\"\nmin = [0, 0, 0]\nmax = [0, 1, 0]\nmm_per_h = 3\n").find("brings"),
            std::string::npos);
}

TEST(Scene, AddsWhatItAsksOfTheSimulationToWhatItsFileAsks) {
  const TemporaryFolder folder;
  World saved(standard_blocks());
  saved.simulation = {7, {"rain"}, {{"a", "1"}, {"b", "2"}}};
  ASSERT_TRUE(write_world(saved, folder / "saved.loam").ok());
  const auto built = [&](const std::string& rest) {
    std::ofstream(folder / "a.toml") << "[world]\nfile = \"saved.loam\"\n" << rest;
    ImportReport report;
    return build_world(load_scene((folder / "a.toml").string()).value(), report).value().simulation;
  };
  EXPECT_EQ(built(""), saved.simulation);
  EXPECT_EQ(built("[simulation]\nseed = 3\neffects = [\"rain\", \"heat\"]\n[simulation.knobs]\nb = \"3\"\n"),
            (SimulationRequest{3, {"rain", "heat"}, {{"a", "1"}, {"b", "3"}}}));
}

TEST(HardCaseX2, AWorldCallsOnlyForTheEffectsThatItsBlocksNeed) {
  World world(standard_blocks());
  const auto called = [&](const std::string& name) {
    for (const EffectCall& effect : called_effects(world))
      if (effect.name == name) return effect.called_for;
    ADD_FAILURE() << "no effect " << name;
    return false;
  };
  EditBatch stone;
  stone.set({0, 0, 0}, *world.palette->find("stone"));
  ASSERT_TRUE(world.store.apply(stone).ok());
  for (const char* name :
       {"block_light", "transmission", "proxies", "liquid", "granular", "gas", "fire", "luminaires", "media", "meshes"})
    EXPECT_FALSE(called(name)) << name;
  world.luminaires.resize(1);
  world.media.resize(1);
  EXPECT_FALSE(called("luminaires") || called("media"));  // without strength
  world.luminaires[0].power = {0, 1, 0};
  world.media[0].scattering = {0, 1, 0};
  EXPECT_TRUE(called("luminaires") && called("media"));
  EditBatch more;
  more.set({1, 0, 0}, *world.palette->find("lamp_warm"));
  more.set({2, 0, 0}, *world.palette->find("water"));
  ASSERT_TRUE(world.store.apply(more).ok());
  EXPECT_TRUE(called("block_light"));
  EXPECT_TRUE(called("liquid"));
  EXPECT_FALSE(called("granular"));
  // Taking them out again takes the effects out.
  EditBatch out;
  out.fill({{1, 0, 0}, {2, 0, 0}}, kAir);
  ASSERT_TRUE(world.store.apply(out).ok());
  EXPECT_FALSE(called("block_light"));
  EXPECT_FALSE(called("liquid"));
}

}  // namespace
}  // namespace world
