/// Quantities as types: a number, or three colour bands, with the exponents of its unit. Only meaningful operators
/// exist: Power3 / Area -> Irradiance3; adding a Power3 to a Radiance3 does not compile.
///
/// Unit exponents, in this order: watt, metre, steradian, kilogram, kelvin, second.
#pragma once

#include <cmath>

namespace world {

template <int W, int M, int Sr, int Kg = 0, int K = 0, int S = 0>
struct Unit {};

template <class A, class B>
struct UnitProduct;
template <int... a, int... b>
struct UnitProduct<Unit<a...>, Unit<b...>> {
  using type = Unit<(a + b)...>;
};
template <class A, class B>
struct UnitQuotient;
template <int... a, int... b>
struct UnitQuotient<Unit<a...>, Unit<b...>> {
  using type = Unit<(a - b)...>;
};

/// One number with a unit.
template <class U>
struct Quantity {
  double value = 0;
  friend constexpr Quantity operator+(Quantity a, Quantity b) { return {a.value + b.value}; }
  friend constexpr Quantity operator-(Quantity a, Quantity b) { return {a.value - b.value}; }
  friend constexpr Quantity operator*(Quantity a, double s) { return {a.value * s}; }
  friend constexpr Quantity operator*(double s, Quantity a) { return {a.value * s}; }
  friend constexpr Quantity operator/(Quantity a, double s) { return {a.value / s}; }
  friend constexpr auto operator<=>(Quantity, Quantity) = default;
};
template <class A, class B>
constexpr auto operator*(Quantity<A> a, Quantity<B> b) {
  return Quantity<typename UnitProduct<A, B>::type>{a.value * b.value};
}
template <class A, class B>
constexpr auto operator/(Quantity<A> a, Quantity<B> b) {
  return Quantity<typename UnitQuotient<A, B>::type>{a.value / b.value};
}

/// Three colour bands (red, green, blue), linear, with a unit.
template <class U>
struct Bands3 {
  float r = 0, g = 0, b = 0;
  friend constexpr Bands3 operator+(Bands3 x, Bands3 y) { return {x.r + y.r, x.g + y.g, x.b + y.b}; }
  friend constexpr Bands3 operator-(Bands3 x, Bands3 y) { return {x.r - y.r, x.g - y.g, x.b - y.b}; }
  friend constexpr Bands3 operator*(Bands3 x, float s) { return {x.r * s, x.g * s, x.b * s}; }
  friend constexpr Bands3 operator*(float s, Bands3 x) { return x * s; }
  friend constexpr bool operator==(Bands3, Bands3) = default;
  constexpr float max() const { return r > g ? (r > b ? r : b) : (g > b ? g : b); }
};
template <class A, class B>
constexpr auto operator*(Bands3<A> x, Bands3<B> y) {
  return Bands3<typename UnitProduct<A, B>::type>{x.r * y.r, x.g * y.g, x.b * y.b};
}
template <class A, class B>
constexpr auto operator*(Bands3<A> x, Quantity<B> s) {
  const float f = static_cast<float>(s.value);
  return Bands3<typename UnitProduct<A, B>::type>{x.r * f, x.g * f, x.b * f};
}
template <class A, class B>
constexpr auto operator/(Bands3<A> x, Quantity<B> s) {
  const float f = static_cast<float>(1.0 / s.value);
  return Bands3<typename UnitQuotient<A, B>::type>{x.r * f, x.g * f, x.b * f};
}

// Geometry and radiometry.
using Length = Quantity<Unit<0, 1, 0>>;        // m
using Area = Quantity<Unit<0, 2, 0>>;          // m^2
using SolidAngle = Quantity<Unit<0, 0, 1>>;    // sr
using Ratio3 = Bands3<Unit<0, 0, 0>>;          // albedo, transmittance
using PerSteradian3 = Bands3<Unit<0, 0, -1>>;  // BSDF value
using Power3 = Bands3<Unit<1, 0, 0>>;          // W
using Intensity3 = Bands3<Unit<1, 0, -1>>;     // W/sr
using Irradiance3 = Bands3<Unit<1, -2, 0>>;    // W/m^2, also radiosity
using Radiance3 = Bands3<Unit<1, -2, -1>>;     // W/(m^2 sr)
using Absorption3 = Bands3<Unit<0, -1, 0>>;    // 1/m

// Matter.
using Kelvin = Quantity<Unit<0, 0, 0, 0, 1>>;              // K
using Density = Quantity<Unit<0, -3, 0, 1>>;               // kg/m^3
using HeatCapacity = Quantity<Unit<1, 0, 0, -1, -1, 1>>;   // J/(kg K)
using HeatConductivity = Quantity<Unit<1, -1, 0, 0, -1>>;  // W/(m K)

constexpr Area square_metres(double v) { return {v}; }
constexpr SolidAngle steradians(double v) { return {v}; }

}  // namespace world
