// Hard cases L1..L17, S4 and S8: luminaires where the plain formula divides by zero, cancels or forgets. Where a naive
// way is known, it runs too and must fail.
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "world/base/random.h"
#include "world/luminaires/luminaire.h"
#include "world/numbers/robust.h"

namespace world {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr float kLast = 1 - 0x1p-24f;  // the largest random number

Luminaire of_kind(const char* kind) {
  Luminaire l;
  l.kind = kind;
  l.power = {1, 1, 1};
  l.radius = 0.01f;
  return l;
}
/// Of radiance 1, if it has a radiance.
Luminaire bright(const char* kind) {
  Luminaire l = of_kind(kind);
  l.power = {}, l.radiance = {1, 1, 1};
  return l;
}
LuminaireSampler made(const Luminaire& l) {
  auto sampler = LuminaireSampler::make(l);
  if (!sampler.ok()) ADD_FAILURE() << sampler.error().message;
  return std::move(*sampler);
}

float uniform(int64_t i, int64_t salt) { return uniform01(random_bits(11, i, salt, 0)); }

enum class Points { random, stratified, r2, midpoint };

/// Irradiance from N = side^2 samples.
double irradiance(const LuminaireSampler& sampler, const Vec3d& receiver, const Vec3d& normal, int side,
                  Points points = Points::midpoint) {
  double sum = 0;
  for (int i = 0, n = 0; i < side; ++i)
    for (int j = 0; j < side; ++j, ++n) {
      const float s = static_cast<float>(side);
      Vec2f u(0);
      if (points == Points::random) u = {uniform(n, 0), uniform(n, 1)};
      if (points == Points::stratified) u = {(float(i) + uniform(n, 0)) / s, (float(j) + uniform(n, 1)) / s};
      if (points == Points::midpoint) u = {(float(i) + 0.5f) / s, (float(j) + 0.5f) / s};
      // source: Martin Roberts. The Unreasonable Effectiveness of Quasirandom Sequences. 2018
      if (points == Points::r2) {
        const double a = 0.5 + 0.75487766624669276 * n, b = 0.5 + 0.56984029099805327 * n;
        u = {static_cast<float>(a - std::floor(a)), static_cast<float>(b - std::floor(b))};
      }
      const LuminaireSample sample = sampler.sample(receiver, glm::min(u, Vec2f(kLast)));
      sum += sample.biradiance.g * std::max(glm::dot(Vec3d(sample.direction), normal), 0.0);
    }
  return sum / (double(side) * side);
}

TEST(L1, AnOmniStaysFiniteAndMonotoneDownToItsOwnPlace) {
  const LuminaireSampler omni = made(of_kind("omni"));
  const double most = 1 / (4 * kPi * double{0.01f} * double{0.01f});
  float before = std::numeric_limits<float>::infinity();
  for (const double r : {0.0, 1e-300, 1e-30, 1e-19, 1e-3, double{0.01f}, 0.011, 1.0, 1e9}) {
    const LuminaireSample s = omni.sample({0, r, 0}, {});
    EXPECT_LE(s.biradiance.g, most * (1 + 1e-7)) << r;
    EXPECT_LE(s.biradiance.g, before) << r;
    EXPECT_NEAR(glm::length(s.direction), 1, 1e-6) << r;
    before = s.biradiance.g;
  }
  const float r = 1e-30f;  // the plain formula
  EXPECT_TRUE(std::isinf(1 / (4 * float(kPi) * r * r)));
}

TEST(L2, ASphereWhollyAboveTheHorizonIsAnOmni) {
  Luminaire l = bright("sphere");
  l.radius = 0.25f;
  const LuminaireSampler sphere = made(l);
  for (const double ratio : {1.001, 1.5, 3.0, 100.0, 1e6}) {
    const double d = 0.25 * ratio;
    // The mean cosine over a cone around the normal's angle theta is cos(theta) (1 + cos(half angle)) / 2.
    const double mean_cosine = (1 + std::sqrt((1 - 1 / ratio) * (1 + 1 / ratio))) / 2;
    const double exact = kPi / (ratio * ratio);
    EXPECT_NEAR(sphere.sample({0, -d, 0}, {0.3f, 0.4f}).biradiance.g * mean_cosine / exact, 1, 1e-6) << ratio;
  }
  // 1 - cosine, in float, has nothing left at 1e6 radii.
  const float ratio = 1e-6f;
  EXPECT_EQ(1 - std::sqrt(1 - ratio * ratio), 0);
}

/// source of the closed form: Inigo Quilez. Sphere - ambient occlusion, with the horizon's clipping; its limits are 1/2
/// of a hemisphere at contact and 2 / (3 pi) (R/d)^3 far away, as a half disk's first moment gives.
TEST(L3, ASphereWhoseCentreIsOnTheHorizonGivesItsUpperHalf) {
  Luminaire l = bright("sphere");
  l.radius = 1;
  const LuminaireSampler sphere = made(l);
  for (const double h : {1.0, 1.2, 2.0, 10.0}) {
    const double root = std::sqrt((h - 1) * (h + 1));
    const double exact = std::atan2(1, root) - root / (h * h);
    EXPECT_NEAR(irradiance(sphere, {h, 0, 0}, {0, 1, 0}, 512) / exact, 1, 1e-3) << h;
  }
}

TEST(L4, InsideASphereAndOnItEveryPlaneGetsPiL) {
  Luminaire l = bright("sphere");
  l.radius = 0.5f;
  const LuminaireSampler sphere = made(l);
  for (const double d : {0.0, 1e-30, 0.25, 0.5 - 1e-15})
    for (const Vec3d& normal : {Vec3d(0, 1, 0), Vec3d(1, 0, 0), glm::normalize(Vec3d(-1, 2, 3))})
      EXPECT_NEAR(irradiance(sphere, {d, 0, 0}, normal, 512), kPi, 1e-3) << d;
  EXPECT_NEAR(irradiance(sphere, {0.5, 0, 0}, {-1, 0, 0}, 512), kPi, 1e-3);
}

/// Bounds: the errors that hard-cases.md measured at N = 4096, doubled; of random points 4 sigma.
TEST(L5, AUnitSquareAboveAPlaneComesOutRightWithAnySampler) {
  Luminaire l = bright("rectangle");
  l.extent = {1, 1};
  const Vec3d normal(0, 1, 0), receiver(0, -1, 0);
  const double a = 0.5 / std::sqrt(1.25), exact = 4 * a * std::atan(a);  // pi times the form factor
  EXPECT_NEAR(exact / kPi, 0.23947, 2e-5);
  l.uniform_area = true;
  const LuminaireSampler by_area = made(l);
  EXPECT_NEAR(irradiance(by_area, receiver, normal, 64, Points::random) / exact, 1, 4 * 2.8e-3);
  EXPECT_NEAR(irradiance(by_area, receiver, normal, 64, Points::stratified) / exact, 1, 4 * 8.7e-5);
  EXPECT_NEAR(irradiance(by_area, receiver, normal, 64, Points::r2) / exact, 1, 4 * 1.6e-5);
  EXPECT_NEAR(irradiance(by_area, receiver, normal, 64, Points::midpoint) / exact, 1, 2 * 4.7e-5);
  l.uniform_area = false;
  const LuminaireSampler by_solid_angle = made(l);
  for (const Points points : {Points::random, Points::stratified, Points::r2, Points::midpoint})
    EXPECT_NEAR(irradiance(by_solid_angle, receiver, normal, 64, points) / exact, 1,
                points == Points::random ? 4 * 2.8e-3 : 1e-4);
  // An omni of the same intensity towards the plane, instead.
  Luminaire omni = of_kind("omni");
  omni.power = {float(4 * kPi), 0, 0};
  EXPECT_NEAR(made(omni).sample(receiver, {}).biradiance.r / exact - 1, 0.329, 1e-3);
}

TEST(L6, ADiskOnItsAxisGivesPiLTimesTheSineSquared) {
  Luminaire l = bright("disk");
  for (const double height : {1.0, 2.0, 100.0, 1e4}) {
    l.radius = 1, l.uniform_area = true;
    const double exact = kPi / (1 + height * height);
    EXPECT_NEAR(irradiance(made(l), {0, -height, 0}, {0, 1, 0}, 512) / exact, 1, 1e-5) << height;
  }
}

TEST(L7, AUniformSkyGivesPi) {
  Luminaire l = bright("hemisphere");
  l.axis = {0, 1, 0};
  const LuminaireSampler sky = made(l);
  // M is 2 pi whatever the sample, and the mean cosine over a hemisphere is 1/2.
  EXPECT_NEAR(sky.sample({}, {0.1f, 0.9f}).biradiance.g / 2, kPi, 1e-6);
  EXPECT_NEAR(irradiance(sky, {}, {0, 1, 0}, 100, Points::random), kPi, 3 * kPi / std::sqrt(3.0) / 100);
}

TEST(L8, AMeshIsTheSumOfItsParts) {
  Luminaire rectangle = of_kind("rectangle");
  rectangle.extent = {2, 1}, rectangle.uniform_area = true;
  Luminaire mesh = of_kind("mesh");
  // 100 quads of uneven widths, two triangles each, emitting down.
  for (int i = 0; i < 100; ++i) {
    const auto x = [](int k) { return 2 * float(k) * float(k) / 1e4f - 1; };
    const Vec3f a(x(i), 0, -0.5f), b(x(i + 1), 0, -0.5f), c(x(i + 1), 0, 0.5f), d(x(i), 0, 0.5f);
    mesh.triangles.insert(mesh.triangles.end(), {a, b, c, a, c, d});
  }
  const LuminaireSampler one = made(rectangle), many = made(mesh);
  EXPECT_NEAR(many.surface_area(), 2, 1e-6);
  EXPECT_EQ(many.total_power(), one.total_power());
  const Vec3d receiver(0.3, -0.8, 0.2);
  EXPECT_NEAR(many.meet(receiver, {0, 1, 0})->radiance.g / one.meet(receiver, {0, 1, 0})->radiance.g, 1, 1e-6);
  EXPECT_NEAR(many.meet(receiver, {0, 1, 0})->pdf / one.meet(receiver, {0, 1, 0})->pdf, 1, 1e-5);
  const double a = irradiance(one, receiver, {0, 1, 0}, 200, Points::random),
               b = irradiance(many, receiver, {0, 1, 0}, 200, Points::random),
               exact = irradiance(one, receiver, {0, 1, 0}, 512);
  const double sigma = 0.6 * exact / 200;  // the integrand's deviation is below 0.6 of its mean
  EXPECT_NEAR(a, exact, 3 * sigma);
  EXPECT_NEAR(b, exact, 3 * sigma);
}

TEST(L9, TrianglesWithoutAreaAndWithNaNAreDroppedAndAMeshOfNothingElseRefused) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Vec3f> good{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  Luminaire l = of_kind("mesh");
  l.triangles = {{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 0, 0}, {1, 1, 1}, {3, 3, 3}, {0, nan, 0}, {1, 0, 0}, {0, 0, 1}};
  EXPECT_FALSE(LuminaireSampler::make(l).ok());
  l.triangles.insert(l.triangles.end(), good.begin(), good.end());
  const LuminaireSampler mixed = made(l);
  l.triangles = good;
  const LuminaireSampler alone = made(l);
  EXPECT_EQ(mixed.total_power(), alone.total_power());
  EXPECT_EQ(mixed.surface_area(), alone.surface_area());
  for (int i = 0; i < 100; ++i) {
    const Vec2f u(uniform(i, 0), uniform(i, 1));
    EXPECT_EQ(mixed.sample({0.2, -1, 0.1}, u).biradiance, alone.sample({0.2, -1, 0.1}, u).biradiance);
  }
}

TEST(L10, ASpotOfHalfAnglePiIsAnOmni) {
  const LuminaireSampler omni = made(of_kind("omni"));
  for (const float half_angle : {float(kPi), std::nextafter(float(kPi), 0.0f)}) {
    Luminaire l = of_kind("spot");
    l.half_angle = l.inner_half_angle = half_angle;
    const LuminaireSampler spot = made(l);
    EXPECT_EQ(spot.total_power(), omni.total_power());
    for (int i = 0; i < 1000; ++i) {
      const Vec3d receiver(uniform(i, 0) - 0.5, uniform(i, 1) - 0.5, uniform(i, 2) - 0.5);
      EXPECT_EQ(spot.sample(receiver, {}).biradiance, omni.sample(receiver, {}).biradiance);
    }
    EXPECT_EQ(spot.sample(-3.0 * Vec3d(l.axis), {}).biradiance, omni.sample({0, 3, 0}, {}).biradiance);
  }
}

/// The case asks for a clamp to 1e-3, so that nothing divides by 1 - cos or tan; here nothing does, and a closed spot
/// is closed (14.11.8).
TEST(L11, ASpotMayBeAsNarrowAsOneLikes) {
  Luminaire l = of_kind("spot");
  for (const float half_angle : {1e-15f, 1e-4f, 1e-3f, 0.1f}) {
    l.half_angle = l.inner_half_angle = half_angle;
    const LuminaireSampler spot = made(l);
    const long double s = std::sin(0.5L * half_angle);
    EXPECT_NEAR(spot.total_power().g / static_cast<double>(s * s), 1, 2e-7) << half_angle;
    EXPECT_FLOAT_EQ(spot.sample(2.0 * Vec3d(l.axis), {}).biradiance.g, float(1 / (16 * kPi))) << half_angle;
    const Vec3d beside = Vec3d(l.axis) + 1.01 * double{half_angle} * Vec3d(l.up);
    EXPECT_TRUE(half_angle < 1e-9f || spot.sample(beside, {}).biradiance.g == 0) << half_angle;
    for (const Vec2f& u : {Vec2f(0, 0), Vec2f(kLast, kLast), Vec2f(0.5f, 0.3f)}) {
      const EmittedPhoton photon = spot.emit({}, u, {});
      EXPECT_NEAR(photon.power.g, spot.total_power().g, 1e-6f * spot.total_power().g);
      EXPECT_LE(glm::length(photon.direction - l.axis), half_angle + 1e-6f);
    }
  }
  l.half_angle = l.inner_half_angle = 0;
  const LuminaireSampler closed = made(l);
  EXPECT_EQ(closed.total_power().g, 0);
  EXPECT_EQ(closed.sample(2.0 * Vec3d(l.axis), {}).biradiance.g, 0);
  EXPECT_EQ(closed.emit({}, {0.5f, 0.5f}, {}).power.g, 0);
  EXPECT_EQ(1 - std::cos(1e-4f), 0);  // the plain formula
}

TEST(L12, ConesThatAreEqualOrTheWrongWayRoundHaveAHardEdge) {
  Luminaire l = of_kind("spot");
  l.half_angle = 0.5f;
  for (const float inner : {0.5f, 0.6f, 3.0f, std::numeric_limits<float>::quiet_NaN()}) {
    l.inner_half_angle = inner;
    const LuminaireSampler spot = made(l);
    const auto at = [&](double angle) {
      return spot.sample(std::cos(angle) * Vec3d(l.axis) + std::sin(angle) * Vec3d(l.up), {}).biradiance.g;
    };
    EXPECT_FLOAT_EQ(at(0.499), at(0)) << inner;
    EXPECT_GT(at(0), 0) << inner;
    EXPECT_EQ(at(0.501), 0) << inner;
    EXPECT_FLOAT_EQ(spot.total_power().g, float((1 - std::cos(double{0.5f})) / 2)) << inner;
  }
}

TEST(L13, BehindAGoboAndBesideItsSlideThereIsNothing) {
  auto image = std::make_shared<LightImage>();
  image->width = image->height = 2, image->pixels.assign(4, Radiance3{1, 1, 1});
  Luminaire l = of_kind("gobo");
  l.half_angle = l.inner_half_angle = 1.2f, l.light_image = image;
  const LuminaireSampler gobo = made(l);
  EXPECT_GT(gobo.sample(Vec3d(l.axis), {}).biradiance.g, 0);
  for (int i = 0; i < 1000; ++i) {
    const Vec3d p(uniform(i, 0) - 0.5, uniform(i, 1) - 0.5, uniform(i, 2) - 0.5);
    const double along = glm::dot(glm::normalize(p), Vec3d(l.axis));
    EXPECT_TRUE(along >= std::cos(1.2) || gobo.sample(p, {}).biradiance.g == 0) << along;
  }
  EXPECT_EQ(gobo.sample({1, 0, 0}, {}).biradiance.g, 0);  // in the plane of the slide, where z is 0
  EXPECT_EQ(gobo.sample({0, 0, 0}, {}).biradiance.g, gobo.sample({0, 0, 0}, {}).biradiance.g);
}

std::string error_of(const std::string& keys) {
  auto document = TomlDocument::parse("[[luminaire]]\n" + keys, "a.toml");
  for (TomlTable table : document->root().array_of_tables("luminaire")) read_luminaire(table, {});
  const Status status = document->finish();
  return status.ok() ? "" : status.error().message;
}

TEST(L14, ADirectionalWithoutADirectionIsRefused) {
  EXPECT_NE(error_of("kind = \"directional\"\nirradiance = [1, 1, 1]\ndirection = [0, 0, 0]\n").find("a.toml:4:13: "),
            std::string::npos);
  EXPECT_EQ(error_of("kind = \"directional\"\nirradiance = [1, 1, 1]\ndirection = [0, 1e-30, 0]\n"), "");
  Luminaire l = of_kind("directional");
  l.axis = Vec3f(0);
  EXPECT_FALSE(LuminaireSampler::make(l).ok());
}

TEST(L15, APanelInTheReceiversPlaneGivesNothingAndNeverLess) {
  Luminaire l = bright("rectangle");
  l.extent = {2, 2}, l.axis = {0, -1, 0};
  for (const bool by_area : {false, true}) {
    l.uniform_area = by_area;
    const LuminaireSampler panel = made(l);
    for (const double ulps : {-2.0, -1.0, 0.0, 1.0, 2.0})
      for (const double x : {1.5, 3.0, 100.0}) {
        const Vec3d receiver(x, -ulps * 0x1p-52, 0.1);
        const double e = irradiance(panel, receiver, {0, 1, 0}, 16);
        EXPECT_GE(e, 0) << ulps << ' ' << x;
        EXPECT_LE(e, 1e-6) << ulps << ' ' << x;
      }
  }
}

TEST(L16, PowerOfZeroGivesNothingAndWhatIsNoPowerIsRefused) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  for (const char* kind : {"omni", "spot", "rectangle", "disk", "sphere", "unified_point"}) {
    Luminaire l = of_kind(kind);
    l.power = {};
    const LuminaireSampler dark = made(l);
    EXPECT_EQ(dark.sample({0.1, -1, 0.2}, {0.5f, 0.5f}).biradiance.max(), 0) << kind;
    EXPECT_EQ(dark.total_power().max(), 0) << kind;
    for (const float wrong : {-1.0f, nan, infinity, -infinity}) {
      l.power.b = wrong;
      EXPECT_FALSE(LuminaireSampler::make(l).ok()) << kind << ' ' << wrong;
    }
  }
  for (const char* wrong : {"-1", "nan", "inf", "-inf"})
    EXPECT_NE(error_of("kind = \"omni\"\nposition = [0, 0, 0]\npower_w = [" + std::string(wrong) + ", 1, 1]\n")
                  .find("a.toml:4:12: 'power_w[0]' is "),
              std::string::npos)
        << wrong;
}

