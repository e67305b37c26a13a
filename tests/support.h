/// What many tests need: the shared real files, and temporary folders.
#pragma once

#include <filesystem>
#include <iostream>
#include <optional>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

namespace world {

/// The path of a file in ../shared/data, or nothing (and one printed line) where it is missing.
inline std::optional<std::filesystem::path> shared_data(const std::string& name) {
  const std::filesystem::path path = std::filesystem::path(LOAM_SOURCE_DIR) / "../shared/data" / name;
  if (std::filesystem::exists(path)) return path;
  std::cout << "skipped: ../shared/data/" << name << " is not on this machine\n";
  return std::nullopt;
}

/// A folder that is removed at the end of the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "loam-test-XXXXXX").string();
    if (!mkdtemp(name.data())) std::abort();
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace world
