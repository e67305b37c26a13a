/// The arrows of the map: which folder may include which. A new arrow is a visible edit of kModules.
/// And what no file may do: change how floating point rounds, or draw OpenVDB's or Vulkan's headers in elsewhere.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace {

/// A part of the tree; the longest prefix that fits a path names its module.
struct Module {
  std::string_view prefix;
  std::vector<std::string_view> may_include;  // prefixes of modules; a module may always include itself
};

const std::vector<Module>& modules() {
  static const std::vector<Module> table = [] {
    std::vector<Module> t;
    // Inside world, each module sees those before it: base <- numbers <- ... <- store <- world.h.
    std::vector<std::string_view> below;
    for (std::string_view prefix :
         {"world/base/", "world/numbers/", "world/units/", "world/space/", "world/blocks/", "world/luminaires/",
          "world/media/", "world/meshes/", "world/proxies/", "world/scenes/camera.", "world/scenes/clouds.",
          "world/scenes/cloud_limits.", "world/scenes/environment.", "world/scenes/linear_sky.", "world/scenes/sky.",
          "world/scenes/simulation_request.", "world/store/", "world/world.", "world/saves/"}) {
      t.push_back({prefix, below});
      below.push_back(prefix);
    }
    // Siblings: where a world comes from. Neither sees the other; formats that hold surfaces or points use sources.
    t.push_back({"world/gen/", below});
    t.push_back({"world/sources/", below});
    std::vector<std::string_view> of_formats = below;
    of_formats.push_back("world/sources/");
    t.push_back({"world/formats/", of_formats});
    below.insert(below.end(), {"world/gen/", "world/sources/", "world/formats/"});
    t.push_back({"world/scenes/", below});
    t.push_back({"world/streaming/", below});
    below.insert(below.end(), {"world/scenes/", "world/streaming/"});

    t.push_back({"sim/", below});
    // Inside render: what a picture is, then what all backends share, then the backends, which never see each other;
    // only backends.cpp, which lists them, sees all.
    std::vector<std::string_view> picture = below;
    for (std::string_view prefix : {"render/gpu/", "render/image/", "render/bsdf/"}) {
      t.push_back({prefix, below});
      picture.push_back(prefix);
    }
    t.push_back({"render/", picture});  // backend.h, camera.h, knobs, shading: the files of the folder itself
    picture.push_back("render/");
    for (std::string_view prefix : {"render/extract/", "render/effects/"}) t.push_back({prefix, picture});
    picture.insert(picture.end(), {"render/extract/", "render/effects/"});
    t.push_back({"render/light/", picture});  // light on visible faces, for all backends
    picture.push_back("render/light/");
    t.push_back({"render/export/", picture});  // surfaces for other programs; no backend sees it
    t.push_back({"render/trace/", picture});   // what both ray backends share
    picture.push_back("render/trace/");
    for (std::string_view prefix : {"render/raster/", "render/raycast/", "render/reference/"})
      t.push_back({prefix, picture});
    picture.insert(picture.end(), {"render/raster/", "render/raycast/", "render/reference/"});
    t.push_back({"render/backends.cpp", picture});
    below = picture;
    below.push_back("render/export/");
    below.insert(below.end(), {"render/backends.cpp", "sim/"});
    t.push_back({"tools/", below});
    below.push_back("tools/");
    t.push_back({"tests/", below});
    return t;
  }();
  return table;
}

const Module* module_of(std::string_view path) {
  const Module* found = nullptr;
  for (const Module& m : modules())
    if (path.starts_with(m.prefix) && (!found || m.prefix.size() > found->prefix.size())) found = &m;
  return found;
}

struct Include {
  std::string file, target;  // as written between the quotes or brackets
  bool quoted = true;
};

/// Files that may include headers of a costly or confined library.
struct Confined {
  std::string_view library;
  std::vector<std::string_view> where;  // prefixes
};
const std::vector<Confined> kConfined = {
    {"openvdb/", {"world/store/", "world/formats/vdb.cpp", "world/formats/vdb/", "tools/bench/rivals/", "tests/"}},
    {"nanovdb/", {"world/formats/vdb/", "tools/bench/rivals/"}},
    {"embree3/", {"render/trace/", "tools/bench/rivals/"}},
    {"vulkan/", {"render/", "tests/render/"}},
    {"volk.h", {"render/"}},
    {"sqlite3.h", {"world/saves/", "world/formats/", "tools/bench/rivals/", "tests/"}},
};

