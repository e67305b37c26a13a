#include "tools/recording.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include <nlohmann/json.hpp>

#include "tools/replay.h"
#include "tools/verb.h"
#include "world/saves/save_file.h"
#include "world/scenes/scene.h"

namespace tools {
namespace {

class RecordingFile : public testing::Test {
 protected:
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / ("loam-recording-" + std::to_string(::getpid()) + ".log");
  ~RecordingFile() override { std::filesystem::remove(path_); }
  void write(const std::string& text) { std::ofstream(path_) << text; }
  std::string error_of(const std::string& text) {
    write(text);
    const auto read = read_recording(path_);
    return read.ok() ? "" : read.error().message;
  }
};

int run(std::vector<std::string> words) {
  std::vector<const char*> arguments{"loam"};
  for (const std::string& word : words) arguments.push_back(word.c_str());
  return run_command(static_cast<int>(arguments.size()), arguments.data());
}

TEST_F(RecordingFile, ComesBackAsItWasWritten) {
  Recording recording;
  recording.scene = "dam";
  recording.seed = 7;
  recording.start = 100;
  recording.saved = "dam.loam";
  recording.threads = 3;
  recording.marks = {{116, 0x1234}, {120, ~0ull, {{{-1, 0, 2}, 0x77}, {{0, 0, 0}, 0}}, {{{5, 0, -2}, 0x78}}}};
  ASSERT_TRUE(write_recording(recording, path_).ok());
  const auto back = read_recording(path_);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->scene, "dam");
  EXPECT_EQ(back->seed, 7u);
  ASSERT_EQ(back->marks.size(), 2u);
  EXPECT_EQ(back->marks[1].tick, 120u);
  EXPECT_EQ(back->marks[1].hash, ~0ull);
  EXPECT_EQ(back->marks[1].leaves, recording.marks[1].leaves);
  EXPECT_EQ(back->marks[1].regions, recording.marks[1].regions);
  EXPECT_EQ(back->threads, 3);
  EXPECT_EQ(back->saved, "dam.loam");
}

TEST_F(RecordingFile, SaysInWhichLineItIsWrong) {
  const std::string head = R"({"loam_recording":1,"scene":"dam","seed":1,"start":0,"every":16})"
                           "\n";
  EXPECT_NE(error_of("").find(":1:"), std::string::npos);
  EXPECT_NE(error_of("[1, 2").find(":1: expected one JSON object"), std::string::npos);
  EXPECT_NE(error_of(R"({"loam_recording":4})").find("version 4"), std::string::npos);
  EXPECT_NE(error_of(head + R"({"tick":16,"hash":"12"})").find(":2: expected \"hash\""), std::string::npos);
  EXPECT_NE(error_of(head + R"({"tick":17,"hash":"0000000000000000"})").find("expected a tick in (0, 16]"),
            std::string::npos);
  EXPECT_EQ(error_of(head + R"({"tick":16,"hash":"0000000000000000"})"), "") << "of version 1";
  for (const char* hashes : {R"([1])", R"({"0 0":"0000000000000000"})", R"({"0 0 0 0":"0000000000000000"})",
                             R"({"0 0 0":"12"})", R"({"0 0 0":3})"})
    for (const char* key : {"regions", "leaves"})
      EXPECT_NE(error_of(head + R"({"tick":16,"hash":"0000000000000000",")" + key + "\":" + hashes + "}")
                    .find(":2: expected an object \"" + std::string(key)),
                std::string::npos)
          << hashes;
}

