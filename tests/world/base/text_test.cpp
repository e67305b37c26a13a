#include "world/base/text.h"

#include <cstdint>

#include <gtest/gtest.h>

namespace world {
namespace {

TEST(Text, EditDistanceCountsInsertionsDeletionsAndSubstitutions) {
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
  EXPECT_EQ(edit_distance("", "abc"), 3u);
  EXPECT_EQ(edit_distance("abc", ""), 3u);
  EXPECT_EQ(edit_distance("flaw", "lawn"), 2u);
  EXPECT_EQ(edit_distance("same", "same"), 0u);
  EXPECT_EQ(edit_distance("exposure", "exposrue"), edit_distance("exposrue", "exposure"));
}

TEST(Text, TheNearestIsNamedUnlessNothingIsNear) {
  const std::vector<std::string> names = {"exposure", "view_distance", "sun_shadow"};
  EXPECT_EQ(nearest_text("exposur", names), "exposure");
  EXPECT_EQ(nearest_text("sunshadow", names), "sun_shadow");
  EXPECT_EQ(nearest_text("zzzz", names), "");
  EXPECT_EQ(nearest_text("", names), "");
  EXPECT_EQ(nearest_text("exposure", {}), "");
}

TEST(Text, ThousandsAreSeparated) {
  EXPECT_EQ(with_thousands(0), "0");
  EXPECT_EQ(with_thousands(999), "999");
  EXPECT_EQ(with_thousands(1000), "1,000");
  EXPECT_EQ(with_thousands(1234567), "1,234,567");
  EXPECT_EQ(with_thousands(UINT64_MAX), "18,446,744,073,709,551,615");
}

TEST(Text, BytesHaveABinaryUnit) {
  EXPECT_EQ(bytes_text(0), "0 B");
  EXPECT_EQ(bytes_text(1023), "1023 B");
  EXPECT_EQ(bytes_text(1536), "1.5 KiB");
  EXPECT_EQ(bytes_text(1048575), "1.0 MiB");  // not 1024.0 KiB
  EXPECT_EQ(bytes_text(3.0 * (1ull << 40)), "3.0 TiB");
  EXPECT_EQ(bytes_text(5000.0 * (1ull << 40)), "5000.0 TiB");
}

}  // namespace
}  // namespace world