std::vector<std::string> violations(const std::vector<Include>& includes) {
  std::vector<std::string> found;
  for (const Include& i : includes) {
    const std::string line = i.file + " includes " + i.target;
    for (const Confined& c : kConfined) {
      if (!std::string_view(i.target).starts_with(c.library)) continue;
      bool allowed = std::any_of(c.where.begin(), c.where.end(), [&](auto w) { return i.file.starts_with(w); });
      // Of the headers only these, which only the store's own files and the .vdb format include, pay for OpenVDB.
      if (c.library == "openvdb/" && i.file.ends_with(".h") && !i.file.starts_with("tests/"))
        allowed = i.file == "world/store/tree.h" || i.file == "world/store/grid_stream.h" ||
                  i.file == "world/formats/vdb/grids.h";
      if (!allowed) found.push_back(line + ": " + std::string(c.library) + " is confined to other files");
    }
    if (!i.quoted) continue;
    if (i.target.find('/') == std::string::npos) continue;  // generated by the build
    const Module* from = module_of(i.file);
    const Module* to = module_of(i.target);
    if (!from) found.push_back(i.file + " belongs to no module of the table");
    if (!to) found.push_back(line + ", which belongs to no module of the table");
    if (!from || !to || from == to) continue;
    if (std::find(from->may_include.begin(), from->may_include.end(), to->prefix) == from->may_include.end())
      found.push_back(line + ": " + std::string(from->prefix) + " may not see " + std::string(to->prefix));
  }
  return found;
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<Include> includes_of(const std::string& file, const std::string& text) {
  std::vector<Include> includes;
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string_view line(text.data() + at, end - at);
    at = end + 1;
    const auto skip = [&] { line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size())); };
    skip();
    if (!line.starts_with('#')) continue;
    line.remove_prefix(1);
    skip();
    if (!line.starts_with("include")) continue;
    line.remove_prefix(7);
    skip();
    if (line.empty() || (line[0] != '"' && line[0] != '<')) continue;
    const std::size_t close = line.find(line[0] == '"' ? '"' : '>', 1);
    if (close == line.npos) continue;
    includes.push_back({file, std::string(line.substr(1, close - 1)), line[0] == '"'});
  }
  return includes;
}

/// Paths of the sources below the root, relative to it.
std::vector<std::string> source_files() {
  const std::filesystem::path root = LOAM_SOURCE_DIR;
  std::vector<std::string> files;
  for (const char* top : {"world", "sim", "render", "tools", "tests"}) {
    if (!std::filesystem::exists(root / top)) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / top)) {
      const std::string extension = entry.path().extension();
      if (extension == ".h" || extension == ".cpp" || extension == ".def" || extension == ".glsl")
        files.push_back(std::filesystem::relative(entry.path(), root));
    }
  }
  return files;
}

TEST(Layering, EveryIncludeFollowsTheMap) {
  const std::filesystem::path root = LOAM_SOURCE_DIR;
  const std::vector<std::string> files = source_files();
  ASSERT_GT(files.size(), 30u) << "the scan found too few files: is LOAM_SOURCE_DIR right?";
  std::vector<Include> includes;
  for (const std::string& file : files)
    for (Include& i : includes_of(file, text_of(root / file))) includes.push_back(std::move(i));
  ASSERT_GT(includes.size(), files.size());
  for (const std::string& v : violations(includes)) ADD_FAILURE() << v;
}

/// No automaton runs on a device, whose floats below 2^-126 may be kept or not: hashes are of processors alone.
TEST(HardCaseR18, TheSimulationReachesNoDevice) {
  const std::filesystem::path root = LOAM_SOURCE_DIR;
  size_t files = 0;
  for (const std::string& file : source_files()) {
    if (!file.starts_with("sim/")) continue;
    ++files;
    EXPECT_FALSE(file.ends_with(".glsl") || file.ends_with(".glsl.h")) << file;
    for (const Include& i : includes_of(file, text_of(root / file)))
      EXPECT_FALSE(i.target.starts_with("render/") || i.target.starts_with("vulkan/") || i.target == "volk.h")
          << file << " includes " << i.target;
  }
  EXPECT_GT(files, 30u) << "the scan found too few files";
}

TEST(Layering, EveryQuotedIncludeStartsAtTheRoot) {
  const std::filesystem::path root = LOAM_SOURCE_DIR;
  for (const std::string& file : source_files())
    for (const Include& i : includes_of(file, text_of(root / file))) {
      const bool generated = i.target.find('/') == std::string::npos;
      EXPECT_TRUE(!i.quoted || generated || std::filesystem::exists(root / i.target))
          << file << " includes " << i.target;
    }
}

