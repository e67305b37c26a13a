// What luminaires send to a plane, against closed forms; and which way their images lie.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "world/base/random.h"
#include "world/luminaires/kinds.h"
#include "world/luminaires/luminaire.h"
#include "world/luminaires/rectangle.shared.h"
#include "world/luminaires/sphere.shared.h"

namespace world {
namespace {

constexpr double kPi = 3.14159265358979323846;

LuminaireSampler made(const Luminaire& l) {
  auto sampler = LuminaireSampler::make(l);
  if (!sampler.ok()) ADD_FAILURE() << sampler.error().message;
  return std::move(*sampler);
}

Luminaire of_kind(const char* kind) {
  Luminaire l;
  l.kind = kind;
  return l;
}

/// Irradiance at the receiver by the midpoint rule over the random numbers. error: of second order in 1/steps where the
/// integrand is smooth, of first order where the horizon cuts it
double irradiance(const LuminaireSampler& sampler, const Vec3d& receiver, const Vec3d& normal, int steps = 256) {
  double sum = 0;
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j) {
      const LuminaireSample s =
          sampler.sample(receiver, {(float(i) + 0.5f) / float(steps), (float(j) + 0.5f) / float(steps)});
      sum += s.biradiance.g * std::max(glm::dot(Vec3d(s.direction), normal), 0.0);
    }
  return sum / (double(steps) * steps);
}

/// Of a rectangle's corner region: form factor from a point under its corner. source: Howell, Menguc, Daun, Siegel.
/// Thermal Radiation Heat Transfer, catalogue of configuration factors, B-4
double corner_factor(double x, double y, double height) {
  const double a = x / height, b = y / height, p = std::sqrt(1 + a * a), q = std::sqrt(1 + b * b);
  return (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2 * kPi);
}

/// The midpoint rule with 256^2 points: 1e-4 for smooth integrands, from 4 runs with 64..512 points each way.
TEST(ClosedForms, ARectangleOverAParallelPlane) {
  for (const bool by_area : {false, true}) {
    Luminaire l = of_kind("rectangle");
    l.radiance = {2, 2, 2}, l.extent = {1.5f, 0.8f}, l.uniform_area = by_area;
    const LuminaireSampler sampler = made(l);
    const Vec3d up(l.up), right = glm::cross(up, Vec3d(l.axis));
    for (const double height : {0.5, 1.0, 5.0, 300.0})
      for (const double x : {0.0, 0.75, 2.0})
        for (const double y : {0.0, 0.3}) {
          const double x0 = -0.75 - x, x1 = 0.75 - x, y0 = double{-0.4f} - y, y1 = double{0.4f} - y;
          const double exact = 2 * kPi *
                               (corner_factor(x1, y1, height) - corner_factor(x0, y1, height) -
                                corner_factor(x1, y0, height) + corner_factor(x0, y0, height));
          EXPECT_NEAR(irradiance(sampler, x * right + y * up + height * Vec3d(l.axis), -Vec3d(l.axis)) / exact, 1, 1e-4)
              << by_area << " at " << height << ", " << x << ", " << y;
        }
  }
}

/// The same sum in long double, whose own error is 1e-18. Stated in rectangle.shared.h: 4e-15.
TEST(ClosedForms, SolidAnglesOfRectanglesAreRightToTheStatedError) {
  double worst = 0;
  for (int i = 0; i < 100000; ++i) {
    const auto magnitude = [&](int salt) {
      const uint64_t bits = random_bits(8, i, salt, 0);
      return std::pow(10, 12 * uniform01_double(bits) - 6) * (bits & 1 ? 1 : -1);
    };
    const Vec3d low(magnitude(0), magnitude(1), 0);
    const glm::dvec2 high(low.x + std::abs(magnitude(2)), low.y + std::abs(magnitude(3)));
    const double height = std::abs(magnitude(4));
    const auto angle = [&](long double x, long double y, long double product) {
      return std::atan2(height * std::sqrt(x * x + y * y + static_cast<long double>(height) * height), product);
    };
    const long double x0 = low.x, y0 = low.y, x1 = high.x, y1 = high.y;
    const long double exact = angle(x1, y0, x1 * y0) + angle(x1, y1, -x1 * y1) + angle(x0, y1, x0 * y1) +
                              angle(x0, y0, -x0 * y0) - 2 * std::acos(-1.0L);
    const double seen = shared::spherical_rectangle({low.x, low.y}, high, height).solid_angle;
    worst = std::max(worst, static_cast<double>(std::abs(seen - exact)));
  }
  EXPECT_LE(worst, 4e-15);
}

/// Far off, just above the solid angle below which points are drawn, uniform directions are uniform points still.
TEST(ClosedForms, DirectionsToASmallRectangleAreEvenlySpread) {
  Luminaire l = of_kind("rectangle");
  l.radiance = {1, 1, 1}, l.extent = {1, 2};
  const LuminaireSampler sampler = made(l);
  const Vec3d axis(l.axis), up(l.up), right = glm::cross(up, axis);
  for (const double distance : {3e3, 1.4e4})  // 2e-7 and 1.02e-8 sr
    for (const Vec2f& u : {Vec2f(0.01f, 0.02f), Vec2f(0.25f, 0.75f), Vec2f(0.9f, 0.4f)}) {
      // In double, as a float direction is too coarse from there.
      const shared::EmitterSample s =
          shared::rectangle_sample(emitter_from(l), distance * axis + 5.0 * right, glm::dvec2(u));
      ASSERT_GT(1 / s.pdf, 1e-8);
      const Vec3d point = distance * axis + 5.0 * right + s.distance * s.direction;
      EXPECT_NEAR(glm::dot(point, right), u.x - 0.5, 2e-3) << distance;
      EXPECT_NEAR(glm::dot(point, up), 2 * (u.y - 0.5), 2e-3) << distance;
    }
}

/// Stated in sphere.shared.h: 7e-16, at any distance.
TEST(ClosedForms, ConesOfSpheresAreRightToTheStatedError) {
  shared::Emitter e{};
  double worst = 0;
  for (int i = 0; i < 100000; ++i) {
    const auto unit = [&](int salt) { return uniform01_double(random_bits(10, i, salt, 0)); };
    e.radius = std::pow(10, 12 * unit(0) - 6);
    const double d = e.radius * (1 + std::pow(10, 30 * unit(1) - 15));
    const long double r = e.radius, sine = r / d, cosine = std::sqrt((d - r) * (d + r)) / d;
    const long double exact = sine * sine / (2 * (1 + cosine));
    worst = std::max(worst, static_cast<double>(std::abs(shared::sphere_cone(e, d) / exact - 1)));
  }
  EXPECT_LE(worst, 7e-16);
}

TEST(ClosedForms, ADiskOverAParallelPlaneOnAndBesideItsAxis) {
  for (const bool by_area : {false, true}) {
    Luminaire l = of_kind("disk");
    l.radiance = {1, 1, 1}, l.radius = 0.7f, l.uniform_area = by_area;
    const LuminaireSampler sampler = made(l);
    const double r = l.radius;
    for (const double height : {0.2, 0.6, 1.0, 40.0}) {
      const double sine2 = r * r / (r * r + height * height);
      // Near by, the disk's border cuts the square whose directions are sampled.
      EXPECT_NEAR(irradiance(sampler, height * Vec3d(l.axis), -Vec3d(l.axis)) / (kPi * sine2), 1, 2e-3) << height;
      for (const double a : {0.3, 1.0, 4.0}) {  // source: the catalogue's B-13
        const double h = height / a, q = r / a, z = 1 + h * h + q * q;
        const double exact = 0.5 * kPi * (1 - (z - 2 * q * q) / std::sqrt(z * z - 4 * q * q));
        EXPECT_NEAR(irradiance(sampler, height * Vec3d(l.axis) + a * Vec3d(l.up), -Vec3d(l.axis)) / exact, 1, 2e-3)
            << by_area << " at " << height << ", " << a;
      }
    }
  }
}

TEST(ClosedForms, ASphereIsAnOmniAtAnyDistance) {
  Luminaire l = of_kind("sphere");
  l.radiance = {3, 3, 3}, l.radius = 0.5f;
  const LuminaireSampler sampler = made(l);
  EXPECT_FLOAT_EQ(sampler.total_power().g, float(4 * kPi * kPi * 0.25 * 3));
  Luminaire omni = of_kind("omni");
  omni.power = sampler.total_power();
  const LuminaireSampler point = made(omni);
  const Vec3d normal(0, 1, 0);
  for (const double d : {0.7, 1.0, 10.0, 1e4}) {
    const Vec3d receiver = d * glm::normalize(Vec3d(0.2, -1, 0.1));
    const double cosine = -receiver.y / d, exact = kPi * 3 * 0.25 / (d * d) * cosine;
    EXPECT_NEAR(irradiance(sampler, receiver, normal) / exact, 1, 1e-5) << d;
    EXPECT_NEAR(point.sample(receiver, {}).biradiance.g * cosine / exact, 1, 1e-6) << d;
  }
}

TEST(ClosedForms, ASkyGivesPiLToWhatFacesItsPoleAndHalfOfItToAWall) {
  Luminaire l = of_kind("hemisphere");
  l.axis = {0, 1, 0}, l.radiance = {5, 5, 5};
  const LuminaireSampler sampler = made(l);
  for (const double tilt : {0.0, 0.5, kPi / 2, kPi}) {
    const Vec3d normal(std::sin(tilt), std::cos(tilt), 0);
    EXPECT_NEAR(irradiance(sampler, {3, 4, 5}, normal), 5 * kPi * (1 + std::cos(tilt)) / 2, 1e-3) << tilt;
  }
  l.whole_sphere = true;
  EXPECT_NEAR(irradiance(made(l), {}, glm::normalize(Vec3d(1, 2, -3))), 5 * kPi, 1e-3);
}

TEST(ClosedForms, AnImageOfOneValueIsAConstantSky) {
  auto white = std::make_shared<LightImage>();
  white->width = 13, white->height = 7;
  white->pixels.assign(13 * 7, Radiance3{1, 1, 1});
  Luminaire l = of_kind("hemisphere");
  l.axis = {0, 1, 0}, l.radiance = {5, 5, 5}, l.light_image = white;
  const LuminaireSampler sampler = made(l);
  EXPECT_NEAR(irradiance(sampler, {}, {0, 1, 0}), 5 * kPi, 1e-3);
  EXPECT_NEAR(sampler.sample({}, {0.2f, 0.7f}).pdf, 1 / (2 * kPi), 1e-6);
}

TEST(ClosedForms, ASpotSendsWhatItsOmniSendsInsideItsConeOnly) {
  Luminaire l = of_kind("spot");
  l.power = {10, 10, 10}, l.radius = 0.01f, l.half_angle = l.inner_half_angle = 0.5f;
  const LuminaireSampler sampler = made(l);
  EXPECT_FLOAT_EQ(sampler.total_power().g, float(10 * (1 - std::cos(double{0.5f})) / 2));
  const auto at = [&](double angle) {
    const Vec3d direction = std::cos(angle) * Vec3d(l.axis) + std::sin(angle) * Vec3d(l.up);
    return sampler.sample(2.0 * direction, {}).biradiance.g;
  };
  EXPECT_FLOAT_EQ(at(0), float(10 / (4 * kPi * 4)));
  EXPECT_FLOAT_EQ(at(0.4999), at(0));
  EXPECT_EQ(at(0.5001), 0);
  EXPECT_EQ(at(3), 0);
}

TEST(ClosedForms, TheUnifiedPointIsOmniSpotAndDirectional) {
  Luminaire l = of_kind("unified_point");
  l.power = {10, 10, 10}, l.radius = 0.01f;
  const Vec3d receiver(1, 2, -2);  // r = 3
  EXPECT_FLOAT_EQ(made(l).sample(receiver, {}).biradiance.g, float(10 / (4 * kPi * 9)));
  l.attenuation = {0.5f, 2, 0.25f};
  EXPECT_FLOAT_EQ(made(l).sample(receiver, {}).biradiance.g, float(10 / (4 * kPi * (0.5 + 6 + 2.25))));
  l.at_infinity = true;
  const LuminaireSample sun = made(l).sample(receiver, {});
  EXPECT_FLOAT_EQ(sun.biradiance.g, float(10 / (4 * kPi * 0.5)));
  EXPECT_TRUE(std::isinf(sun.distance));
  EXPECT_EQ(sun.direction, -l.axis);
  EXPECT_TRUE(std::isinf(made(l).total_power().g));
}

/// A panel's power is its own; its size changes its radiance.
TEST(ClosedForms, AreaLightsKeepTheirPowerWhateverTheirSize) {
  for (const float size : {0.1f, 1.0f, 30.0f}) {
    Luminaire l = of_kind("rectangle");
    l.power = {7, 7, 7}, l.extent = {size, 2 * size};
    EXPECT_EQ(made(l).total_power().g, 7);
    EXPECT_FLOAT_EQ(made(l).meet(Vec3d(l.axis), -l.axis)->radiance.g, float(7 / (kPi * 2 * size * size)));
  }
}

std::shared_ptr<LightImage> black(int width, int height) {
  auto image = std::make_shared<LightImage>();
  image->width = width, image->height = height;
  image->pixels.resize(static_cast<size_t>(width) * static_cast<size_t>(height));
  return image;
}

/// Mitsuba's envmap without a transform: (x, y, z) -> u = atan2(x, -z) / 2 pi, v = acos(y) / pi.
TEST(Images, ASkyLiesAsInMitsuba) {
  const int width = 64, height = 32;
  Luminaire l = of_kind("hemisphere");
  l.axis = {0, 1, 0}, l.up = {0, 0, 1}, l.radiance = {1, 1, 1}, l.whole_sphere = true;
  for (int i = 0; i < 50; ++i) {
    const auto pick = [&](int salt, int n) { return int(random_bits(5, i, salt, 0) % uint64_t(n)); };
    const int column = pick(0, width), row = pick(1, height);
    auto image = black(width, height);
    image->pixels[static_cast<size_t>(row * width + column)] = {1, 1, 1};
    l.light_image = image;
    const LuminaireSampler sampler = made(l);
    const double phi = 2 * kPi * (column + 0.5) / width, theta = kPi * (row + 0.5) / height;
    const Vec3d direction(std::sin(theta) * std::sin(phi), std::cos(theta), -std::sin(theta) * std::cos(phi));
    EXPECT_NEAR(sampler.meet({}, Vec3f(direction))->radiance.g, 1, 1e-4);
    EXPECT_EQ(sampler.meet({}, Vec3f(-direction))->radiance.g, 0);
    // And all samples go there: to the pixel or, as values between pixels are mixed, its neighbours.
    const LuminaireSample s = sampler.sample({}, {0.5f, 0.5f});
    EXPECT_GT(glm::dot(Vec3d(s.direction), direction), std::cos(1.5 * kPi / height));
  }
}

TEST(Images, WithoutWholeSphereTheLowerHalfIsDark) {
  auto image = black(8, 4);
  for (Radiance3& p : image->pixels) p = {1, 1, 1};
  Luminaire l = of_kind("hemisphere");
  l.axis = {0, 1, 0}, l.radiance = {1, 1, 1}, l.light_image = image;
  const LuminaireSampler sampler = made(l);
  EXPECT_TRUE(sampler.meet({}, glm::normalize(Vec3f(1, 0.01f, 0))));
  EXPECT_FALSE(sampler.meet({}, glm::normalize(Vec3f(1, -0.01f, 0))));
  for (int i = 0; i < 1000; ++i) {
    const auto u = [&](int salt) { return uniform01(random_bits(6, i, salt, 0)); };
    EXPECT_GE(sampler.sample({}, {u(0), u(1)}).direction.y, 0);
  }
}

/// A spot above a floor, seen from behind it: the picture's top is `up`, its right the viewer's.
TEST(Images, AGoboShowsItsSlideUprightToWhoStandsBehindIt) {
  auto image = black(2, 2);
  image->pixels = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};  // red green, blue white
  Luminaire l = of_kind("gobo");
  l.axis = {0, 0, -1}, l.up = {0, 1, 0}, l.power = {1, 1, 1}, l.half_angle = l.inner_half_angle = float(kPi / 4);
  l.radius = 0.01f, l.light_image = image;
  const LuminaireSampler sampler = made(l);
  // At the pixels' centres, but for the rounding of tan(half angle).
  const auto expect = [&](double x, double y, const Vec3f& colour) {
    const Irradiance3 m = sampler.sample({x, y, -1}, {}).biradiance;
    EXPECT_LT(glm::length(Vec3f(m.r, m.g, m.b) / m.max() - colour), 1e-6f) << x << ", " << y;
  };
  expect(-0.5, 0.5, {1, 0, 0});  // looking along -z, the left is -x
  expect(0.5, 0.5, {0, 1, 0});
  expect(-0.5, -0.5, {0, 0, 1});
  expect(0.5, -0.5, {1, 1, 1});
}