TEST_F(RecordingFile, HashesAloneSayInWhichLeavesARepetitionDiffers) {
  // As another program would have recorded it: one leaf differs from tick 3 on, and one voxel in the saved world.
  const std::string saved = path_.string() + ".loam";
  ASSERT_EQ(
      run({"sim", "hourglass", "--ticks", "6", "--record", path_.string(), "--record-every", "1", "--save", saved}), 0);
  auto recording = read_recording(path_);
  ASSERT_TRUE(recording.ok());
  ASSERT_EQ(recording->marks.size(), 6u);
  EXPECT_EQ(recording->saved, saved);
  ASSERT_FALSE(recording->marks[0].leaves.empty());
  testing::internal::CaptureStdout();
  EXPECT_EQ(run({"replay", path_.string(), "--json"}), 0);
  EXPECT_EQ(nlohmann::json::parse(testing::internal::GetCapturedStdout())["equal"], true);

  recording->marks[2].hash ^= 1;
  const world::LeafPos where = recording->marks[0].leaves.begin()->first;
  recording->marks[2].leaves[where] ^= 1;
  ASSERT_TRUE(write_recording(*recording, path_).ok());
  world::ImportReport report;
  const auto scene = world::load_scene(saved);
  ASSERT_TRUE(scene.ok());
  auto world = world::build_world(*scene, report);
  ASSERT_TRUE(world.ok());
  world::EditBatch batch;
  batch.set({390, 4, 5}, world->palette->find("granite").value());
  ASSERT_TRUE(world->store.apply(batch).ok());
  ASSERT_TRUE(world::write_world(*world, saved).ok());
  testing::internal::CaptureStdout();
  EXPECT_EQ(run({"replay", path_.string(), "--json"}), 1);
  const nlohmann::json json = nlohmann::json::parse(testing::internal::GetCapturedStdout());
  EXPECT_EQ(json["same_until"], 2);
  EXPECT_EQ(json["differs_by"], 3);
  EXPECT_EQ(json["made_again"], false);
  EXPECT_FALSE(json.contains("first"));
  const world::VoxelPos corner = world::voxel_from_leaf(where);
  EXPECT_EQ(json["leaves"], (nlohmann::json{{corner.x, corner.y, corner.z}}));
  EXPECT_EQ(json["at_the_end"]["differing"], 1);
  EXPECT_EQ(json["at_the_end"]["first"][0]["position"], (nlohmann::json{390, 4, 5}));
  std::filesystem::remove(saved);
}

TEST_F(RecordingFile, ARecordingOfVersion2SaysInWhichRegionsARepetitionDiffers) {
  ASSERT_EQ(run({"sim", "hourglass", "--ticks", "6", "--record", path_.string(), "--record-every", "1"}), 0);
  auto recording = read_recording(path_);
  ASSERT_TRUE(recording.ok());
  for (Recording::Mark& mark : recording->marks) {
    // All leaves of each are new or changed ones, as in the first mark.
    mark.regions = region_hashes(mark.leaves);
    mark.leaves.clear();
  }
  recording->marks.resize(1);
  const world::RegionPos where = recording->marks[0].regions.begin()->first;
  recording->marks[0].hash ^= 1;
  recording->marks[0].regions[where] ^= 1;
  ASSERT_TRUE(write_recording(*recording, path_).ok());
  testing::internal::CaptureStdout();
  EXPECT_EQ(run({"replay", path_.string(), "--json"}), 1);
  const nlohmann::json json = nlohmann::json::parse(testing::internal::GetCapturedStdout());
  EXPECT_EQ(json["regions"], (nlohmann::json{{where.x, where.y, where.z}}));
  EXPECT_FALSE(json.contains("leaves"));
}

TEST_F(RecordingFile, APlantedVoxelIsFoundAtItsTickWithWhatWasExpectedThere) {
  Recording recording;
  recording.scene = "dam";
  auto a = SimRun::make(recording, 1), b = SimRun::make(recording, 2);
  ASSERT_TRUE(a.ok() && b.ok());
  ASSERT_FALSE(first_difference(**a, **b, 5).has_value());
  // Within the tick that follows on 9 of them.
  constexpr world::VoxelPos kWhere{-61, 3, 2};
  const std::string there = (*(*b)->world().palette)[(*b)->world().store.get(kWhere)].name;
  world::EditBatch batch;
  batch.set(kWhere, (*a)->world().palette->find("granite").value());
  ASSERT_TRUE((*a)->matter().edit(batch, {.tick = 9, .serial = 0}).ok());
  const auto found = first_difference(**a, **b, 40);
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->tick, 10u);
  const auto planted = std::find_if(found->where.first.begin(), found->where.first.end(),
                                    [&](const VoxelDifference& d) { return d.pos == kWhere; });
  ASSERT_NE(planted, found->where.first.end());
  EXPECT_EQ(planted->a, "granite");
  EXPECT_EQ(planted->b, there);
}