TEST(L17, TenThousandDimLightsAreNotLostBesideOneHugeOne) {
  Luminaire l = of_kind("omni");
  const float dim = made(l).sample({0, 1, 0}, {}).biradiance.g;
  l.power = {1e8f, 1e8f, 1e8f};
  const float huge = made(l).sample({0, 1, 0}, {}).biradiance.g;
  float plain = huge;
  KahanSum<float> careful;
  PairwiseSum<float> pairwise;
  careful.add(huge), pairwise.add(huge);
  for (int i = 0; i < 10000; ++i) plain += dim, careful.add(dim), pairwise.add(dim);
  const double exact = 1e4 * double{dim};
  EXPECT_NEAR((double{careful.value()} - huge) / exact, 1, 1e-3);
  EXPECT_NEAR((double{pairwise.value()} - huge) / exact, 1, 1e-3);
  EXPECT_EQ(plain, huge);
}

TEST(S4, ALightInTheFacesPlaneGivesExactlyNothing) {
  const Vec3d normal(0, 1, 0);
  const auto given = [&](const LuminaireSampler& sampler, const Vec3d& receiver, Vec2f u) {
    const LuminaireSample s = sampler.sample(receiver, u);
    return s.biradiance.g * std::max(glm::dot(Vec3d(s.direction), normal), 0.0);
  };
  const LuminaireSampler omni = made(of_kind("omni"));
  Luminaire panel = bright("rectangle"), disk = bright("disk");
  panel.axis = disk.axis = {0, 1, 0};
  const LuminaireSampler rectangle = made(panel), round = made(disk);
  for (int i = 0; i < 1000; ++i) {
    const Vec3d receiver(100 * (uniform(i, 0) - 0.5), 0, 100 * (uniform(i, 1) - 0.5));
    const Vec2f u(uniform(i, 2), uniform(i, 3));
    EXPECT_EQ(given(omni, receiver, u), 0);
    EXPECT_EQ(given(rectangle, receiver, u), 0);
    EXPECT_EQ(given(round, receiver, u), 0);
  }
}

