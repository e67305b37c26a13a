#include "tools/recording.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tools/verb.h"

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
  recording.marks = {{116, 0x1234}, {120, ~0ull}};
  ASSERT_TRUE(write_recording(recording, path_).ok());
  const auto back = read_recording(path_);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->scene, "dam");
  EXPECT_EQ(back->seed, 7u);
  ASSERT_EQ(back->marks.size(), 2u);
  EXPECT_EQ(back->marks[1].tick, 120u);
  EXPECT_EQ(back->marks[1].hash, ~0ull);
}

TEST_F(RecordingFile, SaysInWhichLineItIsWrong) {
  const std::string head = R"({"loam_recording":1,"scene":"dam","seed":1,"start":0,"every":16})"
                           "\n";
  EXPECT_NE(error_of("").find(":1:"), std::string::npos);
  EXPECT_NE(error_of("[1, 2").find(":1: expected one JSON object"), std::string::npos);
  EXPECT_NE(error_of(R"({"loam_recording":2})").find("version 2"), std::string::npos);
  EXPECT_NE(error_of(head + R"({"tick":16,"hash":"12"})").find(":2: expected \"hash\""), std::string::npos);
  EXPECT_NE(error_of(head + R"({"tick":17,"hash":"0000000000000000"})").find("expected a tick in (0, 16]"),
            std::string::npos);
  EXPECT_EQ(error_of(head + R"({"tick":16,"hash":"0000000000000000"})"), "");
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
