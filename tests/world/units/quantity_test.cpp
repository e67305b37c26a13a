#include "world/units/quantity.h"

#include <gtest/gtest.h>

namespace world {
namespace {

template <class A, class B>
concept CanAdd = requires(A a, B b) {
  a + b;
};
template <class A, class B>
concept CanSubtract = requires(A a, B b) {
  a - b;
};
template <class A, class B>
concept CanMultiply = requires(A a, B b) {
  a* b;
};
template <class A, class B>
concept CanDivide = requires(A a, B b) {
  a / b;
};
template <class A, class B>
concept CanCompare = requires(A a, B b) {
  a < b;
};
template <class A, class B>
concept CanEqual = requires(A a, B b) {
  a == b;
};
template <class A, class B>
concept CanAssign = requires(A a, B b) {
  a = b;
};

TEST(Quantity, UnitsFollowFromTheOperators) {
  static_assert(std::is_same_v<decltype(Power3{} / Area{}), Irradiance3>);
  static_assert(std::is_same_v<decltype(Power3{} / SolidAngle{}), Intensity3>);
  static_assert(std::is_same_v<decltype(Irradiance3{} / SolidAngle{}), Radiance3>);
  static_assert(std::is_same_v<decltype(Radiance3{} * SolidAngle{}), Irradiance3>);
  static_assert(std::is_same_v<decltype(Irradiance3{} * PerSteradian3{}), Radiance3>);
  static_assert(std::is_same_v<decltype(Radiance3{} * Ratio3{}), Radiance3>);
  static_assert(std::is_same_v<decltype(Absorption3{} * Length{}), Ratio3>);
  static_assert(std::is_same_v<decltype(Length{} * Length{}), Area>);
  static_assert(std::is_same_v<decltype(Power3{} + Power3{}), Power3>);
  static_assert(std::is_same_v<decltype(2.0f * Power3{}), Power3>);
}

TEST(Quantity, MeaninglessOperatorsDoNotCompile) {
  static_assert(CanAdd<Power3, Power3>);
  static_assert(!CanAdd<Power3, Radiance3>);
  static_assert(!CanAdd<Power3, Irradiance3>);
  static_assert(!CanSubtract<Intensity3, Power3>);
  static_assert(!CanAdd<Power3, float>);
  static_assert(!CanAdd<Power3, Length>);
  static_assert(CanAdd<Length, Length> && !CanAdd<Length, Area> && !CanAdd<Kelvin, Length> && !CanAdd<Length, double>);
  static_assert(CanCompare<Kelvin, Kelvin> && !CanCompare<Kelvin, Length> && !CanCompare<Kelvin, double>);
  static_assert(CanEqual<Power3, Power3> && !CanEqual<Power3, Intensity3>);
  static_assert(CanAssign<Power3&, Power3> && !CanAssign<Power3&, Radiance3> && !CanAssign<Kelvin&, double>);
  // Three bands over three bands hides a division by a black band, and a colour has no order.
  static_assert(!CanDivide<Power3, Power3>);
  static_assert(!CanCompare<Power3, Power3>);
  static_assert(!CanDivide<double, Area>);
  static_assert(CanMultiply<Power3, float> && CanDivide<Power3, Area>);
  static_assert(!std::is_convertible_v<double, Kelvin> && !std::is_convertible_v<Kelvin, double>);
}

TEST(Quantity, ValuesAreWhatArithmeticSays) {
  const Irradiance3 e = Power3{10, 20, 30} / square_metres(4);
  EXPECT_EQ(e, (Irradiance3{2.5f, 5, 7.5f}));
  EXPECT_EQ(e * 2.0f - e, e);
  EXPECT_EQ((Radiance3{1, 2, 3} * steradians(0.5)), (Irradiance3{0.5f, 1, 1.5f}));
  EXPECT_EQ((Radiance3{1, 2, 3} * Ratio3{0.5f, 0, 1}), (Radiance3{0.5f, 0, 3}));
  EXPECT_EQ((Bands3<Unit<0, 0, 0>>{1, 3, 2}.max()), 3);
  EXPECT_EQ((Length{3} * Length{4}).value, 12);
  EXPECT_LT(Kelvin{273.15}, Kelvin{300});
  static_assert(sizeof(Radiance3) == 3 * sizeof(float) && sizeof(Kelvin) == sizeof(double));
}

}  // namespace
}  // namespace world
