/// Which stored numbers hold a colour in linear light without losing codes of its 8-bit sRGB.

#include <functional>
#include <set>

#include <gtest/gtest.h>

#include "render/image/display.h"
#include "world/numbers/normalized.shared.h"
#include "world/numbers/small_float.h"

namespace render {
namespace {

struct Survivors {
  int unchanged = 0;  // of 256 codes
  int distinct = 0;
};

Survivors through(const std::function<float(float)>& storage) {
  Survivors s;
  std::set<int> seen;
  for (int code = 0; code < 256; ++code) {
    const float linear = linear_from_srgb(static_cast<float>(code) / 255.0f);
    const int back = world::Unorm<8>::from(srgb_from_linear(storage(linear))).code;
    s.unchanged += back == code;
    seen.insert(back);
  }
  s.distinct = static_cast<int>(seen.size());
  return s;
}

TEST(HardCaseN4, FloatHalfAndUnorm16HoldEverySrgbCodeInLinearLight) {
  EXPECT_EQ(through([](float x) { return x; }).unchanged, 256);
  EXPECT_EQ(through([](float x) { return world::float_from_half(world::half_from_float(x)); }).unchanged, 256);
  EXPECT_EQ(through([](float x) { return world::Unorm<16>::from(x).value(); }).unchanged, 256);
}

/// Why albedo is never kept in linear 8 or 10 bits.
TEST(HardCaseN4, LinearTenBitsLose18CodesAndEightBitsLose73) {
  EXPECT_EQ(through([](float x) { return world::Unorm<10>::from(x).value(); }).unchanged, 256 - 18);
  EXPECT_EQ(through([](float x) { return world::Unorm<8>::from(x).value(); }).distinct, 183);
}

}  // namespace
}  // namespace render
