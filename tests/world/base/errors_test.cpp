#include "world/base/errors.h"

#include <memory>

#include <gtest/gtest.h>

namespace world {
namespace {

Result<int> half_of(int x) {
  if (x % 2 != 0) return usage_error(std::to_string(x) + " is odd");
  return x / 2;
}
Result<int> quarter_of(int x) {
  TRY(const int half, half_of(x));
  TRY(const int quarter, half_of(half));
  return quarter;
}
Status check_even(int x) {
  TRY_STATUS(half_of(x));
  return {};
}

TEST(Result, HoldsAValueOrAnError) {
  EXPECT_TRUE(half_of(4).ok());
  EXPECT_EQ(*half_of(4), 2);
  EXPECT_FALSE(half_of(3).ok());
  EXPECT_EQ(half_of(3).error().message, "3 is odd");
  EXPECT_EQ(half_of(3).error().kind, ErrorKind::usage);
  EXPECT_EQ(static_cast<int>(input_error("x").kind), 3);
}

TEST(Result, TryPassesTheFirstErrorOn) {
  EXPECT_EQ(*quarter_of(8), 2);
  EXPECT_EQ(quarter_of(5).error().message, "5 is odd");
  EXPECT_EQ(quarter_of(6).error().message, "3 is odd");
  EXPECT_TRUE(check_even(2).ok());
  EXPECT_EQ(check_even(1).error().message, "1 is odd");
}

TEST(Result, CarriesWhatCanOnlyBeMoved) {
  const auto make = []() -> Result<std::unique_ptr<int>> { return std::make_unique<int>(7); };
  const auto use = [&]() -> Result<int> {
    TRY(std::unique_ptr<int> p, make());
    return *p;
  };
  EXPECT_EQ(*use(), 7);
}

TEST(ResultDeathTest, ReadingTheValueOfAnErrorStopsTheProgramAndSaysWhich) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(half_of(3).value(), "3 is odd");
}

TEST(CheckDeathTest, PrintsBothValuesAndThePlace) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const int found = 3;
  EXPECT_DEATH(CHECK_EQ(found, 4), "errors_test.cpp:[0-9]+: check failed: found == 4 \\(3 against 4\\)");
  EXPECT_DEATH(CHECK_LT(5, found), "5 against 3");
  EXPECT_DEATH(CHECK(found == 4), "found == 4");
  CHECK_EQ(found, 3);
  CHECK_LE(found, 3);
}

}  // namespace
}  // namespace world
