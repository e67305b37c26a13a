/// Each *.shared.h compiles as GLSL too, not only as C++.

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support.h"

namespace {

namespace fs = std::filesystem;

/// 0 where `text` compiles as a compute shader; the compiler's words go to the test's output else.
int compile_glsl(const std::string& text) {
  const world::TemporaryFolder folder;
  const std::string shader = (folder / "shared.comp").string();
  std::ofstream(shader) << text;
  const std::string command = "glslangValidator --target-env vulkan1.3 -S comp -I'" LOAM_SOURCE_DIR
                              "' -I'" LOAM_GENERATED_DIR "' -o /dev/null '" +
                              shader + "'";
  return std::system(command.c_str());
}

std::string shader_with(const std::string& include, const std::string& body) {
  return "#version 460\n#extension GL_GOOGLE_include_directive : require\n#include \"" + include +
         "\"\nvoid main() { " + body + " }\n";
}

TEST(SharedHeaders, EachCompilesAsGlsl) {
  const fs::path root = LOAM_SOURCE_DIR;
  int found = 0;
  for (const char* top : {"world", "render", "sim"}) {
    if (!fs::exists(root / top)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / top)) {
      if (!entry.path().string().ends_with(".shared.h")) continue;
      ++found;
      const std::string name = fs::relative(entry.path(), root).string();
      EXPECT_EQ(compile_glsl(shader_with(name, "")), 0) << name << " does not compile as GLSL";
    }
  }
  EXPECT_GE(found, 1);
}

TEST(SharedHeaders, AMistakeIsNoticed) {
  EXPECT_NE(compile_glsl(shader_with("world/numbers/normalized.shared.h", "uint c = no_such_function(1.0);")), 0);
  EXPECT_EQ(compile_glsl(shader_with("world/numbers/normalized.shared.h", "uint c = unorm_from_float(1.0, 8u);")), 0);
}

}  // namespace
