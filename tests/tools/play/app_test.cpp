// The program as a player has it: in a window of Xvfb's, driven by xdotool; and where there is no display at all.
#include <fstream>

#include "tests/tools/command.h"
#include "tools/play/controls.h"

namespace tools {
namespace {

class Play : public Command {};

TEST_F(Play, ASessionInAWindowDoesWhatKeysSayAndItsRecordingRepeats) {
  const std::string script = std::string(LOAM_SOURCE_DIR) + "/tests/tools/play/session.sh";
  const std::string out = folder_ / "session", log = folder_ / "log";
  const int status =
      std::system(("bash '" + script + "' '" LOAM_COMMAND "' '" + out + "' >'" + log + "' 2>&1 </dev/null").c_str());
  const std::string said = slurp(log);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 77) {
    std::cout << said;
    GTEST_SKIP();
  }
  EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 0) << said;
}

TEST_F(Play, WithoutADisplayItSaysSoInOneSentence) {
  expect_one_sentence(run("play valley", "env -u DISPLAY -u WAYLAND_DISPLAY "), 4, "no display");
}

TEST_F(Play, UnknownScenesAndBackendsAndKnobsAreRefused) {
  const std::string data = "LOAM_DATA=" + path("data") + " env -u DISPLAY -u WAYLAND_DISPLAY ";
  expect_one_sentence(run("play valley --backend rastre", data), 2, "raster");
  expect_one_sentence(run("play valley --set view_distanc=3", data), 2, "view_distance");
}

TEST(Readme, ListsAllKeysOfPlay) {
  std::ifstream in(std::string(LOAM_SOURCE_DIR) + "/README.md");
  const std::string readme{std::istreambuf_iterator<char>(in), {}};
  std::string table = "| keys | what they do |\n|---|---|\n";
  const Bindings usual;
  for (const ActionRow& row : action_rows())
    table += "| " + usual.text(row.action) + " | " + std::string(row.what) + " |\n";
  EXPECT_NE(readme.find(table + "\n"), std::string::npos) << "it should have\n" << table;
}

TEST_F(Play, TheManualAndTheCompletionNameEveryVerb) {
  const Outcome manual = run("man"), completion = run("completion");
  for (const char* verb : {"play", "sim", "render", "convert", "replay"}) {
    EXPECT_NE(manual.out.find(std::string(".SS loam ") + verb), std::string::npos) << verb;
    EXPECT_NE(completion.out.find(std::string("    ") + verb + ") flags="), std::string::npos) << verb;
  }
  EXPECT_NE(manual.out.find("Ctrl+Z"), std::string::npos);
}

}  // namespace
}  // namespace tools
