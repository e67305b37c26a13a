// Compiled once for each SIMD level, below; the tests follow at the end, once.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/world/base/simd_test.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace world {
namespace HWY_NAMESPACE {

int64_t target_that_runs() { return HWY_TARGET; }

/// Multiplies and adds, so that a compiler that may fuse would round differently where the processor can.
void multiply_add(const float* a, const float* b, float* sum, size_t count) {
  const hwy::HWY_NAMESPACE::ScalableTag<float> tag;
  const size_t lanes = hwy::HWY_NAMESPACE::Lanes(tag);
  size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto product = hwy::HWY_NAMESPACE::Mul(LoadU(tag, a + i), LoadU(tag, b + i));
    StoreU(Add(product, LoadU(tag, sum + i)), tag, sum + i);
  }
  for (; i < count; ++i) sum[i] = a[i] * b[i] + sum[i];
}

}  // namespace HWY_NAMESPACE
}  // namespace world
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <vector>

#include <gtest/gtest.h>

#include "world/base/random.h"
#include "world/base/simd.h"

namespace world {
namespace {

HWY_EXPORT(target_that_runs);
HWY_EXPORT(multiply_add);

TEST(Simd, PlainCodeIsAlwaysAmongTheLevelsAndComesLast) {
  const auto levels = simd_levels();
  ASSERT_FALSE(levels.empty());
  for (const SimdLevel& l : levels) EXPECT_NE(l.name, "Unknown");
  EXPECT_EQ(levels.back().target, HWY_STATIC_TARGET) << levels.back().name;
}

TEST(Simd, DispatchFollowsTheChoiceAsLongAsItLives) {
  const auto all = simd_levels();
  for (const SimdLevel& level : all) {
    const SimdChoice choice(level);
    ASSERT_EQ(simd_levels().size(), 1u);
    EXPECT_EQ(HWY_DYNAMIC_DISPATCH(target_that_runs)(), level.target) << level.name;
  }
  EXPECT_EQ(simd_levels().size(), all.size());
  EXPECT_EQ(HWY_DYNAMIC_DISPATCH(target_that_runs)(), all.front().target);
}

TEST(Simd, ProductsAndSumsHaveTheSameBitsAtEverySimdLevel) {
  const size_t count = 1003;  // not a multiple of any vector
  std::vector<float> a(count), b(count), start(count);
  for (size_t i = 0; i < count; ++i) {
    a[i] = 1 + uniform01(random_bits(1, static_cast<int64_t>(i), 0, 0));
    b[i] = 1 + uniform01(random_bits(2, static_cast<int64_t>(i), 0, 0));
    start[i] = -a[i] * b[i];  // what fusing would leave is the product's rounding error, not 0
  }
  for (const SimdLevel& level : simd_levels()) {
    const SimdChoice choice(level);
    std::vector<float> sum = start;
    HWY_DYNAMIC_DISPATCH(multiply_add)(a.data(), b.data(), sum.data(), count);
    EXPECT_EQ(sum, std::vector<float>(count, 0.0f)) << level.name;
  }
}

}  // namespace
}  // namespace world
#endif