TEST_F(RecordingFile, ARepetitionWithAnotherSettingNamesTheFirstTickAndVoxelThatItChanges) {
  // The hourglass's sand knows nothing of passes of liquids; the dam's water does.
  const std::string set = "liquid_passes=2";
  ASSERT_EQ(run({"sim", "hourglass", "--ticks", "20", "--record", path_.string()}), 0);
  EXPECT_EQ(run({"replay", path_.string(), "--set", set}), 0);
  ASSERT_EQ(run({"sim", "dam", "--ticks", "40", "--record", path_.string(), "-t", "1"}), 0);
  testing::internal::CaptureStdout();
  EXPECT_EQ(run({"replay", path_.string(), "--set", set, "--json"}), 1);
  const nlohmann::json json = nlohmann::json::parse(testing::internal::GetCapturedStdout());
  EXPECT_EQ(json["same_until"], 0);
  EXPECT_EQ(json["differs_by"], 16);
  EXPECT_EQ(json["made_again"], true);

  // Found here without a recording: both runs, tick by tick.
  Recording recording;
  recording.scene = "dam";
  auto usual = SimRun::make(recording, 1), other = SimRun::make(recording, 1, {set});
  ASSERT_TRUE(usual.ok() && other.ok());
  uint64_t tick = 0;
  do {
    ++tick;
    (*usual)->step_to(tick), (*other)->step_to(tick);
  } while ((*usual)->matter().state_hash() == (*other)->matter().state_hash());
  const auto& first = json["first"];
  EXPECT_EQ(first["tick"], tick);
  const world::VoxelPos at{first["voxel"][0], first["voxel"][1], first["voxel"][2]};
  ASSERT_EQ(first["of"], "block");
  const auto name = [&](SimRun& of) { return (*of.world().palette)[of.world().store.get(at)].name; };
  EXPECT_EQ(first["expected"], name(**usual));
  EXPECT_EQ(first["found"], name(**other));
  EXPECT_NE(name(**usual), name(**other));
}

TEST_F(RecordingFile, ARunThatIsResumedIsTheRunThatNeverStopped) {
  const std::string whole = path_.string() + ".whole.loam", parts = path_.string() + ".parts.loam";
  ASSERT_EQ(run({"sim", "lava_meets_sea", "--ticks", "24", "--save", whole}), 0);
  for (const char* ticks : {"9", "17", "24", "24"})
    ASSERT_EQ(run({"sim", "lava_meets_sea", "--ticks", ticks, "--resume", parts}), 0);
  testing::internal::CaptureStdout();
  EXPECT_EQ(run({"diff", whole, parts, "--equal", "--json"}), 0);
  EXPECT_EQ(nlohmann::json::parse(testing::internal::GetCapturedStdout())["equal"], true);
  EXPECT_EQ(run({"sim", "dam", "--ticks", "3", "--resume", parts, "--save", whole}), 2);
  std::filesystem::remove(whole), std::filesystem::remove(parts);
}

TEST_F(RecordingFile, AReplayIsEqualAndAChangedHashIsFound) {
  ASSERT_EQ(run({"sim", "hourglass", "--ticks", "40", "--record", path_.string()}), 0);
  EXPECT_EQ(run({"replay", path_.string(), "-t", "1"}), 0);
  auto recording = read_recording(path_);
  ASSERT_TRUE(recording.ok());
  ASSERT_EQ(recording->marks.size(), 3u);
  recording->marks[1].hash ^= 1;
  ASSERT_TRUE(write_recording(*recording, path_).ok());
  EXPECT_EQ(run({"replay", path_.string()}), 1);
}

}  // namespace
}  // namespace tools
