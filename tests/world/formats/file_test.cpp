#include <fstream>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/support.h"
#include "world/formats/format.h"

namespace world {
namespace {

std::string text_of(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  return bytes ? std::string(bytes->begin(), bytes->end()) : "error: " + bytes.error().message;
}

size_t files_in(const std::filesystem::path& folder) {
  return static_cast<size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(File, WhatIsWrittenIsReadBack) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_bytes_atomically(folder / "a.txt", "hello"));
  EXPECT_EQ(text_of(folder / "a.txt"), "hello");
  ASSERT_TRUE(write_bytes_atomically(folder / "a.txt", ""));
  EXPECT_EQ(text_of(folder / "a.txt"), "");
  EXPECT_EQ(files_in(folder / ""), 1u);
}

TEST(File, AFailedWriteLeavesTheOldFileAndNothingElse) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_bytes_atomically(folder / "a.txt", "old"));
  const Status status = write_file_atomically(folder / "a.txt", [](const std::filesystem::path& temporary) -> Status {
    std::ofstream(temporary) << "half";
    return input_error("the disk is full");
  });
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().message, "the disk is full");
  EXPECT_EQ(text_of(folder / "a.txt"), "old");
  EXPECT_EQ(files_in(folder / ""), 1u);
}

TEST(File, TheTemporaryFileLiesBesideTheTargetAndKeepsItsExtension) {
  const TemporaryFolder folder;
  const Status status = write_file_atomically(folder / "a.vdb", [&](const std::filesystem::path& temporary) -> Status {
    EXPECT_EQ(temporary.parent_path(), (folder / "a.vdb").parent_path());
    EXPECT_EQ(temporary.extension(), ".vdb");
    EXPECT_NE(temporary, folder / "a.vdb");
    std::ofstream(temporary) << "x";
    return {};
  });
  EXPECT_TRUE(status);
}

TEST(File, ReplacingKeepsThePermissionsOfTheOldFile) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_bytes_atomically(folder / "a.txt", "old"));
  ASSERT_EQ(::chmod((folder / "a.txt").c_str(), 0640), 0);
  ASSERT_TRUE(write_bytes_atomically(folder / "a.txt", "new"));
  struct stat status {};
  ASSERT_EQ(::stat((folder / "a.txt").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0640u);
}

TEST(File, ErrorsNameThePathAndTheReason) {
  const TemporaryFolder folder;
  const auto expect_error = [](const std::string& message, const std::string& path, const std::string& reason) {
    EXPECT_NE(message.find(path), std::string::npos) << message;
    EXPECT_NE(message.find(reason), std::string::npos) << message;
  };
  expect_error(read_file(folder / "none").error().message, "none", "No such file");
  expect_error(read_file(folder / "").error().message, (folder / "").string(), "folder");
  expect_error(write_bytes_atomically(folder / "no/where.txt", "x").error().message, "where.txt", "No such file");
  expect_error(write_bytes_atomically("/proc/x.txt", "x").error().message, "/proc/x.txt", "cannot");
  expect_error(write_bytes_atomically(folder / "", "x").error().message, (folder / "").string(), "folder");
  ASSERT_TRUE(write_bytes_atomically(folder / "big", "12345"));
  expect_error(read_file(folder / "big", 4).error().message, "big", "5 bytes");
}

TEST(Formats, AnUnknownKindNamesWhatIsReadable) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_bytes_atomically(folder / "a.unknown", "nothing known"));
  const auto reading = format_for_reading(folder / "a.unknown");
  ASSERT_FALSE(reading);
  EXPECT_NE(reading.error().message.find("a.unknown"), std::string::npos);
  for (const Format& format : formats()) {
    if (!format.read) continue;
    EXPECT_NE(reading.error().message.find(format.extensions.front()), std::string::npos) << format.name;
  }
  const auto writing = format_for_writing(folder / "a.unknown");
  ASSERT_FALSE(writing);
  EXPECT_EQ(writing.error().kind, ErrorKind::usage);
}

TEST(Formats, EachHasANameAnExtensionAndAPurpose) {
  for (const Format& format : formats()) {
    EXPECT_FALSE(format.name.empty());
    EXPECT_FALSE(format.what.empty()) << format.name;
    EXPECT_TRUE(format.read || format.write) << format.name;
    ASSERT_FALSE(format.extensions.empty()) << format.name;
    for (const std::string& extension : format.extensions) EXPECT_EQ(extension.front(), '.') << format.name;
  }
}

}  // namespace
}  // namespace world
