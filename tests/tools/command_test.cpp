// What a user sees of bad input: one clear sentence on stderr, the exit code of design section 7, nothing half written.
#include <map>

#include <nlohmann/json.hpp>

#include "tests/tools/command.h"

namespace tools {
namespace {

TEST_F(Command, HelpAndVersionAreFine) {
  EXPECT_EQ(run("--help").code, 0);
  EXPECT_EQ(run("render --help").code, 0);
  EXPECT_NE(run("--version").out.find("loam"), std::string::npos);
}

TEST_F(Command, WrongUseExitsWithTwo) {
  EXPECT_EQ(run("").code, 2);
  EXPECT_EQ(run("fly").code, 2);
  EXPECT_EQ(run("render").code, 2);
  expect_one_sentence(run("render valley --backend mesh -o " + path("a.png")), 2, "mesh");
  expect_one_sentence(run("render valley --size 0x0 --backend raycast -o " + path("a.png")), 2, "--size");
  expect_one_sentence(run("render valley --backend raycast -o " + path("a.bmp")), 2, ".png");
  expect_one_sentence(run("render cube --set sun_shadows=none --backend raycast -o " + path("a.png")), 2,
                      "did you mean");
  expect_one_sentence(run("render cube --set sun_shadow=some --backend raycast -o " + path("a.png")), 2,
                      "none sky_light map ray");
  expect_one_sentence(run("render cube --sun_shadow=some --backend raycast -o " + path("a.png")), 2,
                      "none sky_light map ray");
  expect_one_sentence(run("render cube --camera nowhere --backend raycast -o " + path("a.png")), 2, "nowhere");
  EXPECT_FALSE(exists("a.png"));
}

TEST_F(Command, AMissingFileAndAnUnknownSceneAreNamed) {
  expect_one_sentence(run("info " + path("none.loam")), 3, "none.loam");
  expect_one_sentence(run("render valey --backend raycast -o " + path("a.png")), 3, "did you mean \"valley\"");
  expect_one_sentence(run("convert " + path("none.vox") + " " + path("out.loam")), 3, "none.vox");
  EXPECT_FALSE(exists("out.loam"));
}

TEST_F(Command, EmptyTruncatedAndWrongFilesAreRefusedAndNothingIsLeft) {
  const std::string kinds[] = {"vox", "hgt", "hgt.zip", "vdb", "loam"};
  for (const std::string& kind : kinds) {
    for (const std::string& content :
         {std::string(), std::string("VOX "), std::string(5000, 'x'), std::string(200, '\0')}) {
      write("N42E001." + kind, content);
      const Outcome outcome = run("convert " + path("N42E001." + kind) + " " + path("out.loam"));
      expect_one_sentence(outcome, 3, "N42E001." + kind);
      EXPECT_FALSE(exists("out.loam")) << kind;
    }
    std::filesystem::remove(folder_ / ("N42E001." + kind));
  }
  EXPECT_EQ(files(), 2u);  // stdout and stderr only: no temporary file stays
}

TEST_F(Command, SmoothSurfacesOfLevelSetsAreWrittenAndWhatHasNoneIsTold) {
  const std::string out = path("out.ply");
  expect_one_sentence(run("convert cube " + out + " --surface marching_cubes"), 3, "no level set and no density");
  expect_one_sentence(run("convert cube " + path("out.loam") + " --surface blocks"), 2, ".glb");
  expect_one_sentence(run("convert cube " + out + " --surface blocks --adaptivity 0.5"), 2, "openvdb");
  EXPECT_NE(run("convert cube " + out + " --surface smoothest").code, 0);
  EXPECT_FALSE(exists("out.ply"));
  const auto file = world::shared_data("vdb/sphere.vdb");
  if (!file) GTEST_SKIP();
  for (const char* method : {"blocks", "surface_nets", "marching_cubes", "marching_tetrahedra", "openvdb"}) {
    const Outcome outcome = run("convert '" + file->string() + "' " + out + " --surface " + method);
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    EXPECT_EQ(slurp(folder_ / "out.ply").substr(0, 3), "ply");
  }
}

TEST_F(Command, AnUnknownExtensionSaysWhatCanBeRead) {
  write("a.xyz", "hello");
  const Outcome outcome = run("convert " + path("a.xyz") + " " + path("out.loam"));
  expect_one_sentence(outcome, 3, ".vox");
  expect_one_sentence(run("convert " + path("a.xyz") + " " + path("out.xyz")), 2, ".loam");
}

TEST_F(Command, ASceneWithAnUnknownKeyNamesFileLineColumnAndTheNearestKey) {
  write("a.toml", "what = \"x\"\n[world]\ngenerator = \"flat\"\nsede = 3\nsize = [8, 8, 8]\n");
  const Outcome outcome = run("render " + path("a.toml") + " --backend raycast -o " + path("a.png"));
  expect_one_sentence(outcome, 3, "a.toml:4:1");
  EXPECT_NE(outcome.error.find("seed"), std::string::npos) << outcome.error;
}

TEST_F(Command, ASceneWithASyntaxErrorNamesTheLine) {
  write("a.toml", "[world]\ngenerator = \n");
  expect_one_sentence(run("info " + path("a.toml")), 3, "a.toml:2");
}

TEST_F(Command, ASceneTooLargeForMemoryIsRefused) {
  write("a.toml", "[world]\ngenerator = \"flat\"\nsize = [1000000000, 200, 1000000000]\n");
  expect_one_sentence(run("info " + path("a.toml")), 3, "regions");
}

TEST_F(Command, AnOutputThatCannotBeWrittenIsSaidAndLeavesNothing) {
  write("file", "");
  const std::string inside_a_file = "'" + (folder_ / "file").string() + "/out";
  expect_one_sentence(run("render cube --backend raycast --size 64x64 -o " + inside_a_file + ".png'"), 3, "out.png");
  expect_one_sentence(run("render cube --backend raycast --size 64x64 -o " + inside_a_file + ".exr'"), 3, "out.exr");
  EXPECT_EQ(files(), 3u);
}

TEST_F(Command, AFullDiskIsSaidAndLeavesNothing) {
  // A limit of 4 KiB a file stands for the full disk; the shell ignores its signal, so writes fail as they would.
  const std::string limit = "trap '' XFSZ; ulimit -f 8; ";
  write("a.toml", "[world]\ngenerator = \"random\"\nsize = [128, 64, 128]\n");
  const Outcome save = run("convert " + path("a.toml") + " " + path("out.loam"), limit);
  EXPECT_EQ(save.code, 3) << save.error;
  EXPECT_FALSE(exists("out.loam"));
  const Outcome picture = run("render cube --backend raycast --size 640x360 -o " + path("a.exr"), limit);
  expect_one_sentence(picture, 3, "a.exr");
  EXPECT_FALSE(exists("a.exr"));
  EXPECT_EQ(files(), 3u);
}

TEST_F(Command, NotAVoxIsRefused) {
  const auto file = world::shared_data("vox/not_a.vox");
  if (!file) GTEST_SKIP();
  const Outcome outcome = run("convert '" + file->string() + "' " + path("out.loam"));
  expect_one_sentence(outcome, 3, "not_a.vox");
  EXPECT_FALSE(exists("out.loam"));
}

TEST_F(Command, InfoAndConvertSayTheKeysThatOthersRelyOn) {
  const Outcome info = run("info cube --json");
  ASSERT_EQ(info.code, 0) << info.error;
  const auto j = nlohmann::json::parse(info.out);
  for (const char* key : {"voxels", "census", "unmapped", "bounds", "bytes_memory", "bytes_disk", "bytes_per_m3_memory",
                          "layers", "effects", "rules"})
    EXPECT_TRUE(j.contains(key)) << key;
  const Outcome render = run("render cube --json --backend raycast --size 32x32 -o " + path("a.png"));
  ASSERT_EQ(render.code, 0) << render.error;
  const auto r = nlohmann::json::parse(render.out);
  for (const char* key : {"ms", "rays", "faces_drawn", "passes", "device", "effects"})
    EXPECT_TRUE(r.contains(key)) << key;
  EXPECT_GE(r["rays"].get<int>(), 32 * 32);
}

TEST_F(Command, InfoListsEachRuleOfMatterWithWhatCallsForIt) {
  const Outcome info = run("info burning_house --json");
  ASSERT_EQ(info.code, 0) << info.error;
  std::map<std::string, nlohmann::json> rules;
  const auto j = nlohmann::json::parse(info.out);
  for (const auto& rule : j["rules"]) {
    rules[rule["name"]] = rule;
    for (const char* key : {"why", "what", "layers", "conserves"})
      EXPECT_FALSE(rule[key].get<std::string>().empty()) << rule["name"] << " " << key;
  }
  EXPECT_GE(rules.size(), 9u);
  EXPECT_TRUE(rules.at("fire")["called_for"].get<bool>());
  EXPECT_EQ(rules.at("fire")["why"], "fire, 1 voxels");
  EXPECT_FALSE(rules.at("gas")["called_for"].get<bool>()) << "smoke comes with the fire";
  EXPECT_FALSE(rules.at("growth")["called_for"].get<bool>());
  EXPECT_NE(run("info dam --effects").out.find("liquid           yes  water"), std::string::npos);
}

TEST_F(Command, APictureBySamplesSaysWhatItTookAndGoesOn) {
  const std::string common = "render cube --json --backend reference --size 24x16 --seed 3 ";
  const auto at_once = nlohmann::json::parse(run(common + "--spp 9 -o " + path("a.exr")).out);
  for (const char* key : {"ms", "rays", "spp", "relative_error", "nan_samples", "work", "effects", "passes"})
    EXPECT_TRUE(at_once.contains(key)) << key;
  EXPECT_EQ(at_once["spp"], 9);
  EXPECT_EQ(at_once["nan_samples"], 0);
  EXPECT_EQ(run(common + "--spp 4 --resume " + path("film") + " -o " + path("b.exr")).code, 0);
  EXPECT_EQ(run(common + "--spp 9 --resume " + path("film") + " -o " + path("b.exr")).code, 0);
  const auto same = nlohmann::json::parse(run("diff --json " + path("a.exr") + " " + path("b.exr")).out);
  EXPECT_EQ(same["equal"], true);
  expect_one_sentence(
      run("render cube --backend reference --size 24x16 --seed 4 --resume " + path("film") + " -o " + path("b.exr")), 3,
      "holds samples of another picture");
  expect_one_sentence(run("render cube --backend reference --spp 0 -o " + path("a.exr")), 2, "spp");
}

TEST_F(Command, ConvertingTwiceGivesTheSameWorld) {
  const auto file = world::shared_data("vox/monu6.vox");
  if (!file) GTEST_SKIP();
  const Outcome first = run("convert --json '" + file->string() + "' " + path("a.loam"));
  ASSERT_EQ(first.code, 0) << first.error;
  EXPECT_EQ(nlohmann::json::parse(first.out)["voxels"], 365232);
  ASSERT_EQ(run("convert " + path("a.loam") + " " + path("b.vdb")).code, 0);
  ASSERT_EQ(run("convert " + path("b.vdb") + " " + path("c.loam")).code, 0);
  const auto hash = [&](const char* name) {
    return nlohmann::json::parse(run(std::string("info --json ") + path(name)).out)["hash"];
  };
  EXPECT_EQ(hash("a.loam"), hash("b.vdb"));
  EXPECT_EQ(hash("a.loam"), hash("c.loam"));
}

}  // namespace
}  // namespace tools
