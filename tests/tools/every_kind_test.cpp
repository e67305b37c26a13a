// Every kind of file on every verb: what a user sees of bad input, of what a file holds, and of what a conversion
// loses.
#include <set>

#include <nlohmann/json.hpp>

#include "tests/tools/command.h"
#include "world/formats/format.h"

namespace tools {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::vector<std::string> readable_extensions() {
  std::vector<std::string> all;
  for (const world::Format& format : world::formats())
    if (format.read) all.insert(all.end(), format.extensions.begin(), format.extensions.end());
  return all;
}

/// The smallest file of ../shared/data with that extension, but for the one that is meant to be wrong.
std::optional<fs::path> smallest_file(const std::string& extension) {
  std::optional<fs::path> best;
  std::error_code none;
  for (fs::recursive_directory_iterator it(fs::path(world::kSourceFolder) / "../shared/data", none), end;
       !none && it != end; it.increment(none)) {
    const std::string name = it->path().filename();
    if (!it->is_regular_file() || !name.ends_with(extension) || name == "not_a.vox") continue;
    if (it->path().string().find("/gt/") != std::string::npos) continue;
    if (!best || it->file_size() < fs::file_size(*best)) best = it->path();
  }
  return best;
}

class EveryKind : public Command {};

TEST_F(EveryKind, BadInputIsOneSentenceOnEveryVerbAndLeavesNothing) {
  for (const std::string& extension : readable_extensions()) {
    SCOPED_TRACE(extension);
    const std::string name = "N42E001" + extension;  // a name that elevation tiles need
    const std::string contents[] = {std::string(5000, 'x'), std::string(300, '\0')};
    for (const std::string& content : contents) {
      write(name, content);
      for (const std::string& verb : {"info " + path(name), "convert " + path(name) + " " + path("out.loam"),
                                      "convert --json " + path(name) + " " + path("out.vox"),
                                      "render --backend raycast --size 16x16 " + path(name) + " -o " + path("out.png"),
                                      "diff " + path(name) + " " + path(name), "check " + path(name)}) {
        SCOPED_TRACE(verb + " of " + std::to_string(content.size()) + " bytes");
        // Pictures are read by `diff` as pictures, and `check` is for saves alone: both name the file all the same.
        const Outcome outcome = run(verb);
        expect_one_sentence(outcome, 3, name);
        EXPECT_TRUE(outcome.out.empty()) << outcome.out;
        for (const char* left : {"out.loam", "out.vox", "out.png"}) EXPECT_FALSE(exists(left)) << left;
      }
    }
    fs::remove(folder_ / name);
  }
  EXPECT_EQ(files(), 2u) << "no temporary file stays";
}

TEST_F(EveryKind, InfoSaysBoundsCensusMaterialsAndBytesBesideWhatElseTheyWouldBe) {
  int kinds = 0;
  for (const std::string& extension : readable_extensions()) {
    const auto file = smallest_file(extension);
    if (!file) continue;
    SCOPED_TRACE(file->string());
    ++kinds;
    const Outcome text = run("info '" + file->string() + "'");
    ASSERT_EQ(text.code, 0) << text.error;
    for (const char* row :
         {"voxels ", "bounds ", "in memory ", "on disk ", "a byte/m3", "432 bytes a voxel", "census", "layers"})
      EXPECT_NE(text.out.find(row), std::string::npos) << row << " in " << text.out;
    const Outcome outcome = run("info --json '" + file->string() + "'");
    ASSERT_EQ(outcome.code, 0) << outcome.error;
    const json j = json::parse(outcome.out);
    EXPECT_EQ(j["bytes_disk"], fs::file_size(*file));
    EXPECT_EQ(j["materials"].size(), j["census"].size());
    uint64_t voxels = 0;
    for (const auto& [block, count] : j["census"].items()) voxels += count.get<uint64_t>();
    EXPECT_EQ(j["voxels"], voxels);
    EXPECT_EQ(j["bytes_if_triangle_list"], 432.0 * static_cast<double>(voxels));
    if (voxels == 0) {
      EXPECT_TRUE(j["bounds"].is_null());
      continue;
    }
    double volume = 1;
    for (size_t axis = 0; axis < 3; ++axis)
      volume *= j["bounds"]["max"][axis].get<double>() - j["bounds"]["min"][axis].get<double>() + 1;
    EXPECT_EQ(j["bytes_if_a_byte_per_m3"], volume);
    EXPECT_NEAR(j["bytes_per_m3_memory"].get<double>(), j["bytes_memory"].get<double>() / volume, 1e-9);
  }
  if (kinds == 0) GTEST_SKIP();
}

TEST_F(EveryKind, ConvertSaysWhatTheFormatCannotHoldAndStrictRefusesIt) {
  for (const char* extension : {".vox", ".vdb", ".nvdb", ".schem", ".obj", ".ply", ".glb", ".png"}) {
    SCOPED_TRACE(extension);
    const std::string out = "a" + std::string(extension);
    const Outcome strict = run("convert --strict nightclub " + path(out));
    expect_one_sentence(strict, 3, out);
    EXPECT_FALSE(exists(out));
    const Outcome text = run("convert nightclub " + path(out));
    ASSERT_EQ(text.code, 0) << text.error;
    EXPECT_NE(text.out.find("not in "), std::string::npos) << text.out;
    EXPECT_NE(text.out.find("luminaire"), std::string::npos) << text.out;
    const Outcome as_json = run("convert --json nightclub " + path(out));
    ASSERT_EQ(as_json.code, 0) << as_json.error;
    EXPECT_FALSE(json::parse(as_json.out)["lost"].empty());
  }
}

TEST_F(EveryKind, ASaveOfASceneLosesNothingAndGivesItsPicture) {
  const Outcome converted = run("convert --strict --json nightclub " + path("a.loam"));
  ASSERT_EQ(converted.code, 0) << converted.error;
  EXPECT_TRUE(json::parse(converted.out)["lost"].empty());
  const std::string how = " --backend reference --size 24x16 --spp 2 --seed 5 -o ";
  ASSERT_EQ(run("render nightclub" + how + path("scene.exr")).code, 0);
  ASSERT_EQ(run("render " + path("a.loam") + how + path("save.exr")).code, 0);
  const Outcome same = run("diff --json " + path("scene.exr") + " " + path("save.exr"));
  ASSERT_EQ(same.code, 0) << same.error;
  EXPECT_EQ(json::parse(same.out)["equal"], true);
}

}  // namespace
}  // namespace tools
