// What hands and words do in play, without a window: picking, brushes, keys, commands, settings, budgets.
#include <cmath>
#include <fstream>
#include <random>

#include <gtest/gtest.h>

#include "sim/clock.h"
#include "tests/support.h"
#include "tools/play/brush.h"
#include "tools/play/settings_plan.h"
#include "tools/play/console.h"
#include "tools/play/controls.h"
#include "tools/play/day_clock.h"
#include "tools/play/forms.h"
#include "tools/play/hud.h"
#include "tools/play/pace.h"
#include "tools/play/pick.h"
#include "tools/play/settings.h"

namespace tools {
namespace {

using world::VoxelPos;
using world::WorldPoint;

world::BlockId block(const world::World& w, const char* name) { return *w.palette->find(name); }

void put(world::World& w, const world::EditBatch& batch) { ASSERT_TRUE(w.store.apply(batch).ok()); }

struct Hands : ::testing::Test {
  world::World world{world::standard_blocks()};
  world::BlockShapes shapes = *world::block_shapes(*world.palette);
  void set(VoxelPos v, const char* name) {
    world::EditBatch batch;
    batch.set(v, block(world, name));
    put(world, batch);
  }
};

// ---- picking ----

TEST_F(Hands, PickTheFaceThatIsSeenFromEverySide) {
  set({0, 0, 0}, "granite");
  for (int face = 0; face < world::kFaces; ++face) {
    const VoxelPos step = world::face_step(face);
    const world::Vec3d out(step.x, step.y, step.z);
    const WorldPoint eye = WorldPoint{{0, 0, 0}, world::Vec3d(0.5)} + 3.0 * out;
    const Pick found = pick(world, shapes, eye, -out, 6);
    ASSERT_TRUE(found.hit);
    EXPECT_EQ(found.face, face);
    EXPECT_EQ(found.beside(), step);
    EXPECT_DOUBLE_EQ(found.distance, 2.5);
  }
}

TEST_F(Hands, PouringAddsAboveWhatIsThereAlready) {
  const world::BlockId water = block(world, "water");
  EXPECT_EQ(room_to_pour(world, shapes, {0, 1, 0}, water), VoxelPos(0, 1, 0));
  set({0, 1, 0}, "water"), set({0, 2, 0}, "water");
  EXPECT_EQ(room_to_pour(world, shapes, {0, 1, 0}, water), VoxelPos(0, 3, 0));
  EXPECT_EQ(room_to_pour(world, shapes, {0, 1, 0}, block(world, "lava")), VoxelPos(0, 1, 0));  // goes in its place
  set({0, 3, 0}, "granite");
  EXPECT_EQ(room_to_pour(world, shapes, {0, 1, 0}, water), std::nullopt);
}

TEST_F(Hands, ATorchLeansOnTheWallThatIsPointedAt) {
  set({0, 0, 0}, "granite");
  const world::BlockId torch = block(world, "torch");
  const char* const kLeans[] = {"torch_east", "torch_west", nullptr, "torch", "torch_south", "torch_north"};  // by face
  for (int face = 0; face < world::kFaces; ++face) {
    const VoxelPos step = world::face_step(face);
    const world::Vec3d out(step.x, step.y, step.z);
    const Pick target = pick(world, shapes, WorldPoint{{0, 0, 0}, world::Vec3d(0.5)} + 3.0 * out, -out, 6);
    const auto form = form_beside(world, shapes, torch, target);
    ASSERT_EQ(form.has_value(), kLeans[face] != nullptr) << "nothing hangs from a ceiling";
    if (!form) continue;
    EXPECT_EQ((*world.palette)[*form].name, kLeans[face]);
    EXPECT_EQ(upright_form(*world.palette, shapes, *form), torch);
    // It touches the wall, and is what is picked there.
    const world::Proxy& shape = *shapes.shape[*form];
    const int axis = world::face_axis(face), sign = world::face_sign(face);
    EXPECT_EQ(sign > 0 ? shape.bounds[0].low[axis] : shape.bounds[0].high[axis], sign > 0 ? 0 : 1);
    set(step, kLeans[face]);
    const VoxelPos beside = axis == 0 ? VoxelPos{0, 0, 1} : VoxelPos{1, 0, 0};
    const world::ProxyBox& head = shape.boxes.back();
    const WorldPoint eye =
        WorldPoint{step, world::Vec3d(head.low + head.high) / 2.0} + 3.0 * world::Vec3d(beside.x, beside.y, beside.z);
    const Pick seen = pick(world, shapes, eye, -world::Vec3d(beside.x, beside.y, beside.z), 6);
    ASSERT_TRUE(seen.hit);
    EXPECT_EQ(seen.voxel, step);
    EXPECT_FALSE(seen.replaceable);
    set(step, "air");
  }
}

TEST_F(Hands, WhatNeedsABearerStandsOnGroundOrIsRefused) {
  set({0, 3, 0}, "granite"), set({3, 0, 0}, "granite"), set({6, 0, 0}, "granite"), set({6, 1, 0}, "tall_grass");
  const auto named = [&](const char* name, const Pick& target) {
    const auto form = form_beside(world, shapes, block(world, name), target);
    return form ? (*world.palette)[*form].name : "";
  };
  const auto at = [&](VoxelPos v, int face) {
    return Pick{.hit = true,
                .voxel = v,
                .face = face,
                .replaceable = is_replaceable(*world.palette, shapes, world.store.get(v))};
  };
  EXPECT_EQ(named("torch", at({0, 3, 0}, world::kFaceNegY)), "");
  set({1, 2, 0}, "granite");
  EXPECT_EQ(named("torch", at({0, 3, 0}, world::kFaceNegY)), "torch_east") << "there is a wall beside it";
  set({0, 1, 0}, "granite");
  EXPECT_EQ(named("torch", at({0, 3, 0}, world::kFaceNegY)), "torch");
  EXPECT_EQ(named("candle", at({3, 0, 0}, world::kFacePosX)), "") << "a candle leans on nothing";
  EXPECT_EQ(named("candle", at({3, 0, 0}, world::kFacePosY)), "candle");
  EXPECT_EQ(named("torch", at({6, 1, 0}, world::kFacePosX)), "torch") << "in the place of the grass";
  EXPECT_EQ(named("lantern", at({0, 3, 0}, world::kFaceNegY)), "lantern");
  EXPECT_EQ(named("granite", at({0, 3, 0}, world::kFaceNegY)), "granite");
}

TEST_F(Hands, PickIsTheSameFarFromTheOrigin) {
  const VoxelPos far{1'000'000'000, 80, -1'000'000'000};
  set({0, 0, 0}, "granite"), set(far, "granite");
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-3, 4);
  for (int n = 0; n < 2000; ++n) {
    const world::Vec3d from(place(random), place(random), place(random)), to(place(random) / 4, 0.5, place(random) / 4);
    if (std::max({std::abs(from.x - 0.5), std::abs(from.y - 0.5), std::abs(from.z - 0.5)}) < 0.51) continue;
    const world::Vec3d way = glm::normalize(to - from);
    const Pick here = pick(world, shapes, WorldPoint{{0, 0, 0}, world::Vec3d(0)} + from, way, 8);
    const Pick there = pick(world, shapes, WorldPoint{far, world::Vec3d(0)} + from, way, 8);
    ASSERT_EQ(here.hit, there.hit);
    if (!here.hit) continue;
    EXPECT_EQ(here.face, there.face);
    EXPECT_EQ(here.distance, there.distance);
    EXPECT_EQ(there.voxel, far);
  }
}

TEST_F(Hands, PickPassesBesideTheRailsOfAFenceAndMeetsItsPost) {
  set({0, 0, 0}, "fence_oak"), set({0, 0, -1}, "granite");
  const Pick post = pick(world, shapes, {{0, 0, 3}, {0.5, 0.5, 0.5}}, {0, 0, -1}, 6);
  ASSERT_TRUE(post.hit);
  EXPECT_EQ(post.voxel, (VoxelPos{0, 0, 0}));
  EXPECT_GT(post.distance, 2.5);  // inside of the voxel's own border
  EXPECT_GT(post.low.x, 0);
  const Pick beside = pick(world, shapes, {{0, 0, 3}, {0.05, 0.5, 0.5}}, {0, 0, -1}, 6);
  ASSERT_TRUE(beside.hit);
  EXPECT_EQ(beside.voxel, (VoxelPos{0, 0, -1}));
}

TEST_F(Hands, PickReachesNoFurtherThanAnArm) {
  set({0, 0, -7}, "granite");
  const WorldPoint eye{{0, 0, 0}, world::Vec3d(0.5)};
  EXPECT_FALSE(pick(world, shapes, eye, {0, 0, -1}, 6.4).hit);
  EXPECT_TRUE(pick(world, shapes, eye, {0, 0, -1}, 6.6).hit);
}

TEST_F(Hands, PickLooksThroughWaterAndPlacesInIt) {
  set({0, 0, -2}, "water"), set({0, 0, -3}, "granite");
  const WorldPoint eye{{0, 0, 0}, world::Vec3d(0.5)};
  const Pick found = pick(world, shapes, eye, {0, 0, -1}, 6);
  EXPECT_EQ(found.voxel, (VoxelPos{0, 0, -3}));
  EXPECT_EQ(found.beside(), (VoxelPos{0, 0, -2}));
  EXPECT_EQ(pick(world, shapes, eye, {0, 0, -1}, 6, true).voxel, (VoxelPos{0, 0, -2}));
}

// ---- brushes ----

uint64_t voxels(const world::World& w) { return w.store.voxel_count(); }

TEST_F(Hands, SphereIsTheVoxelsWhoseMiddlesAreWithinItsRadius) {
  for (const int radius : {0, 1, 4, 9}) {
    world::World w{world::standard_blocks()};
    put(w, sphere_of({5, -3, 100}, radius, block(w, "granite")));
    uint64_t expected = 0;
    for (int x = -radius; x <= radius; ++x)
      for (int y = -radius; y <= radius; ++y)
        for (int z = -radius; z <= radius; ++z) expected += x * x + y * y + z * z <= (radius + 0.5) * (radius + 0.5);
    EXPECT_EQ(voxels(w), expected) << radius;
  }
}

TEST_F(Hands, LineHoldsTogetherByFacesFromEndToEnd) {
  const VoxelPos a{0, 0, 0}, b{17, -5, 9};
  put(world, line_of(a, b, block(world, "granite")));
  EXPECT_EQ(voxels(world), 17u + 5 + 9 + 1);
  EXPECT_NE(world.store.get(a), world::kAir);
  EXPECT_NE(world.store.get(b), world::kAir);
}

TEST_F(Hands, FillFillsABasinToItsRimAndRefusesAnOpenField) {
  const world::BlockId rock = block(world, "granite"), water = block(world, "water");
  put(world, box_of({0, 0, 0}, {9, 4, 9}, rock));
  put(world, box_of({1, 1, 1}, {8, 4, 8}, world::kAir));
  const auto basin = fill_of(world.store, {4, 3, 4}, water);
  ASSERT_TRUE(basin);
  put(world, *basin);
  EXPECT_EQ(world.store.census()[water], 8u * 8 * 3);
  EXPECT_EQ(world.store.get({4, 4, 4}), world::kAir);
  EXPECT_FALSE(fill_of(world.store, {4, 5, 4}, water));
}

TEST_F(Hands, ReplaceChangesOneKindAlone) {
  const world::BlockId a = block(world, "granite"), b = block(world, "oak_planks"), c = block(world, "glass");
  put(world, box_of({-8, -8, -8}, {8, 8, 8}, a));
  put(world, box_of({0, 0, 0}, {0, 0, 3}, b));
  put(world, replace_of(world.store, {0, 0, 0}, 3, b, c));
  EXPECT_EQ(world.store.census()[c], 4u);
  EXPECT_EQ(world.store.census()[a], 17u * 17 * 17 - 4);
}

TEST_F(Hands, FourTurnsAndTwoFlipsAreNothing) {
  put(world, box_of({0, 0, 0}, {2, 1, 4}, block(world, "granite")));
  put(world, box_of({1, 1, 1}, {1, 1, 3}, block(world, "glass")));
  const auto copy = copy_box(world.store, {2, 2, 4}, {0, 0, 0});
  ASSERT_TRUE(copy);
  const TurnedForms forms(*world.palette);
  Clipboard around = *copy;
  for (int i = 0; i < 4; ++i) around = turned(around, forms);
  EXPECT_EQ(around.blocks, copy->blocks);
  EXPECT_EQ(around.size, copy->size);
  EXPECT_NE(turned(*copy, forms).blocks, copy->blocks);
  for (const int axis : {0, 1, 2}) EXPECT_EQ(flipped(flipped(*copy, axis, forms), axis, forms).blocks, copy->blocks);
  world::World other{world::standard_blocks()};
  put(other, paste_of(*copy, {100, 7, -3}));
  EXPECT_EQ(other.store.get({101, 8, 0}), block(other, "glass"));
  EXPECT_EQ(voxels(other), voxels(world));
}

TEST_F(Hands, MirrorBuildsBothSides) {
  put(world, mirrored(box_of({3, 0, 0}, {5, 1, 0}, block(world, "granite")), 0, 1, TurnedForms(*world.palette)));
  EXPECT_EQ(voxels(world), 12u);
  EXPECT_EQ(world.store.get({-3, 1, 0}), world.store.get({5, 1, 0}));
}

TEST_F(Hands, ATorchComesDownWithTheWallThatBearsIt) {
  for (int face = 0; face < world::kFaces; ++face) {
    if (face == world::kFaceNegY) continue;  // nothing hangs
    set({0, 0, 0}, "granite");
    const VoxelPos step = world::face_step(face);
    const Pick target{.hit = true, .voxel = {0, 0, 0}, .face = face};
    const auto form = form_beside(world, shapes, block(world, "torch"), target);
    ASSERT_TRUE(form);
    set(step, (*world.palette)[*form].name.c_str());
    set({3, 3, 3}, "torch");  // bears nothing on nothing, and stays as it is
    world::EditBatch dig;
    dig.set({0, 0, 0}, world::kAir);
    put(world, with_what_falls(world, shapes, dig));
    EXPECT_EQ(voxels(world), 1u);
    EXPECT_EQ(world.store.get({3, 3, 3}), block(world, "torch"));
  }
  // Of a blast, all at its rim; a wall that another wall takes the place of keeps its torch.
  put(world, box_of({-8, -8, -8}, {7, 7, 7}, block(world, "granite")));
  set({8, 0, 0}, "torch_west"), set({0, 8, 0}, "candle"), set({0, 8, 7}, "candle");
  put(world, with_what_falls(world, shapes, box_of({7, 0, 0}, {7, 0, 0}, block(world, "glass"))));
  EXPECT_NE(world.store.get({8, 0, 0}), world::kAir);
  put(world, with_what_falls(world, shapes, sphere_of({7, 0, 0}, 3, world::kAir)));
  put(world, with_what_falls(world, shapes, sphere_of({0, 7, 0}, 3, world::kAir)));
  EXPECT_EQ(world.store.get({8, 0, 0}), world::kAir);
  EXPECT_EQ(world.store.get({0, 8, 0}), world::kAir);
  EXPECT_EQ(world.store.get({0, 8, 7}), block(world, "candle"));
}

TEST_F(Hands, WhatLooksToASideTurnsWithWhatItIsCopiedIn) {
  const TurnedForms forms(*world.palette);
  set({0, 0, 0}, "granite");
  for (int face : {world::kFacePosX, world::kFaceNegX, world::kFacePosZ, world::kFaceNegZ}) {
    const Pick target{.hit = true, .voxel = {0, 0, 0}, .face = face};
    const world::BlockId torch = *form_beside(world, shapes, block(world, "torch"), target);
    const VoxelPos step = world::face_step(face);
    put(world, box_of(step, step, torch));
  }
  ASSERT_EQ(voxels(world), 5u);
  // Four torches around a block are that, however it is turned and mirrored.
  const Clipboard copy = *copy_box(world.store, {-1, 0, -1}, {1, 0, 1});
  EXPECT_EQ(turned(copy, forms).blocks, copy.blocks);
  for (const int axis : {0, 2}) EXPECT_EQ(flipped(copy, axis, forms).blocks, copy.blocks);
  world::World other{world::standard_blocks()};
  const world::BlockId east = world.store.get({1, 0, 0});
  put(other, mirrored(box_of({5, 0, 0}, {5, 0, 0}, east), 0, 0, forms));
  EXPECT_EQ(other.store.get({5, 0, 0}), east);
  EXPECT_EQ(other.store.get({-5, 0, 0}), world.store.get({-1, 0, 0}));
}

TEST(Forms, NamesOfOtherGamesTurnToo) {
  world::BlockPalette palette = world::standard_blocks();
  const auto add = [&](const char* name) {
    world::Block block = palette[*palette.find("granite")];
    block.name = name;
    return *palette.add(block);
  };
  const char* const kStairs[] = {"stairs[facing=east,half=top,shape=inner_left]",
                                 "stairs[facing=south,half=top,shape=inner_left]",
                                 "stairs[facing=west,half=top,shape=inner_right]"};
  const char* const kFences[] = {"fence[east=true,north=false,south=false,west=false]",
                                 "fence[east=false,north=false,south=true,west=false]",
                                 "fence[east=false,north=false,south=false,west=true]"};
  const char* const kRails[] = {"rail[shape=north_east]", "rail[shape=south_east]", "rail[shape=north_west]"};
  const char* const kLogs[] = {"log[axis=x]", "log[axis=z]", "log[axis=x]"};
  for (const auto& names : {kStairs, kFences, kRails, kLogs})
    for (int i = 0; i < 3; ++i)
      if (!palette.find(names[i])) add(names[i]);
  const TurnedForms forms(palette);
  for (const auto& names : {kStairs, kFences, kRails, kLogs}) {
    const char *const from = names[0], *const turned = names[1], *const mirrored = names[2];
    EXPECT_EQ(palette[forms.turned[*palette.find(from)]].name, turned);
    EXPECT_EQ(palette[forms.flipped[0][*palette.find(from)]].name, mirrored);
  }
  // A form that isn't there leaves the block as it is.
  EXPECT_EQ(palette[forms.turned[*palette.find(kStairs[1])]].name, kStairs[1]);
}

// ---- keys ----

TEST(Controls, NoKeyDoesTwoThingsAtFirst) {
  for (const Bindings::Conflict& c : Bindings().conflicts())
    ADD_FAILURE() << key_name(c.key) << ": " << row_of(c.a).name << " and " << row_of(c.b).name;
}

TEST(Controls, NamesOfKeysComeBack) {
  const Bindings bindings;
  for (const ActionRow& row : action_rows())
    for (const Key& key : bindings.keys(row.action)) {
      const auto back = key_from_name(key_name(key));
      ASSERT_TRUE(back.ok()) << key_name(key);
      EXPECT_EQ(*back, key);
    }
  EXPECT_NE(key_from_name("spcae").error().message.find("space"), std::string::npos);
}

TEST(Controls, AKeyWithControlIsAnotherAndOneThatIsHeldStillWalks) {
  const Bindings bindings;
  const int z = key_from_name("z")->code, w = key_from_name("w")->code;
  EXPECT_EQ(bindings.find(z, kControl), Action::undo);
  EXPECT_EQ(bindings.find(z, kControl | kShift), Action::redo);
  EXPECT_FALSE(bindings.find(z, 0));
  EXPECT_EQ(bindings.find(w, kControl), Action::forward);  // who runs still walks
  EXPECT_EQ(bindings.find(w, kShift), Action::forward);
}

TEST(Controls, AConflictIsFoundAndOnlyWhatChangedIsKept) {
  Bindings bindings;
  EXPECT_TRUE(bindings.changed().empty());
  ASSERT_TRUE(bindings.set(Action::jump, "w").ok());
  ASSERT_EQ(bindings.conflicts().size(), 1u);
  EXPECT_EQ(bindings.changed(), (std::map<std::string, std::string>{{"jump", "w"}}));
  EXPECT_FALSE(bindings.set(Action::jump, "hyper").ok());
}

// ---- settings ----

TEST(Settings, ComeBackAndNameWhatIsWrong) {
  const world::TemporaryFolder folder;
  const std::filesystem::path path = folder / "a" / "play.toml";
  PlaySettings settings;
  settings.fov_deg = 95.5, settings.backend = "raycast", settings.day_minutes = 7.5,
  settings.knobs["view_distance"] = "256";
  settings.note_world("/one \"odd\" name.loam"), settings.note_world("/two.loam");
  ASSERT_TRUE(settings.bindings.set(Action::forward, "arrow_up i").ok());
  ASSERT_TRUE(write_settings(settings, path).ok());
  const auto back = read_settings(path);
  ASSERT_TRUE(back.ok()) << back.error().message;
  EXPECT_EQ(back->fov_deg, settings.fov_deg);
  EXPECT_EQ(back->knobs, settings.knobs);
  EXPECT_EQ(back->day_minutes, settings.day_minutes);
  EXPECT_EQ(back->recent, settings.recent);
  EXPECT_EQ(back->last_world, "/two.loam");
  EXPECT_EQ(back->bindings.changed(), settings.bindings.changed());
  std::ofstream(path) << "fov_dge = 90\n";
  EXPECT_NE(read_settings(path).error().message.find("fov_deg"), std::string::npos);
  EXPECT_TRUE(read_settings(folder / "none.toml").ok());
}

// ---- commands ----

struct Commands : ::testing::Test {
  ConsoleWords words{
      {"granite", "glass", "water"},
      {"valley", "dam"},
      {"view_distance", "sun_shadow"},
      {"raster"},
      [](const std::string& knob) {
        return knob == "sun_shadow" ? std::vector<std::string>{"none", "ray"} : std::vector<std::string>{};
      }};
  WorldPoint here{{100, 64, -5}, {0.5, 0.25, 0.75}};
};

TEST_F(Commands, PlacesMayBeFarAndRelative) {
  const auto far = read_command("/goto 1e8 80 -1e9", words, here);
  ASSERT_TRUE(far.ok()) << far.error().message;
  EXPECT_EQ(std::get<GoTo>(*far).place.voxel, (VoxelPos{100'000'000, 80, -1'000'000'000}));
  const auto near = read_command("goto ~ ~-10.5 ~3", words, here);
  ASSERT_TRUE(near.ok());
  EXPECT_EQ(std::get<GoTo>(*near).place.voxel, (VoxelPos{100, 53, -2}));
  EXPECT_EQ(std::get<GoTo>(*near).place.fraction, world::Vec3d(0.5, 0.75, 0.75));
  EXPECT_FALSE(read_command("/goto 2e9 0 0", words, here).ok());
  EXPECT_FALSE(read_command("/goto nan 0 0", words, here).ok());
  EXPECT_FALSE(read_command("/goto 1 2", words, here).ok());
}

TEST_F(Commands, TimesHaveNamesAndNumbers) {
  EXPECT_EQ(std::get<TimeOfDay>(*read_command("/time noon", words, here)).hours, 12);
  EXPECT_EQ(std::get<TimeOfDay>(*read_command("/time 18:30", words, here)).hours, 18.5);
  EXPECT_NE(read_command("/time dwan", words, here).error().message.find("dawn"), std::string::npos);
}

TEST_F(Commands, ADayMayTakeAsLongAsItShould) {
  EXPECT_EQ(std::get<DayLength>(*read_command("/day 0", words, here)).minutes, 0);
  EXPECT_EQ(std::get<DayLength>(*read_command("/day 12.5", words, here)).minutes, 12.5);
  for (const char* bad : {"/day", "/day -1", "/day 1441", "/day noon"})
    EXPECT_FALSE(read_command(bad, words, here).ok()) << bad;
}

// ---- the sun ----

TEST(DayClock, ADayPassesInItsMinutesAndGoesBackWithTheTicks) {
  DayClock clock;
  constexpr double kMinutes = 10;
  const auto ticks_a_day = static_cast<uint64_t>(std::llround(60 * kMinutes / sim::kMatterTick.seconds()));
  const uint64_t start = 1000;
  float shown = 8;
  const auto follow = [&](uint64_t tick) { shown = clock.advance(shown, tick, kMinutes).value_or(shown); };
  follow(start);
  EXPECT_EQ(shown, 8);
  for (uint64_t t = 0; t <= ticks_a_day / 4; ++t) follow(start + t);
  EXPECT_NEAR(shown, 14, kSunStepH + 1e-5);
  // While the ticks stand still, it stands too.
  EXPECT_FALSE(clock.advance(shown, start + ticks_a_day / 4, kMinutes));
  for (uint64_t t = ticks_a_day / 4; t > ticks_a_day / 8; --t) follow(start + t);
  EXPECT_NEAR(shown, 11, kSunStepH + 1e-5);
  // A whole day on it is the same hour, at once too, and through midnight.
  follow(start + ticks_a_day + ticks_a_day / 8);
  EXPECT_NEAR(shown, 11, kSunStepH + 1e-5);
  follow(start + ticks_a_day + ticks_a_day * 3 / 4);
  EXPECT_NEAR(shown, 2, kSunStepH + 1e-5);
}

TEST(DayClock, WhatSomebodySetsIsWhereItGoesOnAndAWorldWithoutHoursHasNone) {
  DayClock clock;
  EXPECT_FALSE(clock.advance(-1, 5, 10));
  EXPECT_FALSE(clock.advance(9.5f, 5, 0));
  EXPECT_FALSE(clock.advance(9.503f, 6, 10));  // just set: shown as it is
  const auto later = clock.advance(9.503f, 6 + 2000, 10);
  ASSERT_TRUE(later);
  EXPECT_NEAR(*later, 9.503 + 24 * 2000 * sim::kMatterTick.seconds() / 600, kSunStepH + 1e-5);
  EXPECT_FALSE(clock.advance(22, 6 + 2001, 10));
  const auto night = clock.advance(22, 6 + 2001 + 500, 10);
  ASSERT_TRUE(night);
  EXPECT_NEAR(*night, 22 + 24 * 500 * sim::kMatterTick.seconds() / 600, kSunStepH + 1e-5);
}

TEST_F(Commands, EveryActionIsOne) {
  for (const ActionRow& row : action_rows()) {
    const auto read = read_command("/" + std::string(row.name), words, here);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(std::get<PressAction>(*read).action, row.action);
  }
}

TEST_F(Commands, CompletionGoesOnWithWhatThereIs) {
  EXPECT_EQ(complete_command("/go", words), (std::vector<std::string>{"/goto"}));
  EXPECT_EQ(complete_command("/set sun_shadow r", words), (std::vector<std::string>{"/set sun_shadow ray"}));
  EXPECT_EQ(complete_command("/fill 0 0 0 1 1 1 g", words).size(), 2u);
  EXPECT_EQ(common_beginning(complete_command("/give g", words), "/give g"), "/give g");
  EXPECT_EQ(common_beginning({"/give glass"}, "/give gl"), "/give glass ");
  EXPECT_TRUE(complete_command("/nothing ", words).empty());
}

TEST_F(Commands, ErrorsAreOneSentenceWithTheNearestWord) {
  for (const char* line :
       {"/give granit", "/fill 0 0 0 1 1 1 watr", "/set view_distanc 3", "/gotp", "/speed 100", ""}) {
    const auto read = read_command(line, words, here);
    ASSERT_FALSE(read.ok()) << line;
    EXPECT_EQ(read.error().message.find('\n'), std::string::npos);
  }
  EXPECT_NE(read_command("/give granit", words, here).error().message.find("granite"), std::string::npos);
}

// ---- what fits a time ----

TEST(Budget, TakesTheChangesThatCostTheLeastError) {
  const std::vector<MeasuredKnob> knobs = {
      {"shadow", "ray", {{"none", 20, 0.30}, {"map", 24, 0.02}, {"ray", 40, 0.0}}},
      {"distance", "all", {{"near", 30, 0.25}, {"all", 40, 0.0}}},
  };
  const SettingsPlan roomy = plan_settings(knobs, 40, 40);
  EXPECT_TRUE(roomy.fits);
  EXPECT_TRUE(roomy.changes.empty());
  const SettingsPlan fit = plan_settings(knobs, 40, 25);
  EXPECT_TRUE(fit.fits);
  EXPECT_EQ(fit.changes, (std::vector<std::pair<std::string, std::string>>{{"shadow", "map"}}));
  EXPECT_FALSE(plan_settings(knobs, 40, 5).fits);
}

// ---- on the screen ----

TEST(Pace, DrawsSmallerThenSimplerThenStopsAndLeavesWhatWasChosen) {
  // A machine that needs 25 ms a picture, 400 ms for the window's pixels, half of that by cheap knobs.
  Pace pace;
  const auto ms = [&] { return 25 + 400 * pace.scale() * pace.scale() / (pace.steps() >= 2 ? 2 : 1); };
  for (int n = 0; n < 200; ++n) pace.took(ms());
  EXPECT_GE(pace.steps(), 1);
  EXPECT_LT(ms(), kSlowMs);
  const int steps = pace.steps();
  for (int n = 0; n < 200; ++n) pace.took(n % 5 == 0 ? 300 : ms());
  EXPECT_EQ(pace.steps(), steps) << "a hitch now and then is no reason";
  render::RenderKnobs knobs;
  knobs.lod_error_px = 0.5f;
  pace.simplify(knobs);
  EXPECT_EQ(knobs.lod_error_px, 0.5f);
  EXPECT_EQ(knobs.texture_anisotropy, 1);
  Pace fast;
  for (int n = 0; n < 200; ++n) fast.took(5);
  EXPECT_EQ(fast.scale(), 1);
  EXPECT_EQ(fast.steps(), 0);
}

TEST(Frames, PercentilesAreThoseOfTheLastFrames) {
  FrameTimes times;
  for (int i = 0; i < 1000; ++i) times.add(i);
  EXPECT_EQ(times.count(), FrameTimes::kKept);
  EXPECT_EQ(times.percentile(0), 760);
  EXPECT_EQ(times.percentile(1), 999);
  EXPECT_EQ(times.values().back(), 999);
}

TEST(Screen, APointStandsWhereItsPixelLooks) {
  render::Camera camera;
  camera.position = {{1'000'000'000, 5, 7}, world::Vec3d(0.25)};
  camera.forward = glm::normalize(world::Vec3d(0.3, -0.2, -1));
  camera.vertical_fov = 1.1;
  const render::PixelRays rays(camera, 640, 360);
  float x = 0, y = 0;
  ASSERT_TRUE(project(camera, 640, 360, camera.position + 12.0 * rays.direction(123.5, 45.25), x, y));
  EXPECT_NEAR(x, 123.5, 1e-3);
  EXPECT_NEAR(y, 45.25, 1e-3);
  EXPECT_FALSE(project(camera, 640, 360, camera.position + -1.0 * camera.forward, x, y));
}

}  // namespace
}  // namespace tools
