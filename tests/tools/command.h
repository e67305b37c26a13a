/// Runs the program itself, as a user does.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <sys/wait.h>

#include "tests/support.h"

namespace tools {

struct Outcome {
  int code = -1;
  std::string out, error;
};

inline std::string slurp(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class Command : public ::testing::Test {
 protected:
  /// Runs `loam ARGUMENTS` under a shell, so that a test may set limits before it.
  Outcome run(const std::string& arguments, const std::string& before = "") {
    const std::string out = folder_ / "stdout", error = folder_ / "stderr";
    const std::string line =
        before + "'" LOAM_COMMAND "' " + arguments + " >'" + out + "' 2>'" + error + "' </dev/null";
    const int status = std::system(line.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, slurp(out), slurp(error)};
  }
  void expect_one_sentence(const Outcome& outcome, int code, const std::string& holds) {
    EXPECT_EQ(outcome.code, code) << outcome.error;
    EXPECT_NE(outcome.error.find(holds), std::string::npos) << "expected \"" << holds << "\" in: " << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  }
  std::string path(const std::string& name) { return "'" + (folder_ / name).string() + "'"; }
  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  bool exists(const std::string& name) { return std::filesystem::exists(folder_ / name); }
  size_t files() {
    size_t n = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_ / ".")) ++n;
    return n;
  }
  world::TemporaryFolder folder_;
};

}  // namespace tools