TEST(Images, WhatIsNoLightIsRefusedWithItsPixel) {
  for (const float wrong : {-1.0f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    auto image = black(4, 3);
    image->pixels[6].g = wrong;
    Luminaire l = of_kind("hemisphere");
    l.axis = {0, 1, 0}, l.radiance = {1, 1, 1}, l.light_image = image, l.image = "a.exr", l.where = "s.toml:3:1";
    const auto sampler = LuminaireSampler::make(l);
    ASSERT_FALSE(sampler.ok());
    EXPECT_NE(sampler.error().message.find("s.toml:3:1: 'image' a.exr is no light: pixel (2, 1)"), std::string::npos)
        << sampler.error().message;
  }
}

TEST(Images, ABlackOneGivesNoLightAndNoNaN) {
  for (const char* kind : {"hemisphere", "gobo"}) {
    Luminaire l = of_kind(kind);
    l.power = {1, 1, 1}, l.radiance = {1, 1, 1}, l.half_angle = 0.5f, l.light_image = black(4, 3);
    const LuminaireSampler sampler = made(l);
    EXPECT_EQ(sampler.sample({1, 2, 3}, {0.5f, 0.5f}).biradiance.g, 0);
    EXPECT_EQ(sampler.emit({0.5f, 0.5f}, {0.5f, 0.5f}, {}).power.g, 0);
    EXPECT_NEAR(glm::length(sampler.emit({0.5f, 0.5f}, {0.5f, 0.5f}, {}).direction), 1, 1e-6);
  }
}

}  // namespace
}  // namespace world