TEST(S8, ADirectionalsDirectionIsTheSameBitsEverywhere) {
  Luminaire l = of_kind("directional");
  l.axis = glm::normalize(Vec3f(0.3f, -0.9f, 0.2f)), l.irradiance = {1, 1, 1};
  const LuminaireSampler sun = made(l);
  const Vec3f direction = sun.sample({}, {}).direction;
  EXPECT_LT(glm::length(direction + l.axis), 2e-7f);
  bool differs = false;
  for (int i = 0; i < 1000; ++i) {
    const Vec3d receiver(2e8 * (uniform(i, 0) - 0.5), 2e8 * (uniform(i, 1) - 0.5), 2e8 * (uniform(i, 2) - 0.5));
    const LuminaireSample s = sun.sample(receiver, {uniform(i, 3), uniform(i, 4)});
    EXPECT_EQ(s.direction, direction);
    EXPECT_EQ(s.biradiance, (Irradiance3{1, 1, 1}));
    EXPECT_TRUE(std::isinf(s.distance));
    // A point 1e8 m away instead.
    differs |= glm::length(glm::normalize(-1e8f * l.axis - Vec3f(receiver)) - direction) > 0.1f;
  }
  EXPECT_TRUE(differs);
}

/// B14: what one sample may bring where a lamp's face meets a wall's.
TEST(B14, ASampleOfATouchingPanelBringsAtMostPiL) {
  Luminaire l = bright("rectangle");
  l.extent = {1, 1}, l.axis = {0, -1, 0}, l.up = {0, 0, 1};
  double worst = 0, worst_by_area = 0;
  for (const bool by_area : {false, true}) {
    l.uniform_area = by_area;
    const LuminaireSampler panel = made(l);
    for (int i = 0; i < 20000; ++i) {
      // On the wall x = 0.5, which touches the panel's edge, at heights of 1e-6 to 1 m below it.
      const double height = std::pow(10, -6 * uniform(i, 0));
      const LuminaireSample s = panel.sample({0.5, -height, uniform(i, 1) - 0.5}, {uniform(i, 2), uniform(i, 3)});
      const double brought = s.biradiance.g * std::max(-double{s.direction.x}, 0.0);
      (by_area ? worst_by_area : worst) = std::max(by_area ? worst_by_area : worst, brought);
    }
  }
  EXPECT_LE(worst, kPi * (1 + 1e-6));
  EXPECT_GT(worst_by_area, 10 * kPi);
}

}  // namespace
}  // namespace world
