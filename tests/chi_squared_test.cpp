/// The chi-squared test itself: its distribution against tables, and that it sees what it must.
#include "tests/chi_squared.h"

#include <gtest/gtest.h>

namespace world {
namespace {

TEST(ChiSquared, ItsDistributionIsThatOfTheTables) {
  // 5 % and 1 % points. source: Abramowitz and Stegun, table 26.8
  for (const auto& [degrees, at, p] : {std::tuple{1, 3.84146, 0.05},
                                       {10, 18.3070, 0.05},
                                       {10, 23.2093, 0.01},
                                       {100, 124.342, 0.05},
                                       {100, 135.807, 0.01},
                                       {2, 0.0100251, 0.995}})
    EXPECT_NEAR(upper_gamma_ratio(0.5 * degrees, 0.5 * at), p, 2e-6) << degrees;
  EXPECT_EQ(upper_gamma_ratio(3, 0), 1);
  EXPECT_LT(upper_gamma_ratio(255, 1e4), 1e-300);
}

TEST(ChiSquared, ManyTestsAreAsRarelyWrongTogetherAsOneAlone) {
  EXPECT_NEAR(1 - std::pow(1 - sidak_level(0.01, 50), 50), 0.01, 1e-12);
  EXPECT_NEAR(sidak_level(0.01, 1), 0.01, 1e-12);
}

glm::vec3 uniform_direction(const glm::vec3& u) {
  const float z = 2 * u.x - 1, r = std::sqrt(1 - z * z);
  return {r * std::cos(6.2831853f * u.y), r * std::sin(6.2831853f * u.y), z};
}

TEST(ChiSquared, RightSamplersGivePsSpreadOver0To1) {
  int below_half = 0, below_tenth = 0;
  const auto sample = [](glm::vec3 u) { return std::optional(uniform_direction(u)); };
  const auto density = [](glm::vec3) { return 1 / 12.566370614f; };
  for (uint64_t seed = 1; seed <= 100; ++seed) {
    const double p = chi_squared_of_directions(sample, density, {.samples = 20000, .seed = seed}).p;
    below_half += p < 0.5;
    below_tenth += p < 0.1;
  }
  // Binomial, 100 trials: 50 +- 5 and 10 +- 3, and four of those.
  EXPECT_NEAR(below_half, 50, 20);
  EXPECT_NEAR(below_tenth, 10, 12);
}

TEST(ChiSquared, AWrongShapeAWrongTotalAndAHoleAreSeen) {
  const auto sample = [](glm::vec3 u) { return std::optional(uniform_direction(u)); };
  const ChiSquaredSettings settings{.samples = 200000};
  const float uniform = 1 / 12.566370614f;
  EXPECT_LT(chi_squared_of_directions(
                sample, [&](glm::vec3 d) { return uniform * (1 + 0.05f * d.x); }, settings)
                .p,
            1e-6);
  EXPECT_LT(chi_squared_of_directions(
                sample, [&](glm::vec3) { return uniform * 0.98f; }, settings)
                .p,
            1e-6);
  const auto hole = [](glm::vec3 u) {
    const glm::vec3 d = uniform_direction(u);
    return d.z > 0.95f ? std::nullopt : std::optional(d);
  };
  EXPECT_LT(chi_squared_of_directions(
                hole, [&](glm::vec3) { return uniform; }, settings)
                .p,
            1e-6);
  const auto told = chi_squared_of_directions(
      hole, [&](glm::vec3 d) { return d.z > 0.95f ? 0.0f : uniform; }, settings);
  EXPECT_GT(told.p, 0.01) << told.text();
  EXPECT_NEAR(told.refused, 0.025, 0.002);
}

}  // namespace
}  // namespace world
