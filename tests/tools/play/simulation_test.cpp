// The played world without its window: undo through automata, time that goes back, recordings, and the thread.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <random>
#include <thread>

#include <sys/resource.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support.h"
#include "tools/play/brush.h"
#include "tools/play/picture_maker.h"
#include "tools/play/play_log.h"
#include "tools/play/sim_thread.h"
#include "tools/play/simulation.h"
#include "tools/play/worlds.h"
#include "world/scenes/scene.h"

namespace tools {
namespace {

using world::VoxelPos;

/// A flat world of rock, 64 m a side, with a sandy corner.
world::World small_world() {
  world::World w{world::standard_blocks()};
  world::EditBatch batch;
  batch.fill({{0, 0, 0}, {63, 7, 63}}, *w.palette->find("granite"));
  batch.fill({{4, 8, 4}, {9, 8, 9}}, *w.palette->find("sand"));
  EXPECT_TRUE(w.store.apply(batch).ok());
  return w;
}

struct Played : ::testing::Test {
  world::World world = small_world();
  std::unique_ptr<PlaySimulation> play = std::move(*PlaySimulation::make(world));
  world::BlockId id(const char* name) { return *world.palette->find(name); }
  void edit(const world::EditBatch& batch) { ASSERT_TRUE(play->edit(batch).ok()); }
  void steps(int n) {
    for (int i = 0; i < n; ++i) play->step_matter();
  }
  uint64_t hash() { return play->matter().state_hash(); }
};

TEST_F(Played, UndoTakesBackWhatTheWaterDidSince) {
  steps(3);
  const uint64_t before = hash(), tick = play->tick();
  edit(box_of({30, 10, 30}, {33, 13, 33}, id("water")));
  steps(90);  // over the ends of moments that are kept
  ASSERT_NE(hash(), before);
  ASSERT_TRUE(play->undo());
  EXPECT_EQ(hash(), before);
  EXPECT_EQ(play->tick(), tick);
  EXPECT_EQ(world.store.census().count(id("water")), 0u);
}

TEST_F(Played, RedoComesToTheSameMomentAndGoesOnTheSame) {
  edit(sphere_of({30, 14, 30}, 3, id("sand")));
  steps(40);
  edit(box_of({10, 12, 30}, {14, 14, 34}, id("water")));
  steps(21);
  const uint64_t tick = play->tick(), then = hash();
  steps(10);
  const uint64_t later = hash();
  ASSERT_TRUE(play->undo());
  ASSERT_TRUE(play->undo());
  EXPECT_FALSE(play->undo());
  ASSERT_TRUE(play->redo());
  ASSERT_TRUE(play->redo());
  EXPECT_FALSE(play->redo());
  EXPECT_EQ(play->tick(), tick + 10);
  EXPECT_EQ(hash(), later);
  for (int n = 0; n < 10; ++n) ASSERT_TRUE(play->step_back());
  EXPECT_EQ(hash(), then);
  steps(10);
  EXPECT_EQ(hash(), later);
}

TEST_F(Played, TimeThatPassesAfterAnUndoIsNotMixedIntoWhatIsRedone) {
  edit(sphere_of({30, 14, 30}, 3, id("sand")));
  steps(30);
  const uint64_t with_sand = hash();
  edit(sphere_of({40, 14, 40}, 2, id("gravel")));
  steps(25);
  const uint64_t both = hash();
  ASSERT_TRUE(play->undo());
  EXPECT_EQ(hash(), with_sand);
  steps(50);
  ASSERT_TRUE(play->undo());
  steps(5);
  ASSERT_TRUE(play->redo());
  EXPECT_EQ(hash(), with_sand);
  steps(7);
  ASSERT_TRUE(play->redo());
  EXPECT_EQ(hash(), both);
  // An edit ends what could be redone.
  ASSERT_TRUE(play->undo());
  edit(box_of({50, 8, 50}, {50, 8, 50}, id("glass")));
  EXPECT_FALSE(play->redo());
}

TEST_F(Played, StepsBackPassEditsTickByTick) {
  std::vector<uint64_t> hashes{hash()};
  edit(sphere_of({30, 16, 30}, 3, id("sand")));
  for (int n = 0; n < 60; ++n) {
    if (n == 20) {
      edit(box_of({28, 12, 28}, {31, 12, 31}, id("water")));
      hashes.back() = hash();  // the last that was seen of this tick
    }
    steps(1);
    hashes.push_back(hash());
  }
  for (size_t n = hashes.size() - 1; n-- > 1;) {
    ASSERT_TRUE(play->step_back());
    ASSERT_EQ(hash(), hashes[n]) << "tick " << n;
  }
  // And forth again: to where the edit was passed, and on from there as it was.
  ASSERT_TRUE(play->redo());
  EXPECT_EQ(hash(), hashes[20]);
  steps(40);
  EXPECT_EQ(hash(), hashes.back());
}

/// Random edits, ticks, undos, redos and steps back against copies of the world that were kept aside.
TEST_F(Played, AnyChainOfUndoAndRedoComesToStatesThatWereThere) {
  std::mt19937 random(11);
  const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  const std::array<const char*, 4> names{"sand", "water", "granite", "lava"};
  std::vector<uint64_t> before_edits;  // of the chain as it is
  for (int n = 0; n < 120; ++n) {
    const int what = pick(10);
    if (what < 3) {
      before_edits.push_back(hash());
      edit(sphere_of({8 + pick(48), 9 + pick(8), 8 + pick(48)}, pick(3), id(names[static_cast<size_t>(pick(4))])));
    } else if (what < 7) {
      steps(pick(12));
    } else if (what == 7 && !before_edits.empty()) {
      ASSERT_TRUE(play->undo());
      ASSERT_EQ(hash(), before_edits.back()) << "at " << n;
      before_edits.pop_back();
    } else if (what == 8 && play->history().redo_steps() > 0) {
      const uint64_t there = hash();
      const uint64_t tick = play->tick();
      ASSERT_TRUE(play->redo());
      const uint64_t then = hash();
      // There and back, and the same again.
      if (play->history().undo_steps() > before_edits.size()) {
        ASSERT_TRUE(play->undo());
        before_edits.push_back(hash());
        ASSERT_TRUE(play->redo());
      }
      ASSERT_EQ(hash(), then);
      (void)there, (void)tick;
    }
  }
}

TEST_F(Played, TheHistoryStaysWithinItsBytesAndSaysWhatCanStillBeUndone) {
  world::World w = small_world();
  History history(w, 100'000);
  history.begin(0, std::nullopt);
  for (uint64_t tick = 1; tick < 60; ++tick) {
    const world::EditBatch batch = box_of({0, 20, 0}, {31, 30, 31}, id(tick % 2 ? "granite" : "glass"));
    history.begin(tick, batch);
    ASSERT_TRUE(w.store.apply(batch).ok());
  }
  EXPECT_LT(history.undo_steps(), 59u);
  EXPECT_GE(history.undo_steps(), 1u);
  size_t undone = 0;
  for (uint64_t tick = 60; history.undo(tick); ++undone) {
  }
  EXPECT_GE(undone, 1u);
}

TEST_F(Played, MovedMatterIsInTheBooksAfterUndoToo) {
  edit(box_of({30, 10, 30}, {33, 13, 33}, id("water")));
  steps(30);
  ASSERT_TRUE(play->undo());
  edit(box_of({20, 10, 30}, {22, 13, 33}, id("water")));
  steps(30);
  for (const sim::LedgerRow& row : play->matter().ledger()) EXPECT_TRUE(row.exact()) << row.substance;
}

TEST_F(Played, APlayerWalksJumpsAndFlies) {
  play->teleport({{20, 8, 50}, {0.5, 0, 0.5}});
  WalkInput forward;
  forward.south = -1024;
  for (int n = 0; n < 60; ++n) play->walk(forward);
  const WalkState walked = play->walker().state();
  EXPECT_NEAR(50.5 - (walked.foot.voxel.z + walked.foot.fraction.z), 4.3, 0.4);
  EXPECT_EQ(walked.foot.voxel.y, 8);
  WalkInput up;
  up.jump = true;
  double highest = 0;
  for (int n = 0; n < 40; ++n) {
    play->walk(n == 0 ? up : WalkInput{});
    highest = std::max(highest, play->walker().state().foot.voxel.y + play->walker().state().foot.fraction.y - 8);
  }
  EXPECT_NEAR(highest, sim::kJumpHeight, 0.15);
  play->set_mode(true, false);
  for (int n = 0; n < 60; ++n) play->walk(up);
  EXPECT_GT(play->walker().state().foot.voxel.y, 14);
  for (int n = 0; n < 60; ++n) play->walk({});
  const world::WorldPoint hangs = play->walker().state().foot;
  for (int n = 0; n < 60; ++n) play->walk({});
  EXPECT_EQ(play->walker().state().foot.voxel, hangs.voxel);
  // Through the ground.
  play->set_mode(true, true);
  WalkInput down;
  down.crouch = true;
  for (int n = 0; n < 180; ++n) play->walk(down);
  EXPECT_LT(play->walker().state().foot.voxel.y, 0);
}

// ---- recordings ----

struct PlayLogFile : ::testing::Test {
  const world::TemporaryFolder folder;
  const std::string path = folder / "session.log";

  /// Records a session on the dam: an edit of sand in the water's way, an undo, a redo, a step back, a jump.
  uint64_t record() {
    world::ImportReport report;
    world::World world = *world::build_world(*world::load_scene("dam"), report);
    auto play = std::move(*PlaySimulation::make(world));
    auto log = std::move(*PlayLogWriter::open(path, "dam", *play));
    const auto step = [&] { log->matter(), play->step_matter(), log->sum(); };
    const auto walk = [&](const WalkInput& input, int n) {
      for (int i = 0; i < n; ++i) {
        log->walk(input), play->walk(input);
        if (i % 3 == 2) step();
      }
    };
    WalkInput input;
    input.south = -700, input.sprint = true;
    log->mode(true, false), play->set_mode(true, false);
    walk(input, 90);
    const world::VoxelBox box = world.store.bounds();
    const VoxelPos middle{(box.min.x + box.max.x) / 2, box.max.y, (box.min.z + box.max.z) / 2};
    const world::EditBatch batch = sphere_of(middle, 3, *world.palette->find("sand"));
    log->edit(batch, *world.palette);
    EXPECT_TRUE(play->edit(batch).ok());
    log->sum();
    walk({}, 60);
    log->note("undo"), play->undo(), log->sum();
    walk(input, 30);
    log->note("redo"), play->redo(), log->sum();
    log->note("back"), play->step_back(), log->sum();
    log->teleport({middle, world::Vec3d(0.25)}), play->teleport({middle, world::Vec3d(0.25)});
    walk({}, 30);
    log->mark();
    EXPECT_TRUE(log->ok());
    return play->hash();
  }
  PlayLog read() {
    auto log = read_play_log(path);
    EXPECT_TRUE(log.ok()) << log.error().message;
    return std::move(*log);
  }
  static PlayReplay replay(const PlayLog& log) {
    auto replayed = replay_play(log);
    EXPECT_TRUE(replayed.ok()) << replayed.error().message;
    return std::move(*replayed);
  }
  static size_t find(const PlayLog& log, PlayEvent::Kind kind) {
    const auto at = std::find_if(log.events.begin(), log.events.end(), [&](const auto& e) { return e.kind == kind; });
    return static_cast<size_t>(at - log.events.begin());
  }
  static uint64_t ticks_before(const PlayLog& log, size_t event) {
    return static_cast<uint64_t>(std::count_if(log.events.begin(),
                                               log.events.begin() + static_cast<std::ptrdiff_t>(event),
                                               [](const PlayEvent& e) { return e.kind == PlayEvent::Kind::matter; }));
  }
};

TEST_F(PlayLogFile, ASessionRepeatsToTheSameHash) {
  const uint64_t hash = record();
  ASSERT_TRUE(is_play_log(path));
  PlayLog log = read();
  const PlayReplay replayed = replay(log);
  EXPECT_TRUE(replayed.equal);
  EXPECT_EQ(replayed.marks, 2u);
  EXPECT_EQ(replayed.hash, hash);
  // One edit more or less is noticed.
  std::erase_if(log.events, [](const PlayEvent& e) { return e.kind == PlayEvent::Kind::redo; });
  EXPECT_FALSE(replay(log).equal);
}

TEST_F(PlayLogFile, AnEditThatWasTamperedWithIsNamedWithItsTickAndVoxels) {
  record();
  PlayLog log = read();
  const size_t at = find(log, PlayEvent::Kind::edit);
  const uint64_t tick = ticks_before(log, at);
  ASSERT_GT(log.events[at].edit.size(), 1u);
  // One voxel of the sphere becomes gravel in the log: the recorded run had sand there.
  const world::VoxelBox row = log.events[at].edit[2].first;
  log.events[at].edit.push_back({{row.min, row.min}, "gravel"});
  const PlayReplay one = replay(log);
  EXPECT_FALSE(one.equal);
  EXPECT_EQ(one.same_until, tick);
  EXPECT_EQ(one.differs_by, tick);
  EXPECT_EQ(one.differs_in, "an edit");
  ASSERT_EQ(one.voxels.size(), 1u);
  EXPECT_EQ(one.voxels[0].pos, row.min);
  EXPECT_EQ(one.voxels[0].layer, "block");
  EXPECT_EQ(one.voxels[0].found, "gravel");
  EXPECT_EQ(one.voxels[0].expected, "sand");
  // All of them do.
  for (auto& [box, block] : log.events[at].edit) block = "gravel";
  const PlayReplay all = replay(log);
  EXPECT_EQ(all.differs_by, tick);
  ASSERT_FALSE(all.voxels.empty());
  for (const PlayedDifference& v : all.voxels) {
    EXPECT_EQ(v.found, "gravel");
    EXPECT_TRUE(!v.expected || v.expected == "sand");
  }
}

TEST_F(PlayLogFile, WithoutAnEditTheFirstTickThatDiffersIsNamedWithVoxelsThatTheEditHadMoved) {
  record();
  PlayLog log = read();
  const size_t at = find(log, PlayEvent::Kind::edit);
  const uint64_t tick = ticks_before(log, at);
  const std::vector<std::pair<world::VoxelBox, std::string>> edit = log.events[at].edit;
  log.events.erase(log.events.begin() + static_cast<std::ptrdiff_t>(at));
  const PlayReplay replayed = replay(log);
  EXPECT_FALSE(replayed.equal);
  EXPECT_EQ(replayed.same_until, tick);
  EXPECT_EQ(replayed.differs_by, tick + 1);
  EXPECT_EQ(replayed.differs_in, "a tick");
  // The grains that fell in that tick: each has left a voxel and reached one beside it.
  size_t moved = 0;
  for (const PlayedDifference& v : replayed.voxels)
    moved += v.layer == "block" && (v.expected == "sand" || v.found == "sand" || !v.expected);
  EXPECT_GT(moved, 0u);
  for (const PlayedDifference& v : replayed.voxels) {
    bool beside = false;
    for (const auto& [box, block] : edit)
      beside |= v.pos.x >= box.min.x - 1 && v.pos.x <= box.max.x + 1 && v.pos.y >= box.min.y - 1 &&
                v.pos.y <= box.max.y + 1 && v.pos.z >= box.min.z - 1 && v.pos.z <= box.max.z + 1;
    EXPECT_TRUE(beside) << v.pos.x << ' ' << v.pos.y << ' ' << v.pos.z;
  }
}

TEST_F(PlayLogFile, ATickMoreIsNamed) {
  record();
  PlayLog log = read();
  size_t at = 0;
  for (int n = 0; n < 20; ++at) n += log.events[at].kind == PlayEvent::Kind::matter;
  log.events.insert(log.events.begin() + static_cast<std::ptrdiff_t>(at), log.events[at - 1]);
  const PlayReplay replayed = replay(log);
  EXPECT_EQ(replayed.same_until, 20u);
  EXPECT_EQ(replayed.differs_by, 21u);
  EXPECT_FALSE(replayed.voxels.empty());
}

TEST_F(PlayLogFile, OfVersion1NamesTheMarkThatDiffers) {
  record();
  std::string text;
  {
    std::ifstream in(path);
    for (std::string line; std::getline(in, line);) {
      nlohmann::json j = nlohmann::json::parse(line);
      if (j.contains("sum")) continue;
      if (j.contains("loam_play")) j["loam_play"] = 1;
      j.erase("sums");
      if (j.contains("mark")) j["hash"] = "0000000000000001";
      text += j.dump() + "\n";
    }
  }
  std::ofstream(path) << text;
  const PlayReplay replayed = replay(read());
  EXPECT_FALSE(replayed.equal);
  EXPECT_EQ(replayed.marks, 2u);
  EXPECT_EQ(replayed.recorded, 1u);
  EXPECT_TRUE(replayed.differs_in.empty());
}

// ---- where it begins ----

TEST(Start, OfANewWorldIsOnDryLevelGroundUnderTheSky) {
  for (const char* generator : {"valley", "flat"})
    for (const uint64_t seed : {1, 2, 7}) {
      auto opened = open_world(
          {.scene = {}, .generator = generator, .name = "new", .seed = seed, .size = {256, 192, 256}, .keep = false});
      ASSERT_TRUE(opened.ok()) << opened.error().message;
      const world::World& world = opened->played->world();
      EXPECT_TRUE(world.knobs.contains("time_of_day")) << "its sun goes on";
      const Start start = start_of(world);
      EXPECT_FALSE(start.flies) << generator << seed;
      const VoxelPos v = start.foot.voxel;
      const world::Phase below = (*world.palette)[world.store.get(v - VoxelPos{0, 1, 0})].phase;
      EXPECT_TRUE(below == world::Phase::solid || below == world::Phase::granular) << generator << seed;
      for (int y = 0; y < 192; ++y)
        EXPECT_NE((*world.palette)[world.store.get(v + VoxelPos{0, y, 0})].phase, world::Phase::liquid)
            << generator << seed;
    }
}

// ---- the thread ----

TEST(SimThread, EditsAreDoneAtOnceAlsoWhileTimeStands) {
  auto played = std::make_unique<PlayedWorld>();
  played->own = std::make_unique<world::World>(small_world());
  const world::BlockId glass = *played->own->palette->find("glass");
  auto made = SimThread::make(std::move(played), {});
  ASSERT_TRUE(made.ok());
  SimThread& thread = **made;
  thread.start();
  PlayRequest pause;
  pause.kind = PlayRequest::Kind::pause, pause.on = true;
  thread.ask(pause);
  PlayRequest request;
  request.edit = box_of({40, 8, 40}, {41, 9, 41}, glass);
  const uint64_t number = thread.ask(request);
  thread.wait_for(number, 5);
  EXPECT_GE(thread.state().applied, number);
  EXPECT_TRUE(thread.state().paused);
  const uint64_t tick = thread.state().tick;
  LeafValuesMap changes;
  AmountChanges amounts;
  EXPECT_GE(thread.take_changes(changes, amounts), number);
  ASSERT_TRUE(changes.contains(world::leaf_from_voxel({40, 8, 40})));
  EXPECT_EQ(changes[world::leaf_from_voxel({40, 8, 40})][static_cast<size_t>(world::index_in_leaf({40, 8, 40}))],
            glass);
  PlayRequest step;
  step.kind = PlayRequest::Kind::step;
  thread.wait_for(thread.ask(step), 5);
  EXPECT_EQ(thread.state().tick, tick + 1);
  EXPECT_TRUE(thread.stop(0, 0).ok());
}

TEST(SimThread, AmountsOfLiquidsReachWhoDraws) {
  auto played = std::make_unique<PlayedWorld>();
  played->own = std::make_unique<world::World>(small_world());
  const world::BlockId water = *played->own->palette->find("water");
  auto made = SimThread::make(std::move(played), {});
  ASSERT_TRUE(made.ok());
  SimThread& thread = **made;
  world::World mirror = copy_of(thread.played().world());
  thread.start();
  PlayRequest pause, request, step;
  pause.kind = PlayRequest::Kind::pause, pause.on = true;
  thread.ask(pause);
  request.edit = box_of({30, 8, 30}, {33, 9, 33}, water);
  thread.ask(request);
  step.kind = PlayRequest::Kind::step;
  LeafValuesMap changes;
  AmountChanges amounts;
  for (int tick = 0; tick < 20; ++tick) {
    thread.wait_for(thread.ask(step), 5);
    thread.take_changes(changes, amounts);
    std::vector<world::LeafWrite> writes;
    for (const auto& [leaf, values] : changes) writes.push_back({leaf, values.data()});
    ASSERT_TRUE(mirror.store.write_leaves(writes).ok());
    amounts.put_into(mirror.store);
  }
  EXPECT_TRUE(thread.stop(0, 0).ok());
  const world::IntLayer* const there = thread.played().world().store.find_int_layer(world::Layer::liquid);
  const world::IntLayer* const here = mirror.store.find_int_layer(world::Layer::liquid);
  ASSERT_NE(there, nullptr);
  ASSERT_NE(here, nullptr);
  EXPECT_GT(there->active_voxels(), 16u);
  EXPECT_EQ(here->leaves(), there->leaves());
  for (const world::LeafPos l : there->leaves()) {
    std::array<int32_t, world::kLeafVoxels> a, b;
    world::LeafMask in_a, in_b;
    there->read_leaf(l, a, in_a), here->read_leaf(l, b, in_b);
    EXPECT_EQ(a, b);
    EXPECT_EQ(in_a, in_b);
  }
}

/// A crate of 2 m in the air or not, and rain behind it or not, as a window would show them.
struct Inhabited : ::testing::TestWithParam<const char*> {
  static Picture picture(bool crate, bool rain) {
    auto played = std::make_unique<PlayedWorld>();
    played->own = std::make_unique<world::World>(small_world());
    world::SimulationRequest& asked = played->own->simulation;
    if (crate) asked.bodies.push_back({.name = "crate", .position = {{32, 8, 32}, {0, 0, 0}}, .size = {2, 2, 2}});
    if (rain)
      asked.particles.push_back({.kind = "smoke", .box = {{26, 9, 26}, {38, 12, 30}}, .per_s = 20000, .brings = {}});
    auto thread = std::move(*SimThread::make(std::move(played), {}));
    world::World mirror = copy_of(thread->played().world());
    thread->start();
    PlayRequest step;
    step.kind = PlayRequest::Kind::step;
    uint64_t last = 0;
    for (int n = 0; n < 4; ++n) last = thread->ask(step);
    thread->wait_for(last, 20);
    PictureMaker maker(std::move(mirror), *thread);
    PictureRequest request;
    request.camera.position = {{32, 9, 40}, {0, 0.5, 0}};
    request.camera.forward = {0, 0, -1};
    request.environment = world::Environment{};
    request.settings.backend = GetParam();
    request.width = 64, request.height = 48;
    maker.begin(request);
    auto made = maker.take(60);
    EXPECT_TRUE(made && made->error.empty());
    return made ? std::move(*made) : Picture{};
  }
  static size_t different(const Picture& a, const Picture& b) {
    size_t count = 0;
    for (size_t i = 0; i < a.rgba.size(); i += 4) count += std::equal(&a.rgba[i], &a.rgba[i + 3], &b.rgba[i]) ? 0 : 1;
    return count;
  }
};

TEST_P(Inhabited, PicturesOfTheWindowShowBodiesAndParticles) {
  const Picture empty = picture(false, false);
  ASSERT_EQ(empty.rgba.size(), size_t{64} * 48 * 4);
  EXPECT_EQ(different(picture(false, false), empty), 0u);
  // 2 m across, 7 m away: 64 pixels are 14 m there or less.
  const size_t crate = different(picture(true, false), empty);
  EXPECT_GT(crate, 50u);
  EXPECT_LT(crate, 400u);
  EXPECT_GT(different(picture(false, true), empty), 50u);
}

INSTANTIATE_TEST_SUITE_P(Backends, Inhabited, ::testing::Values("raster", "raycast"),
                         [](const auto& backend) { return std::string(backend.param); });

TEST(InhabitantRecords, StandBetweenTheLastTwoTicks) {
  world::World world = small_world();
  world.simulation.bodies.push_back({.name = "crate", .position = {{32, 40, 32}, {0, 0, 0}}, .velocity = {8, 0, 0}});
  world.simulation.particles.push_back(
      {.kind = "smoke", .box = {{20, 30, 20}, {20, 30, 20}}, .per_s = 20, .velocity = {0, 3, 0}, .brings = {}});
  auto play = std::move(*PlaySimulation::make(world));
  for (int n = 0; n < 3; ++n) play->step_matter();
  InhabitantRecords records;
  records.take(play->matter(), {0, 0, 0});
  const render::BodyRecord before = records.view().bodies[0];
  play->step_matter();
  records.take(play->matter(), {0, 0, 0});
  const render::BodyRecord now = records.view().bodies[0];
  EXPECT_NEAR(records.view_at(0).bodies[0].x, before.x, 1e-5);
  EXPECT_NEAR(records.view_at(0).bodies[0].y, before.y, 1e-5);
  EXPECT_NEAR(records.view_at(0.5).bodies[0].y, (before.y + now.y) / 2, 1e-5);
  EXPECT_EQ(records.view_at(1).bodies[0].x, now.x);
  ASSERT_FALSE(records.view().particles.empty());
  EXPECT_NE(records.view_at(0).particles[0].y, records.view().particles[0].y);
  EXPECT_EQ(records.view_at(1).particles[0].y, records.view().particles[0].y);
}

TEST(PlayedRain, GoesOnThroughUndoAndStepsBack) {
  world::World world = small_world();
  world.simulation.particles.push_back(
      {.kind = "rain", .box = {{2, 38, 2}, {60, 38, 60}}, .per_s = 2000, .velocity = {0, -8, 0}, .brings = {}});
  auto play = std::move(*PlaySimulation::make(world));
  for (int n = 0; n < 60; ++n) play->step_matter();
  ASSERT_TRUE(play->edit(box_of({40, 8, 40}, {41, 9, 41}, *world.palette->find("glass"))).ok());
  for (int n = 0; n < 20; ++n) play->step_matter();
  const size_t falling = play->matter().particles()->size();
  ASSERT_GT(falling, 1000u);
  ASSERT_TRUE(play->undo());
  EXPECT_EQ(play->matter().particles()->size(), falling);
  for (int n = 0; n < 3; ++n) {
    play->step_matter();
    ASSERT_TRUE(play->step_back());
    EXPECT_GT(play->matter().particles()->size(), falling / 2);
  }
  // They meet what is built from then on.
  ASSERT_TRUE(play->edit(box_of({0, 20, 0}, {63, 20, 63}, *world.palette->find("glass"))).ok());
  for (int n = 0; n < 200; ++n) play->step_matter();
  const sim::Particles& rain = *play->matter().particles();
  for (size_t kind = 0; kind < rain.kinds().size(); ++kind)
    for (const uint32_t index : rain.blocks(static_cast<int>(kind)))
      for (int i = 0; i < rain.block(index).count; ++i)
        ASSERT_GE(rain.origin().y + (rain.block(index).at[1][i] >> sim::kParticleFixedLog2), 20);
}

TEST(SimThread, OnAFullDiskAutosaveSaysSoAndTheWorldIsSavedOnceThereIsRoom) {
  const world::TemporaryFolder folder;
  const std::filesystem::path path = folder / "world.loam";
  auto played = std::make_unique<PlayedWorld>();
  played->path = path;
  played->session = std::move(*world::SaveSession::create(path, small_world(), {.autosave_s = 0}));
  auto thread = std::move(*SimThread::make(std::move(played), {.autosave_s = 0.1, .record = {}}));
  // As a full disk: no file of this process may grow.
  const auto before = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
  rlimit full = limit;
  full.rlim_cur = 1024;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
  PlayRequest request;
  request.edit = sphere_of({30, 20, 30}, 6, *thread->played().world().palette->find("brick_red"));
  thread->start();
  thread->wait_for(thread->ask(request), 5);
  const auto until = [&](auto&& holds) {
    for (int n = 0; n < 1000 && !holds(thread->state()); ++n)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return holds(thread->state());
  };
  const bool said = until([](const PlayState& s) { return s.message.starts_with("the world could not be saved"); });
  // Who leaves now is told, and nothing is given up.
  PlayRequest all;
  all.kind = PlayRequest::Kind::save_all;
  thread->wait_for(thread->ask(all), 5);
  const std::string unsaved = thread->state().unsaved;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  std::signal(SIGXFSZ, before);
  EXPECT_TRUE(said);
  EXPECT_EQ(thread->state().message.find('\n'), std::string::npos);
  EXPECT_FALSE(unsaved.empty());
  thread->wait_for(thread->ask(all), 5);
  EXPECT_EQ(thread->state().unsaved, "");
  EXPECT_TRUE(until([](const PlayState& s) { return s.saves >= 2; }));
  EXPECT_TRUE(until([](const PlayState& s) { return s.message == "the world is saved again"; }));
  ASSERT_TRUE(thread->stop(0, 0).ok());
  const uint64_t hash = thread->played().world().store.content_hash();
  thread.reset();
  auto again = open_world({.scene = path.string(), .generator = {}, .name = {}});
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->played->world().store.content_hash(), hash);
}

TEST(Eye, OpensAtNightAsFarAsLampsAllowAndNeverByDay) {
  render::RenderKnobs knobs;
  const auto stops_at = [&](float hours) {
    knobs.time_of_day = hours;
    std::shared_ptr<const world::SkyLight> kept;
    return stops_of_night(*render::sky_view(world::Environment{}, knobs, kept), knobs.exposure_most);
  };
  EXPECT_EQ(stops_at(-1), 0);
  EXPECT_EQ(stops_at(12), 0);
  EXPECT_GT(stops_at(0), 10);
  knobs.exposure_most = 3;
  EXPECT_EQ(stops_at(0), 3);
  // Dark ground under the moon; and the same with a lamp in a fifth of the picture.
  render::Image dark(64, 64), lamp(64, 64);
  std::fill(dark.pixels.begin(), dark.pixels.end(), render::Rgb{1e-3f, 1e-3f, 1e-3f});
  lamp = dark;
  std::fill(lamp.pixels.begin(), lamp.pixels.begin() + 64 * 64 / 5, render::Rgb{15, 15, 15});
  EXPECT_EQ(Eye().adapt(dark, 0, 0, 1), 0);
  EXPECT_GT(Eye().adapt(dark, 0, 18, 1), 8);
  EXPECT_NEAR(Eye().adapt(lamp, 0, 18, 1), std::log2(0.8 * 150 / 15), 0.1);
  // What a lamp shines on keeps its colour, also where it is a small part of the picture.
  render::Image pool = dark;
  std::fill(pool.pixels.begin(), pool.pixels.begin() + 64 * 64 / 25, render::Rgb{15, 9, 3});
  const double luminance = 0.2126 * 15 + 0.7152 * 9 + 0.0722 * 3;
  EXPECT_NEAR(Eye().adapt(pool, 0, 18, 1), std::log2(0.8 * 150 / luminance), 0.1);
  // Not at once.
  Eye eye;
  const double before = eye.adapt(lamp, 0, 18, 1);
  EXPECT_LT(eye.adapt(dark, 0, 18, 1.1), before + 2);
}

TEST(SimThread, TheWorldIsSavedWhereItEndsAndGoesOnThere) {
  const world::TemporaryFolder folder;
  setenv("LOAM_DATA", (folder / ".").c_str(), 1);
  uint64_t hash = 0;
  std::filesystem::path path;
  {
    auto opened = open_world({.scene = "dam", .generator = {}, .name = {}});
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    path = opened->played->path;
    auto thread = std::move(*SimThread::make(std::move(opened->played), {}));
    thread->start();
    PlayRequest request;
    request.edit = box_of({0, 40, 0}, {1, 40, 1}, world::BlockId{1});
    thread->wait_for(thread->ask(request), 5);
    PlayRequest hour;
    hour.kind = PlayRequest::Kind::knob, hour.name = "time_of_day", hour.value = "21.5";
    thread->wait_for(thread->ask(hour), 5);
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    ASSERT_TRUE(thread->stop(1.5, -0.25).ok());
    hash = thread->played().world().store.content_hash();
  }
  auto again = open_world({.scene = path.string(), .generator = {}, .name = {}});
  ASSERT_TRUE(again.ok()) << again.error().message;
  EXPECT_EQ(again->played->world().store.content_hash(), hash);
  EXPECT_EQ(again->played->world().knobs["time_of_day"], "21.5");
  const Start start = start_of(again->played->world());
  EXPECT_EQ(start.yaw, 1.5);
  EXPECT_EQ(start.pitch, -0.25);
  unsetenv("LOAM_DATA");
}

}  // namespace
}  // namespace tools
