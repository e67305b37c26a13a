#include "tools/bench/reference_cache.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <unistd.h>

namespace tools {

TEST(ReferenceCache, KeepsWhatWasMadeAndMakesAnewWhatIsDamagedOrOfAnotherKey) {
  const auto folder = std::filesystem::temp_directory_path() / ("loam_references_" + std::to_string(getpid()));
  setenv("XDG_CACHE_HOME", folder.c_str(), 1);
  int made = 0;
  const auto make = [&] {
    ++made;
    return std::vector<double>{1.5, -2, 1e-300};
  };
  const std::vector<double> expected{1.5, -2, 1e-300};
  EXPECT_EQ(cached_reference(7, 3, make), expected);
  EXPECT_EQ(cached_reference(7, 3, make), expected);
  EXPECT_EQ(made, 1);
  EXPECT_EQ(cached_reference(8, 3, make), expected);
  EXPECT_EQ(made, 2);
  const auto file = folder / "loam" / "references" / "0000000000000007.reference";
  {
    std::fstream damage(file, std::ios::in | std::ios::out | std::ios::binary);
    damage.seekp(20);
    damage.put('x');
  }
  EXPECT_EQ(cached_reference(7, 3, make), expected);
  EXPECT_EQ(made, 3);
  unsetenv("XDG_CACHE_HOME");
  std::filesystem::remove_all(folder);
}

}  // namespace tools