TEST(Layering, TheCheckerRefusesEachKindOfViolation) {
  const std::vector<Include> wrong = {
      {"world/base/jobs.h", "world/space/coords.h"},        // up inside world
      {"world/blocks/block.h", "world/store/store.h"},      // up inside world
      {"world/store/store.h", "world/world.h"},             // a single file is a module too
      {"world/gen/terrain.cpp", "world/formats/format.h"},  // siblings
      {"world/sources/mesh.cpp", "world/formats/format.h"},
      {"world/world.h", "world/scenes/scene.h"},   // only camera.h and environment.h lie below it
      {"world/store/store.h", "render/camera.h"},  // world sees no picture
      {"world/world.h", "tools/info.h"},           // nor a tool
      {"sim/step.h", "render/camera.h"},           // never each other
      {"render/shading.h", "sim/step.h"},
      {"render/image/image.h", "render/camera.h"},
      {"render/raster/raster.cpp", "render/raycast/raycast.h"},  // backends don't know each other
      {"render/backend.h", "render/raster/raster.h"},
      {"render/extract/faces.h", "render/raster/raster.h"},
      {"render/gpu/device.h", "render/image/image.h"},
      {"render/shading.h", "tools/verbs.h"},
      {"render/shading.h", "tests/support.h"},
      {"render/shading.h", "elsewhere/thing.h"},  // no such module
      {"elsewhere/thing.h", "world/world.h"},
      {"render/shading.cpp", "openvdb/openvdb.h", false},
      {"world/store/store.h", "openvdb/openvdb.h", false},
      {"tools/main.cpp", "vulkan/vulkan.h", false},
  };
  for (const Include& i : wrong)
    EXPECT_EQ(violations({i}).size(), 1u) << i.file << " including " << i.target << " was not refused";
}

TEST(Layering, TheCheckerAllowsTheArrows) {
  const std::vector<Include> right = {
      {"world/space/coords.h", "world/base/random.h"},
      {"world/world.h", "world/scenes/environment.h"},
      {"world/world.h", "world/scenes/camera.h"},
      {"world/formats/format.h", "world/world.h"},
      {"world/formats/obj.cpp", "world/sources/source.h"},
      {"world/scenes/scene.h", "world/formats/format.h"},
      {"render/backends.cpp", "render/raster/raster.h"},
      {"render/raster/raster.cpp", "render/backend.h"},
      {"sim/step.cpp", "world/world.h"},
      {"render/backend.h", "world/world.h"},
      {"render/image/image.h", "world/units/quantity.h"},
      {"tools/main.cpp", "render/backend.h"},
      {"tests/world/a_test.cpp", "tests/support.h"},
      {"world/store/tree.h", "openvdb/openvdb.h", false},
      {"world/store/store.cpp", "openvdb/openvdb.h", false},
      {"world/blocks/block.cpp", "block_files.h"},
  };
  EXPECT_EQ(violations(right), std::vector<std::string>{});
}

TEST(Layering, TheScanReadsEveryFormOfInclude) {
  const auto found =
      includes_of("a.h", "#include \"world/a.h\"\n  #  include <openvdb/b.h>  // why\n// #include \"no.h\"\n#if 1\n");
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].target, "world/a.h");
  EXPECT_TRUE(found[0].quoted);
  EXPECT_EQ(found[1].target, "openvdb/b.h");
  EXPECT_FALSE(found[1].quoted);
}

// --- floating point ---------------------------------------------------------------------------------------------

/// Words that would change rounding, or tie the program to the machine that built it.
std::vector<std::string> forbidden_flags(const std::string& text) {
  std::vector<std::string> found;
  for (const char* flag :
       {"-ffast-math", "-Ofast", "-march=", "-mtune=native", "-mfma", "-mavx", "-funsafe-math", "-ffp-contract=fast",
        "-fassociative-math", "-freciprocal-math", "-ffinite-math-only", "-fno-signed-zeros"})
    if (text.find(flag) != std::string::npos) found.emplace_back(flag);
  return found;
}

TEST(BuildFlags, NothingChangesHowFloatingPointRounds) {
  const std::filesystem::path root = LOAM_SOURCE_DIR;
  std::vector<std::filesystem::path> files{root / "CMakeLists.txt"};
  for (const char* folder : {"cmake", "tools"})
    for (const auto& entry : std::filesystem::directory_iterator(root / folder))
      if (entry.path().extension() == ".cmake" || entry.path().extension() == ".sh") files.push_back(entry.path());
  ASSERT_GE(files.size(), 4u);
  for (const auto& file : files) EXPECT_EQ(forbidden_flags(text_of(file)), std::vector<std::string>{}) << file;
  EXPECT_NE(text_of(root / "CMakeLists.txt").find("-ffp-contract=off"), std::string::npos);
}

TEST(BuildFlags, TheCheckerFindsForbiddenFlags) {
  EXPECT_EQ(forbidden_flags("add_compile_options(-O3 -march=native -ffast-math)"),
            (std::vector<std::string>{"-ffast-math", "-march="}));
}

}  // namespace
