#include "world/base/simd.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace world {
namespace {

TEST(Simd, PlainCodeIsAlwaysAmongTheLevelsAndComesLast) {
  const auto levels = simd_levels();
  ASSERT_FALSE(levels.empty());
  for (const SimdLevel& l : levels) EXPECT_NE(l.name, "Unknown");
#if defined(__x86_64__)
  EXPECT_TRUE(levels.back().name == "EMU128" || levels.back().name == "SCALAR" || levels.back().name == "SSSE3")
      << levels.back().name;
#endif
}

TEST(Simd, AChoiceLastsAsLongAsItsObject) {
  const auto all = simd_levels();
  for (const SimdLevel& level : all) {
    const SimdChoice choice(level);
    ASSERT_EQ(simd_levels().size(), 1u);
    EXPECT_EQ(simd_levels()[0].name, level.name);
  }
  EXPECT_EQ(simd_levels().size(), all.size());
}

}  // namespace
}  // namespace world
