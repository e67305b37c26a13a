// Laws of all luminaires, run on each file of the folder: what photons carry, what samples bring, what rays meet.
#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/chi_squared.h"
#include "world/base/random.h"
#include "world/luminaires/emitter.shared.h"
#include "world/luminaires/kinds.h"

namespace world {
namespace {

constexpr double kPi = 3.14159265358979323846;

class Random {
 public:
  explicit Random(uint64_t seed) : seed_(seed) {}
  float unit() { return uniform01(random_bits(seed_, static_cast<int64_t>(++n_), 0, 0)); }
  double uniform(double low, double high) {
    return low + (high - low) * uniform01_double(random_bits(seed_, static_cast<int64_t>(++n_), 0, 0));
  }
  Vec2f pair() {
    const float x = unit();
    return {x, unit()};
  }
  Vec3d direction() {
    const double z = uniform(-1, 1), phi = uniform(0, 2 * kPi), r = std::sqrt(1 - z * z);
    return {r * std::cos(phi), r * std::sin(phi), z};
  }

 private:
  uint64_t seed_, n_ = 0;
};

struct Mean {
  double sum = 0, squares = 0, n = 0;
  void add(double x) { sum += x, squares += x * x, ++n; }
  double value() const { return sum / n; }
  double error() const { return std::sqrt(std::max(squares / n - value() * value(), 0.0) / n); }
};

std::shared_ptr<const LightImage> picture(int width, int height) {
  auto image = std::make_shared<LightImage>();
  image->width = width, image->height = height;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float v = 0.1f + uniform01(random_bits(7, x, y, 0));
      image->pixels.push_back({v, 0.5f * v * v, (x + y) % 3 ? v : 0.0f});
    }
  return image;
}

struct Example {
  std::string what;
  Luminaire luminaire;
};

/// Each kind as it is by default and, by the keys it has, its variants. Turned and of odd sizes, so that no frame fits
/// by chance.
std::vector<Example> examples() {
  std::vector<Example> all;
  for (const LuminaireKind& kind : luminaire_members()) {
    Luminaire l;
    l.name = l.kind = kind.name;
    l.axis = glm::normalize(Vec3f(0.3f, -0.8f, 0.5f));
    l.up = glm::normalize(glm::cross(l.axis, Vec3f(0.2f, 0.1f, 0.9f)));
    l.power = {30, 60, 90}, l.irradiance = {3, 2, 1}, l.radiance = {0.5f, 1, 2};
    l.extent = {1.5f, 0.7f};
    l.radius = kind.keys & shared::kKeyClamp ? 0.01f : 0.6f;
    if (kind.keys & shared::kKeyCone) l.half_angle = l.inner_half_angle = 0.8f;
    if (kind.keys & shared::kKeySlide) l.light_image = picture(40, 33);
    // Two triangles like a roof, so that none hides the other from where both are seen.
    const Vec3f side = glm::cross(l.up, l.axis), ridge = 0.2f * l.axis;
    for (const float turn : {1.0f, -1.0f})
      l.triangles.insert(l.triangles.end(),
                         {0.5f * turn * l.up + ridge, -0.5f * turn * l.up + ridge, turn * 0.9f * side + 0.3f * l.up});
    all.push_back({l.kind, l});
    const auto variant = [&](const char* what, const auto& change) {
      Example e{l.kind + ", " + what, l};
      change(e.luminaire);
      all.push_back(e);
    };
    if (kind.keys & shared::kKeySoftEdge) variant("soft edge", [](Luminaire& v) { v.inner_half_angle = 0.4f; });
    if (kind.keys & shared::kKeyCone && !(kind.keys & shared::kKeySlide))
      variant("all around", [](Luminaire& v) { v.half_angle = v.inner_half_angle = float(kPi); });
    if (kind.keys & shared::kKeyAttenuation)
      variant("at infinity", [](Luminaire& v) { v.at_infinity = true, v.attenuation = {2, 0, 0}; });
    if (kind.keys & shared::kKeySampling) variant("by area", [](Luminaire& v) { v.uniform_area = true; });
    if (kind.keys & shared::kKeySky) {
      variant("whole", [](Luminaire& v) { v.whole_sphere = true; });
      variant("with an image", [](Luminaire& v) { v.light_image = picture(16, 9); });
      variant("whole, with an image", [](Luminaire& v) { v.light_image = picture(16, 9), v.whole_sphere = true; });
    }
  }
  return all;
}

LuminaireSampler made(const Luminaire& l) {
  auto sampler = LuminaireSampler::make(l);
  if (!sampler.ok()) ADD_FAILURE() << sampler.error().message;
  return std::move(*sampler);
}

/// Points from which something of it is seen, and one or two from which not.
std::vector<Vec3d> receivers(const Luminaire& l) {
  std::vector<Vec3d> points;
  for (const Vec3d& offset : {Vec3d(0, 0, 0), Vec3d(0.5, 0, 0.2), Vec3d(-0.3, 0.4, 0.8), Vec3d(1, 2, -3)})
    for (const double along : {0.3, 1.7, 40.0, -1.0}) points.push_back(along * Vec3d(l.axis) + offset);
  return points;
}

bool finite(const auto& bands) {
  return std::isfinite(bands.r) && std::isfinite(bands.g) && std::isfinite(bands.b) && bands.r >= 0 && bands.g >= 0 &&
         bands.b >= 0;
}

TEST(EveryLuminaire, IsListedAndMade) {
  EXPECT_GE(luminaire_kinds().size(), 10u);
  const std::vector<std::string> kinds = luminaire_kinds();
  EXPECT_TRUE(std::is_sorted(kinds.begin(), kinds.end()));
  for (const Example& e : examples()) {
    const auto sampler = LuminaireSampler::make(e.luminaire);
    EXPECT_TRUE(sampler.ok()) << e.what << ": " << sampler.error().message;
  }
  Luminaire none;
  none.kind = "moon";
  EXPECT_FALSE(LuminaireSampler::make(none).ok());
}

/// 4 sigma; a slide's total is a midpoint rule, right to 1e-3.
TEST(EveryLuminaire, PhotonsCarryTheStatedPower) {
  for (const Example& e : examples()) {
    const LuminaireSampler sampler = made(e.luminaire);
    const Power3 total = sampler.total_power();
    if (std::isinf(total.g)) {
      EXPECT_TRUE(std::isinf(sampler.surface_area())) << e.what;
      continue;
    }
    Random random(1);
    Mean mean[3];
    for (int i = 0; i < 100000; ++i) {
      const Vec2f u = random.pair(), v = random.pair();
      const EmittedPhoton photon = sampler.emit(u, v, {});
      mean[0].add(photon.power.r), mean[1].add(photon.power.g), mean[2].add(photon.power.b);
      ASSERT_NEAR(glm::length(photon.direction), 1, 1e-6) << e.what;
    }
    EXPECT_NEAR(mean[0].value(), total.r, 4 * mean[0].error() + 1e-3 * total.r) << e.what;
    EXPECT_NEAR(mean[1].value(), total.g, 4 * mean[1].error() + 1e-3 * total.g) << e.what;
    EXPECT_NEAR(mean[2].value(), total.b, 4 * mean[2].error() + 1e-3 * total.b) << e.what;
  }
}

/// A patch gets the same from photons that cross it as from samples of the luminaire: emission and illumination are two
/// views of one radiance. 4 sigma of both.
TEST(EveryLuminaire, WhatPhotonsBringIsWhatSamplesBring) {
  constexpr double kPatch = 0.5;
  for (const Example& e : examples()) {
    const LuminaireSampler sampler = made(e.luminaire);
    const Vec3d axis(e.luminaire.axis);
    // Of a sky the axis is where its light comes from.
    const Vec3d normal = glm::normalize((e.luminaire.kind == "hemisphere" ? 1.0 : -1.0) * axis + Vec3d(0.2, 0.1, 0.3));
    const Vec3d centre = 1.5 * axis;
    const Vec3d s = glm::normalize(glm::cross(normal, Vec3d(1, 0, 0))), t = glm::cross(normal, s);
    const double area = kPi * kPatch * kPatch;
    Random random(2);
    Mean by_photons, by_samples;
    for (int i = 0; i < 400000; ++i) {
      const Vec2f u = random.pair(), v = random.pair();
      const EmittedPhoton photon = sampler.emit(u, v, {centre, 2 * kPatch});
      const double cosine = -glm::dot(Vec3d(photon.direction), normal);
      const double distance = glm::dot(photon.origin - centre, normal) / cosine;
      const Vec3d at = photon.origin + distance * Vec3d(photon.direction) - centre;
      const bool crosses = cosine > 0 && distance > 0 && glm::length(at) < kPatch;
      by_photons.add(crosses ? photon.power.g / area : 0);
    }
    for (int i = 0; i < 100000; ++i) {
      const double r = kPatch * std::sqrt(random.unit()), phi = random.uniform(0, 2 * kPi);
      const LuminaireSample sample =
          sampler.sample(centre + r * (std::cos(phi) * s + std::sin(phi) * t), random.pair());
      by_samples.add(sample.biradiance.g * std::max(glm::dot(Vec3d(sample.direction), normal), 0.0));
    }
    EXPECT_GT(by_samples.value(), 0) << e.what;
    EXPECT_NEAR(by_photons.value(), by_samples.value(), 4 * (by_photons.error() + by_samples.error())) << e.what;
  }
}

/// meet() returns what sample() has used. Directions are rounded to floats, so that points move by 1e-7 of the
/// distance: densities of areas seen at grazing angles move by more, and rays to the border may pass by.
TEST(EveryLuminaire, ARayMeetsWhatWasSampled) {
  for (const Example& e : examples()) {
    const LuminaireSampler sampler = made(e.luminaire);
    Random random(3);
    int sampled = 0, missed = 0;
    for (const Vec3d& receiver : receivers(e.luminaire))
      for (int i = 0; i < 500; ++i) {
        const LuminaireSample s = sampler.sample(receiver, random.pair());
        EXPECT_EQ(sampler.impulse(), sampler.impulse() && s.pdf == 0) << e.what;
        const auto hit = sampler.meet(receiver, s.direction);
        if (sampler.impulse()) {
          EXPECT_FALSE(hit) << e.what;
          continue;
        }
        if (!(s.biradiance.g > 0)) continue;
        ++sampled;
        if (!hit) {
          ++missed;
          continue;
        }
        if (std::isinf(s.distance))
          EXPECT_TRUE(std::isinf(hit->distance)) << e.what;
        else
          EXPECT_NEAR(hit->distance, s.distance, 1e-4 * s.distance + 1e-5) << e.what;
        ASSERT_GT(s.pdf, 0) << e.what;
        // Across the border of a cell of an image the density jumps.
        if (e.luminaire.light_image && std::abs(hit->pdf - s.pdf) > 1e-3f * s.pdf) {
          ++missed;
          continue;
        }
        EXPECT_NEAR(hit->pdf, s.pdf, 1e-3 * s.pdf) << e.what;
        EXPECT_NEAR(hit->radiance.g, s.biradiance.g * s.pdf, 2e-3 * hit->radiance.g) << e.what;
        EXPECT_NEAR(hit->radiance.b, s.biradiance.b * s.pdf, 2e-3 * hit->radiance.b + 1e-3) << e.what;
      }
    EXPECT_LE(missed, sampled / 200) << e.what;
    EXPECT_TRUE(sampler.impulse() || sampled > 1000) << e.what;
  }
}

/// The irradiance from samples of the luminaire equals that from rays in all directions. 4 sigma of both.
TEST(EveryLuminaire, SamplesBringWhatRaysInAllDirectionsMeet) {
  for (const Example& e : examples()) {
    const LuminaireSampler sampler = made(e.luminaire);
    if (sampler.impulse()) continue;
    Random random(4);
    for (const Vec3d& receiver : receivers(e.luminaire)) {
      if (glm::length(receiver) > 10) continue;
      const Vec3d normal = random.direction();
      Mean by_samples, by_rays;
      for (int i = 0; i < 20000; ++i) {
        const LuminaireSample s = sampler.sample(receiver, random.pair());
        by_samples.add(s.biradiance.b * std::max(glm::dot(Vec3d(s.direction), normal), 0.0));
      }
      for (int i = 0; i < 100000; ++i) {
        const Vec3d direction = random.direction();
        const auto hit = sampler.meet(receiver, Vec3f(direction));
        by_rays.add(hit ? 4 * kPi * hit->radiance.b * std::max(glm::dot(direction, normal), 0.0) : 0);
      }
      EXPECT_NEAR(by_samples.value(), by_rays.value(), 4 * (by_samples.error() + by_rays.error())) << e.what;
    }
  }
}

/// Bins of equal solid angle around the luminaire's axis. Lamps have sharp borders, so that the density is integrated
/// over each bin by 64 x 64 jittered points: a bin's share is right to 0.5 %, where counts of 1000 scatter by 3 %.
TEST(EveryLuminaire, SamplesFollowTheirDensity) {
  constexpr int kRows = 12, kColumns = 24, kSteps = 64, kSamples = 100000;
  // From near by, so that it covers many bins; by area, from where the density varies most.
  const double places[] = {0.35, 1.0};
  std::vector<Example> all = examples();
  std::erase_if(all, [](const Example& e) { return made(e.luminaire).impulse(); });
  const int tests = static_cast<int>(all.size() * std::size(places));
  for (const Example& e : all)
    for (const double along : places) {
      const LuminaireSampler sampler = made(e.luminaire);
      const Vec3d z(e.luminaire.axis), up(e.luminaire.up);
      const Vec3d x = 0.8 * up + 0.6 * glm::cross(z, up), y = glm::cross(z, x);
      const Vec3d receiver = along * z + 0.3 * up;
      // One bin more for samples that bring nothing: the square around a disk has some.
      std::vector<double> observed(kRows * kColumns + 1, 0), expected(observed.size(), 0);
      Random random(5);
      for (int i = 0; i < kSamples; ++i) {
        const LuminaireSample s = sampler.sample(receiver, random.pair());
        const Vec3d d(s.direction);
        const double turn = std::atan2(glm::dot(d, y), glm::dot(d, x)) / (2 * kPi) + 0.5;
        const int row = std::clamp(static_cast<int>((0.5 + 0.5 * glm::dot(d, z)) * kRows), 0, kRows - 1);
        const int column = std::clamp(static_cast<int>(turn * kColumns), 0, kColumns - 1);
        ++observed[s.biradiance.r > 0 ? static_cast<size_t>(row * kColumns + column) : observed.size() - 1];
      }
      double all_expected = 0;
      for (int bin = 0; bin < kRows * kColumns; ++bin) {
        double sum = 0;
        for (int i = 0; i < kSteps * kSteps; ++i) {
          const double cosine = 2 * (bin / kColumns + (i / kSteps + random.unit()) / kSteps) / kRows - 1;
          const double turn = 2 * kPi * ((bin % kColumns + (i % kSteps + random.unit()) / kSteps) / kColumns - 0.5);
          const double sine = std::sqrt((1 - cosine) * (1 + cosine));
          const auto hit = sampler.meet(receiver, Vec3f(cosine * z + sine * (std::cos(turn) * x + std::sin(turn) * y)));
          sum += hit ? hit->pdf : 0;
        }
        expected[static_cast<size_t>(bin)] = kSamples * sum / (kSteps * kSteps) * 4 * kPi / (kRows * kColumns);
        all_expected += expected[static_cast<size_t>(bin)];
      }
      if (observed.back() > 0)
        expected.back() = std::max(kSamples - all_expected, 0.0);
      else
        EXPECT_NEAR(all_expected / kSamples, 1, 2e-3) << e.what << " from " << along;
      const ChiSquared seen = chi_squared(observed, expected);
      EXPECT_GT(seen.p, sidak_level(0.01, tests)) << e.what << " from " << along << ": " << seen.text();
      EXPECT_GE(seen.degrees, 8) << e.what << " from " << along << ": " << seen.text();
    }
}

TEST(EveryLuminaire, NothingIsEverNaNOrNegative) {
  constexpr float kLast = 1 - 0x1p-24f;
  const double huge = 2147483648.0;
  for (Example& e : examples()) {
    for (const float scale : {1.0f, 1e-4f, 1e5f}) {
      Luminaire l = e.luminaire;
      l.extent *= scale, l.radius *= scale;
      if (l.radius > 1e6f || l.radius < 1e-6f) continue;
      const LuminaireSampler sampler = made(l);
      const Vec3d axis(l.axis), up(l.up), right = glm::cross(up, axis);
      std::vector<Vec3d> points;
      for (const double along : {0.0, 1e-300, 1e-30, 1e-19, 1e-7, 1e-3, 1.0, huge})
        for (const double sign : {1.0, -1.0})
          for (const double side : {0.0, 0.5 * l.extent.x, double{l.radius}, 1e-30, huge})
            for (const double other : {0.0, 0.5 * l.extent.y, -1e-9})
              points.push_back(sign * along * axis + side * right + other * up);
      for (const Vec3f& corner : l.triangles) points.push_back(Vec3d(corner));
      for (const Vec3d& point : points)
        for (const Vec2f& u : {Vec2f(0, 0), Vec2f(kLast, 0), Vec2f(0, kLast), Vec2f(kLast, kLast), Vec2f(0.5f, 0.5f),
                               Vec2f(0.3f, 0.9f)}) {
          const LuminaireSample s = sampler.sample(point, u);
          ASSERT_TRUE(finite(s.biradiance)) << e.what;
          ASSERT_NEAR(glm::length(s.direction), 1, 1e-6) << e.what;
          ASSERT_GE(s.distance, 0) << e.what;
          ASSERT_TRUE(std::isfinite(s.pdf) && s.pdf >= 0) << e.what;
          for (const Vec3f& direction : {s.direction, -s.direction, l.axis, -l.axis, l.up, Vec3f(0, 1, 0)})
            if (const auto hit = sampler.meet(point, direction)) {
              ASSERT_TRUE(finite(hit->radiance)) << e.what;
              ASSERT_TRUE(std::isfinite(hit->pdf) && hit->pdf >= 0) << e.what;
              ASSERT_GE(hit->distance, 0) << e.what;
            }
          const EmittedPhoton photon = sampler.emit(u, {u.y, u.x}, {point, 1});
          ASSERT_TRUE(finite(photon.power)) << e.what;
          ASSERT_NEAR(glm::length(photon.direction), 1, 1e-6) << e.what;
          ASSERT_TRUE(std::isfinite(photon.origin.x + photon.origin.y + photon.origin.z)) << e.what;
        }
    }
  }
}

TEST(EveryLuminaire, NumbersOutsideTheirRangeAreRefused) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  for (const LuminaireKind& kind : luminaire_members()) {
    const auto refused = [&](const auto& change) {
      for (const Example& e : examples()) {
        if (e.luminaire.kind != kind.name) continue;
        Luminaire l = e.luminaire;
        change(l);
        return !LuminaireSampler::make(l).ok();
      }
      return false;
    };
    const auto expect_refused = [&](uint32_t key, const char* what, const auto& change) {
      EXPECT_TRUE(!(kind.keys & key) || refused(change)) << kind.name << ": " << what;
    };
    for (const float wrong : {-1.0f, nan, infinity}) {
      expect_refused(shared::kKeyPower, "power", [&](Luminaire& l) { l.power.g = wrong; });
      expect_refused(shared::kKeyRadiance, "radiance", [&](Luminaire& l) { l.radiance.g = wrong; });
      expect_refused(shared::kKeyIrradiance, "irradiance", [&](Luminaire& l) { l.irradiance.g = wrong; });
      expect_refused(shared::kKeyRadius | shared::kKeyClamp, "radius", [&](Luminaire& l) { l.radius = wrong; });
      expect_refused(shared::kKeyExtent, "extent", [&](Luminaire& l) { l.extent.y = wrong; });
      expect_refused(shared::kKeyCone, "half angle", [&](Luminaire& l) { l.half_angle = wrong; });
    }
    expect_refused(shared::kKeyAxis, "axis", [](Luminaire& l) { l.axis = Vec3f(0); });
    expect_refused(shared::kKeyRadius, "radius 0", [](Luminaire& l) { l.radius = 0; });
    expect_refused(shared::kKeyExtent, "extent 0", [](Luminaire& l) { l.extent.x = 0; });
    expect_refused(shared::kKeyFile, "no triangles", [](Luminaire& l) { l.triangles.clear(); });
  }
}

}  // namespace
}  // namespace world
