#include "world/base/toml_reader.h"

#include <cmath>

#include <gtest/gtest.h>

namespace world {
namespace {

/// The error of reading `text` as a lamp: name required, power_w in [0, 100], size of three, colour a choice.
std::string lamp_error(const std::string& text) {
  auto document = TomlDocument::parse(text, "lamp.toml");
  if (!document.ok()) return document.error().message;
  std::string name;
  double power = 0;
  double size[3] = {};
  int colour = 0, count = 0;
  constexpr std::string_view kColours[] = {"red", "green"};
  for (auto& [key, table] : document->root().tables()) {
    table.require("name", name);
    table.read("power_w", power, {.min = 0, .max = 100});
    table.read("size_m", std::span<double>(size), {.min = 0, .open_min = true});
    table.read("count", count);
    table.read_choice("colour", colour, kColours);
  }
  const Status status = document->finish();
  return status.ok() ? "" : status.error().message;
}

TEST(TomlReader, EachProblemNamesFileLineColumnKeyAndWhatWasExpected) {
  EXPECT_EQ(lamp_error("[a]\nname = 'x'\npower_w = 7\nsize_m = [1, 2.5, 3]\ncolour = 'red'\n"), "");
  EXPECT_EQ(lamp_error("[a]\nname = 'x'\npowr_w = 7\n"),
            "lamp.toml:3:1: unknown key 'powr_w' (did you mean 'power_w'?)");
  EXPECT_EQ(lamp_error("[a]\nname = 'x'\nzzzzzzzzzzzzzzz = 7\n"), "lamp.toml:3:1: unknown key 'zzzzzzzzzzzzzzz'");
  EXPECT_EQ(lamp_error("\n[a]\n"), "lamp.toml:2:1: the key 'name' is missing");
  EXPECT_EQ(lamp_error("[a]\nname = 3\n"), "lamp.toml:2:8: 'name' must be a string, not an integer");
  EXPECT_EQ(lamp_error("[a]\nname = 'x'\npower_w = 101\n"),
            "lamp.toml:3:11: 'power_w' is 101, but must be in [0, 100]");
  EXPECT_EQ(lamp_error("[a]\nname = 'x'\npower_w = nan\n"),
            "lamp.toml:3:11: 'power_w' is nan, but must be in [0, 100]");
  EXPECT_EQ(lamp_error("[a]\nname = 'x'\nsize_m = [1, 2]\n"),
            "lamp.toml:3:10: 'size_m' must be an array of 3 numbers, not of 2");
  EXPECT_EQ(lamp_error("[a]\nname = 'x'\nsize_m = [1, 0, 1]\n"),
            "lamp.toml:3:14: 'size_m[1]' is 0, but must be above 0");
  EXPECT_EQ(lamp_error("[a]\nname = 'x'\ncolour = 'gren'\n"),
            "lamp.toml:3:10: 'colour' is 'gren', but must be one of red, green (did you mean 'green'?)");
  EXPECT_EQ(lamp_error("b = 1\n"), "lamp.toml:1:5: 'b' must be a table, [b], not an integer");
}

TEST(TomlReader, ANumberThatDoesNotFitItsFieldIsAnError) {
  EXPECT_EQ(lamp_error("[a]\nname = 'x'\ncount = 1.5\n"),
            "lamp.toml:3:9: 'count' must be a whole number, not a number");
  EXPECT_EQ(lamp_error("[a]\nname = 'x'\ncount = 2147483648\n"),
            "lamp.toml:3:9: 'count' is 2147483648, but must be in [-2147483648, 2147483647]");
}

TEST(TomlReader, WhatAMessageQuotesOfTheFileStaysOnItsLine) {
  EXPECT_EQ(lamp_error("a = fal\nb = 1\n"),
            "lamp.toml:1:8: Error while parsing boolean: expected 'false', saw 'fal\\n'");
  EXPECT_EQ(lamp_error("[a]\nname = 'x'\n\"a\\nb\\u001b\" = 1\n"), "lamp.toml:3:1: unknown key 'a\\nb\\u001B'");
  EXPECT_EQ(lamp_error("[a]\nname = 'x'\ncolour = \"gr\\ten\"\n"),
            "lamp.toml:3:10: 'colour' is 'gr\\ten', but must be one of red, green (did you mean 'green'?)");
}

/// The sanitizers see it where the library takes one of them for impossible.
TEST(TomlReader, AnyCharacterMayStandAnywhere) {
  const auto utf8 = [](uint32_t point) {
    std::string bytes;
    const auto put = [&](uint32_t byte) { bytes += static_cast<char>(byte); };
    if (point < 0x800)
      put(0xc0 | point >> 6);
    else if (point < 0x10000)
      put(0xe0 | point >> 12), put(0x80 | (point >> 6 & 63));
    else
      put(0xf0 | point >> 18), put(0x80 | (point >> 12 & 63)), put(0x80 | (point >> 6 & 63));
    put(0x80 | (point & 63));
    return bytes;
  };
  for (uint32_t point = 0x80; point < 0x10ffff; point += point < 0x800 ? 1 : point < 0x10000 ? 13 : 4099) {
    if (point >= 0xd800 && point < 0xe000) continue;  // surrogates are no characters
    const std::string c = utf8(point);
    for (const std::string& text : {"a = 1" + c, "a = [1" + c + "]", c + " = 1", "[" + c, "a = \"\\" + c + "\""}) {
      const std::string said = lamp_error(text);
      EXPECT_EQ(said.substr(0, 12), "lamp.toml:1:") << point << ": " << text;
      EXPECT_EQ(said.find_first_of("\n\r"), said.npos) << said;
    }
    // In strings and comments it may be.
    EXPECT_EQ(lamp_error("[a] # " + c + "\nname = \"\"\"" + c + "\\\n " + c + "\"\"\""), "") << point;
  }
}

TEST(TomlReader, TheFirstProblemInFileOrderIsTold) {
  EXPECT_EQ(lamp_error("[b]\nname = 1\n[a]\nnam = 'x'\n").substr(0, 14), "lamp.toml:2:8:");
}

TEST(TomlReader, AMisspeltRequiredKeyIsToldAsUnknownAndNotAsMissing) {
  EXPECT_EQ(lamp_error("[a]\nnaem = 'x'\n"), "lamp.toml:2:1: unknown key 'naem' (did you mean 'name'?)");
}

TEST(TomlReader, SyntaxErrorsAndKeysDefinedTwiceNameTheirPlace) {
  EXPECT_EQ(lamp_error("[a]\nname = \n").substr(0, 12), "lamp.toml:2:");
  EXPECT_EQ(lamp_error("[a]\nname = 'x'\nname = 'y'\n").substr(0, 12), "lamp.toml:3:");
  // Where the library's own assertions were on, this ended the program.
  EXPECT_EQ(lamp_error("[|a]\n").substr(0, 12), "lamp.toml:1:");
}

TEST(TomlReader, ArraysOfTablesComeInFileOrder) {
  auto document = TomlDocument::parse("[[camera]]\nname = 'z'\n[[camera]]\nname = 'a'\n", "s.toml");
  ASSERT_TRUE(document.ok());
  std::string names;
  for (TomlTable& camera : document->root().array_of_tables("camera")) {
    std::string name;
    EXPECT_TRUE(camera.require("name", name));
    names += name;
  }
  EXPECT_EQ(names, "za");
  EXPECT_TRUE(document->finish().ok());
}

TEST(NumberRange, HoldsNoNanAndSaysWhatItHolds) {
  EXPECT_FALSE(NumberRange{}.contains(std::nan("")));
  EXPECT_EQ((NumberRange{.min = 0, .max = 1, .open_min = true, .open_max = true}).text(), "in (0, 1)");
  EXPECT_EQ((NumberRange{.min = 0}).text(), "at least 0");
  EXPECT_EQ((NumberRange{.max = 2, .open_max = true}).text(), "below 2");
}

}  // namespace
}  // namespace world
