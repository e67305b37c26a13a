#include "world/base/text.h"

#include <cstdint>

#include <gtest/gtest.h>

#include "world/base/toml_reader.h"

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

TEST(Text, AMessageStaysOnOneLineWhateverItQuotes) {
  EXPECT_EQ(one_line("a\nb\r\n\tc"), "a\\nb\\r\\n\\tc");
  EXPECT_EQ(one_line(std::string_view("\0\x1b[2J\x7f", 6)), "\\u0000\\u001B[2J\\u007F");
  EXPECT_EQ(one_line("\xc2\x85\xc2\x9f"), "\\u0085\\u009F");  // of eight bits
  EXPECT_EQ(one_line("30 \xc2\xb5m, \xe2\x82\xac, \xc2"), "30 \xc2\xb5m, \xe2\x82\xac, \xc2");
  EXPECT_EQ(one_line(""), "");
}

TEST(Text, AnyTextIsReadBackFromToml) {
  const auto there_and_back = [](const std::string& text) {
    auto document = TomlDocument::parse("key = " + toml_text(text), "text");
    EXPECT_TRUE(document.ok()) << toml_text(text);
    std::string read;
    if (document.ok()) document->root().read("key", read);
    return read;
  };
  std::string ascii;
  for (char c = 1; c < 127; ++c) ascii += c;
  for (const std::string& text : {std::string(), ascii + "\x7f", std::string("a\0b", 3), std::string("\\\"'#\n[]"),
                                  std::string("\xc3\xa9 \xe2\x82\xac \xf0\x9f\x8c\x8d")})
    EXPECT_EQ(there_and_back(text), text);
  // Bytes that are no UTF-8: alone, cut off, overlong, a surrogate, beyond the last code point.
  for (const std::string text : {"\xff", "\xe2\x82", "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80"})
    EXPECT_NE(there_and_back("<" + text + ">").find("\xef\xbf\xbd"), std::string::npos);
}

}  // namespace
}  // namespace world
