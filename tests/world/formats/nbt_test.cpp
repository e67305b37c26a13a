#include "world/formats/nbt/nbt.h"

#include <gtest/gtest.h>

#include "world/formats/archive/inflate.h"

namespace world::nbt {
namespace {

std::span<const uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

/// The problem that skipping the whole tree finds, or "".
std::string problem_of(const std::string& tree) {
  Reader in(bytes_of(tree), "some.nbt");
  in.root();
  for (Entry e; in.next(e);) in.skip(e);
  return in.failed() ? in.error().message : "";
}

TEST(Nbt, WhatIsWrittenIsRead) {
  Writer out;
  out.open("root");
  out.byte_number("byte", -5);
  out.short_number("short", 60000);
  out.int_number("int", -123456789);
  out.long_number("long", -1234567890123456789);
  out.text("text", "hello");
  out.byte_array("bytes", std::vector<uint8_t>{1, 2, 3});
  out.int_array("ints", std::vector<int32_t>{-1, 7});
  out.long_array("longs", std::vector<uint64_t>{uint64_t{1} << 63});
  out.list("list", Type::text, 2);
  out.put_text("a");
  out.put_text("b");
  out.open("inner");
  out.int_number("x", 4);
  out.close();
  out.close();
  Reader in(bytes_of(out.bytes), "some.nbt");
  EXPECT_EQ(in.root(), "root");
  int seen = 0;
  for (Entry e; in.next(e); ++seen) {
    if (e.name == "byte") {
      EXPECT_EQ(in.integer(e), -5);
    } else if (e.name == "short") {
      EXPECT_EQ(static_cast<uint16_t>(in.integer(e)), 60000);
    } else if (e.name == "int") {
      EXPECT_EQ(in.integer(e), -123456789);
    } else if (e.name == "long") {
      EXPECT_EQ(in.integer(e), -1234567890123456789);
    } else if (e.name == "text") {
      EXPECT_EQ(in.text(e), "hello");
    } else if (e.name == "bytes") {
      EXPECT_EQ(in.array(e, Type::byte_array).size(), 3u);
    } else if (e.name == "ints") {
      EXPECT_EQ(big_endian<int32_t>(in.array(e, Type::int_array).data()), -1);
    } else if (e.name == "longs") {
      EXPECT_EQ(big_endian<uint64_t>(in.array(e, Type::long_array).data()), uint64_t{1} << 63);
    } else if (e.name == "list") {
      ASSERT_EQ(in.list(e, Type::text), 2u);
      EXPECT_EQ(in.text(), "a");
      EXPECT_EQ(in.text(), "b");
    } else {
      in.skip(e);
    }
  }
  EXPECT_FALSE(in.failed());
  EXPECT_EQ(seen, 10);
  EXPECT_EQ(in.remaining(), 0u);
}

TEST(Nbt, AWrongTypeIsSaidWithItsNameAndPlace) {
  Writer out;
  out.open("");
  out.text("Width", "ten");
  out.close();
  Reader in(bytes_of(out.bytes), "some.nbt");
  in.root();
  Entry e;
  ASSERT_TRUE(in.next(e));
  EXPECT_EQ(in.integer(e), 0);
  EXPECT_NE(in.error().message.find("some.nbt: byte 11: expected a whole number in 'Width', found a text"),
            std::string::npos)
      << in.error().message;
  EXPECT_FALSE(in.next(e));
}

TEST(HardCaseIO12, NestingHasALimitAndNeedsNoStack) {
  for (const int depth : {500, 1'000'000}) {
    Writer out;
    out.open("");
    out.list("deep", Type::list, 1);
    std::string tree = out.bytes;
    for (int i = 1; i < depth; ++i) tree += std::string("\x09\0\0\0\1", 5);  // a list of one list
    tree += std::string("\x01\0\0\0\0", 5) + '\0';
    EXPECT_EQ(problem_of(tree).empty(), depth == 500) << problem_of(tree);
  }
  // Compounds in compounds, too.
  std::string tree;
  for (int i = 0; i < 100'000; ++i) tree += std::string("\x0a\0\0", 3);
  EXPECT_NE(problem_of(tree).find("512 levels"), std::string::npos);
}

TEST(HardCaseIO12, CountsBeyondTheFileAreRejectedBeforeAnythingIsMade) {
  for (const Type type : {Type::byte_array, Type::int_array, Type::long_array}) {
    Writer out;
    out.open("");
    out.array_head("all", type, 0x7fffffff);
    EXPECT_NE(problem_of(out.bytes).find("2147483647 elements was announced"), std::string::npos);
    out = Writer();
    out.open("");
    out.array_head("all", type, 0xffffffff);
    EXPECT_NE(problem_of(out.bytes).find("-1 elements"), std::string::npos);
  }
  Writer out;
  out.open("");
  out.list("all", Type::compound, 0x7fffffff);
  EXPECT_NE(problem_of(out.bytes).find("a list of 2147483647 elements"), std::string::npos);
}

TEST(HardCaseIO13, ALongListThatIsThereIsRead) {
  Writer out;
  out.open("");
  out.list("furnaces", Type::compound, 65'000);
  out.bytes.append(65'000, '\0');  // empty compounds
  out.close();
  EXPECT_EQ(problem_of(out.bytes), "");
}

TEST(Inflater, StopsAtItsBudget) {
  MemoryBudget budget(0);
  EXPECT_FALSE(budget.take(uint64_t{1} << 40));
  EXPECT_TRUE(budget.take(budget.left()));
  EXPECT_FALSE(budget.take(1));
}

}  // namespace
}  // namespace world::nbt
