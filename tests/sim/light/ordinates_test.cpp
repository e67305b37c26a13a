#include "sim/light/ordinates.h"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

namespace sim {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kSets[] = {6, 8, 32, 72, 128, 200, 288, 392, 512};

/// All directions of a set with their signs.
std::vector<Ordinate> signed_directions(const Ordinates& set) {
  std::vector<Ordinate> all;
  for (int octant = 0; octant < 8; ++octant)
    for (Ordinate o : set.octants[octant]) {
      for (int a = 0; a < 3; ++a)
        if (octant >> a & 1) o.along[a] = -o.along[a];
      all.push_back(o);
    }
  return all;
}

TEST(Ordinates, WeightsSumToTheSphereAndFirstMomentsVanish) {
  for (const int count : kSets) {
    const auto set = ordinates(count);
    ASSERT_TRUE(set.ok()) << count;
    const auto all = signed_directions(*set);
    EXPECT_EQ(all.size(), static_cast<size_t>(count));
    double sum = 0, moment[3] = {};
    for (const Ordinate& o : all) {
      EXPECT_GT(o.weight, 0);
      sum += o.weight;
      double length = 0;
      for (int a = 0; a < 3; ++a) moment[a] += double(o.weight) * o.along[a], length += double(o.along[a]) * o.along[a];
      EXPECT_NEAR(length, 1, 4e-7);  // three components rounded to float
    }
    EXPECT_NEAR(sum, 4 * kPi, 4 * kPi * 6e-8 * 2) << count;  // each weight is rounded to float
    for (const double m : moment) EXPECT_NEAR(m, 0, 1e-12) << count;
  }
}

TEST(Ordinates, ASetIsTheSameBitsUnderEverySymmetryOfTheCube) {
  constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (const int count : kSets) {
    std::set<std::array<float, 4>> seen;
    const auto all = signed_directions(*ordinates(count));
    for (const Ordinate& o : all) seen.insert({o.along[0] + 0.0f, o.along[1] + 0.0f, o.along[2] + 0.0f, o.weight});
    ASSERT_EQ(seen.size(), all.size());
    for (const auto& order : kOrders)
      for (int signs = 0; signs < 8; ++signs)
        for (const Ordinate& o : all) {
          std::array<float, 4> image{0, 0, 0, o.weight};
          for (int a = 0; a < 3; ++a) image[a] = (signs >> a & 1 ? -o.along[order[a]] : o.along[order[a]]) + 0.0f;
          ASSERT_TRUE(seen.contains(image)) << count;
        }
  }
}

/// The irradiance below a hemisphere of radiance 1 is pi; a set of n^2 triangles an octant misses it as a midpoint rule
/// does, by the square of the triangles' size.
TEST(Ordinates, TheHalfRangeApproachesPiInSecondOrder) {
  double before = 0;
  for (const int n : {1, 2, 4, 8}) {
    const double error = std::abs(ordinates(8 * n * n)->half_range - kPi);
    if (n > 2) {
      EXPECT_LT(error, before / 3) << n;
    }
    before = error;
  }
  EXPECT_LT(before, 0.02);
}

TEST(Ordinates, AnUnknownCountIsAnErrorThatListsTheKnown) {
  for (const int count : {0, -8, 7, 24, 648}) {
    const auto set = ordinates(count);
    ASSERT_FALSE(set.ok());
    EXPECT_NE(set.error().message.find("6, 8, 32, 72"), std::string::npos);
    EXPECT_EQ(set.error().kind, world::ErrorKind::usage);
  }
}

}  // namespace
}  // namespace sim
