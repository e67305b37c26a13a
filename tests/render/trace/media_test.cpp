// Estimators of what a medium lets through: right in the mean, on all members, against their closed forms.
#include "render/trace/media.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "world/media/brick_field.h"

namespace render {
namespace {

using world::Medium;
using world::Vec3d;

struct Case {
  Medium medium;
  Vec3d origin, direction;
  double t0, t1;
};

/// A ray of some optical depth through each kind.
std::vector<Case> cases() {
  std::vector<Case> all;
  const Vec3d direction = normalize(Vec3d(1, -0.3, 0.2));
  for (const std::string& kind : world::medium_kinds()) {
    Medium m;
    m.kind = m.name = kind;
    m.half_extent = {3, 4, 2};
    m.scale_height = 2;
    if (kind == "density_grid") {
      std::vector<world::FieldLeaf> leaves;
      for (int x = -1; x <= 1; ++x) {
        world::FieldLeaf leaf{{x, 0, 0}, {}};
        std::mt19937 random(static_cast<unsigned>(x + 7));
        for (float& v : leaf.values) v = random() % 3 == 0 ? static_cast<float>(random() % 1000) / 250 : 0;
        leaves.push_back(leaf);
      }
      m.voxel_size = 0.5;
      for (const auto sampling : {world::FieldSampling::nearest, world::FieldSampling::trilinear}) {
        m.field = world::BrickField::make(leaves, sampling, "test").value();
        all.push_back({m, {-4, 4, 0.5}, normalize(Vec3d(1, -0.3, 0.1)), 0.5, 9});
      }
      continue;
    }
    all.push_back({m, {-3.5, 1, 0.5}, direction, 0.5, 6});
    if (kind == "height_fog") all.push_back({m, {0, -1, 0}, normalize(Vec3d(0.3, 1, 0)), 0, 50});
  }
  return all;
}

constexpr double kSigma = 0.4;

/// Mean and its standard error of n samples.
template <class Sample>
std::pair<double, double> mean_of(int n, Sample sample) {
  double sum = 0, squares = 0;
  for (int i = 0; i < n; ++i) {
    const double v = sample();
    sum += v, squares += v * v;
  }
  const double mean = sum / n;
  return {mean, std::sqrt(std::max(squares / n - mean * mean, 0.0) / n)};
}

TEST(MediaEstimators, TrackedTransmittancesAreRightInTheMean) {
  std::mt19937_64 bits(1);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto random = [&] { return unit(bits); };
  for (const Case& c : cases()) {
    const double exact = closed_transmittance(c.medium, c.origin, c.direction, c.t0, c.t1, kSigma);
    ASSERT_TRUE(exact > 0.02 && exact < 0.9) << c.medium.name << ' ' << exact;
    const auto [delta, delta_error] = mean_of(40000, [&] {
      return delta_tracked_transmittance(c.medium, c.origin, c.direction, c.t0, c.t1, kSigma, random);
    });
    EXPECT_NEAR(delta, exact, 4 * delta_error) << c.medium.name;
    const auto [ratio, ratio_error] = mean_of(40000, [&] {
      return ratio_tracked_transmittance(c.medium, c.origin, c.direction, c.t0, c.t1, kSigma, random);
    });
    EXPECT_NEAR(ratio, exact, 4 * ratio_error + 1e-12) << c.medium.name;
    EXPECT_LE(ratio_error, delta_error * 1.05) << c.medium.name;
  }
}

TEST(MediaEstimators, CollisionsLieWhereExtinctionAndTransmittanceSay) {
  // Both ways of sampling, sorted into eight stretches of the ray, against differences of the transmittance.
  std::mt19937_64 bits(2);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto random = [&] { return unit(bits); };
  constexpr int kBins = 8, kSamples = 40000;
  for (const Case& c : cases())
    for (const bool tracked : {false, true}) {
      int counts[kBins + 1] = {};
      for (int i = 0; i < kSamples; ++i) {
        const double t = tracked ? delta_tracked_collision(c.medium, c.origin, c.direction, c.t0, c.t1, kSigma, random)
                                 : closed_collision(c.medium, c.origin, c.direction, c.t0, c.t1, kSigma, random);
        if (std::isinf(t)) {
          ++counts[kBins];
          continue;
        }
        ASSERT_TRUE(t >= c.t0 && t <= c.t1);
        ASSERT_GT(world::medium_density(c.medium, c.origin + t * c.direction), 0);
        ++counts[std::min(static_cast<int>((t - c.t0) / (c.t1 - c.t0) * kBins), kBins - 1)];
      }
      for (int b = 0; b <= kBins; ++b) {
        const auto passed = [&](int bin) {
          return closed_transmittance(c.medium, c.origin, c.direction, c.t0, c.t0 + (c.t1 - c.t0) * bin / kBins,
                                      kSigma);
        };
        const double p = b == kBins ? passed(kBins) : passed(b) - passed(b + 1);
        // 4.5 sigma: some 130 comparisons.
        EXPECT_NEAR(counts[b], kSamples * p, 4.5 * std::sqrt(kSamples * p * (1 - p)) + 1e-6)
            << c.medium.name << " bin " << b << (tracked ? " tracked" : " closed");
      }
    }
}

TEST(MediaEstimators, MarchedDepthsConvergeAndJitteredOnesAreRightInTheMean) {
  std::mt19937_64 bits(3);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto random = [&] { return unit(bits); };
  for (const Case& c : cases()) {
    const double exact = world::medium_depth(c.medium, c.origin, c.direction, c.t0, c.t1);
    const double largest = world::medium_density_max(c.medium, c.origin, c.direction, c.t0, c.t1);
    for (const MarchRule rule : {MarchRule::left, MarchRule::midpoint, MarchRule::jittered}) {
      const double marched = marched_depth(c.medium, c.origin, c.direction, c.t0, c.t1, rule, 20000, random);
      // A step's error is at most its length times the change of density in it: up and down over 40 voxels.
      EXPECT_NEAR(marched, exact, 80 * largest * (c.t1 - c.t0) / 20000) << c.medium.name;
    }
    const auto [mean, error] = mean_of(20000, [&] {
      return marched_depth(c.medium, c.origin, c.direction, c.t0, c.t1, MarchRule::jittered, 3, random);
    });
    EXPECT_NEAR(mean, exact, 4 * error + 1e-12 * exact) << c.medium.name;
  }
  EXPECT_EQ(march_steps(0, 10, 3), 4);
  EXPECT_EQ(march_steps(0, 9, 3), 3);
  EXPECT_EQ(march_steps(5, 5, 3), 1);
  EXPECT_EQ(march_steps(0, INFINITY, 1), 1 << 24);
}

TEST(MediaEstimators, WithoutExtinctionOrLengthEverythingPasses) {
  const auto random = [] { return 0.999999; };
  for (const Case& c : cases()) {
    for (const double sigma : {0.0, kSigma}) {
      const double t1 = sigma == 0 ? c.t1 : c.t0;
      EXPECT_EQ(closed_transmittance(c.medium, c.origin, c.direction, c.t0, t1, sigma), 1);
      EXPECT_EQ(delta_tracked_transmittance(c.medium, c.origin, c.direction, c.t0, t1, sigma, random), 1);
      EXPECT_EQ(ratio_tracked_transmittance(c.medium, c.origin, c.direction, c.t0, t1, sigma, random), 1);
      EXPECT_TRUE(std::isinf(closed_collision(c.medium, c.origin, c.direction, c.t0, t1, sigma, random)));
    }
  }
}

}  // namespace
}  // namespace render
