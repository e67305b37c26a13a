/// The laws of BSDFs, on every member of render/bsdf/ by the folder's list; a member that states no law of its own is
/// tested by adding its file.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "render/bsdf/bsdf.h"
#include "render/bsdf/directions.shared.h"
#include "tests/chi_squared.h"
#include "world/base/random.h"

namespace render {
namespace {

using namespace shared;

constexpr double kPi = 3.14159265358979323846;

class Random {
 public:
  explicit Random(uint64_t seed) : seed_(seed) {}
  float unit() { return world::uniform01(bits()); }
  Vec3f units() { return {unit(), unit(), unit()}; }
  float between(float low, float high) { return low + (high - low) * unit(); }
  int below(int n) { return static_cast<int>(bits() % static_cast<uint64_t>(n)); }
  Vec3f direction() {
    const double z = 2.0 * unit() - 1, turn = 2 * kPi * unit(), r = std::sqrt(std::max(0.0, 1 - z * z));
    return Vec3f(glm::normalize(glm::dvec3(r * std::cos(turn), r * std::sin(turn), z)));
  }
  /// On n's side.
  Vec3f above(Vec3f n) {
    const Vec3f d = direction();
    return dot(d, n) < 0 ? -d : d;
  }

 private:
  uint64_t bits() { return world::random_bits(seed_, static_cast<int64_t>(++count_), 0, 0); }
  uint64_t seed_, count_ = 0;
};

/// At an angle from n, in degrees.
Vec3f tilted(Vec3f n, double degrees) {
  const glm::dvec3 other = std::abs(n.x) < 0.7f ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 across = glm::normalize(glm::cross(glm::dvec3(n), other));
  return Vec3f(std::cos(degrees * kPi / 180) * glm::dvec3(n) + std::sin(degrees * kPi / 180) * across);
}

struct Case {
  std::string name;
  BsdfParameters parameters;
};

/// What a member may be told: all lobes, rough and smooth, dense and rare, clear and coloured.
std::vector<Case> cases() {
  std::vector<Case> all;
  for (const uint32_t gloss : {kGlossExact, kGlossPublished, kGlossFresnel})
    for (const float s : {0.0f, 1.0f, 8.76f, 60.0f, 2000.0f}) {
      BsdfParameters p;
      p.lambertian = {0.5f, 0.2f, 0.05f};
      p.glossy = s < 10 ? Vec3f(0.5f, 0.8f, 0.95f) : Vec3f(0.04f);
      p.smoothness = s;
      p.gloss = gloss;
      p.eta = s < 10 ? 1.5f : 1 / 1.333f;
      p.transmission = {0.4f, 0.8f, 0.0f};
      p.coverage = s < 1 ? 1.0f : 0.6f;
      all.push_back({"gloss " + std::to_string(gloss) + ", s = " + std::to_string(s), p});
    }
  BsdfParameters metal;
  metal.lambertian = Vec3f(0.003f);
  metal.glossy = {0.99f, 0.78f, 0.34f};
  metal.smoothness = 500;
  metal.gloss = kGlossFresnel;
  metal.eta = 1;
  metal.coverage = 0;
  all.push_back({"gold", metal});
  return all;
}

bool is_finite(Vec3f v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
float least(Vec3f v) { return std::min({v.x, v.y, v.z}); }
float most(Vec3f v) { return std::max({v.x, v.y, v.z}); }

int64_t ulps(float a, float b) {
  const auto ordered = [](float x) {
    const int32_t bits = std::bit_cast<int32_t>(x);
    return int64_t{bits < 0 ? INT32_MIN - bits : bits};
  };
  return std::abs(ordered(a) - ordered(b));
}

/// Whether the member refracts: then the two directions of transport differ by eta^2.
bool refracts(const Bsdf& bsdf) {
  BsdfParameters p;
  p.eta = 1.5f;
  const Vec3f n(0, 0, 1), w = tilted(n, 30);
  const Impulses in = bsdf.incoming_impulses(p, w, n), out = bsdf.outgoing_impulses(p, w, n);
  for (int i = 0; i < in.count; ++i)
    if (in.impulse[i].magnitude != out.impulse[i].magnitude) return true;
  return false;
}

TEST(EveryBsdf, ReciprocityFiniteDensityIsTheSameBothWaysWithin4Ulp) {
  Random random(1);
  for (const Bsdf& bsdf : bsdfs()) {
    int64_t worst = 0;
    for (const Case& c : cases())
      for (int i = 0; i < 7000; ++i) {
        const Vec3f n = random.direction(), a = random.above(n), b = random.above(n);
        const Vec3f forth = bsdf.finite_density(c.parameters, a, b, n);
        const Vec3f back = bsdf.finite_density(c.parameters, b, a, n);
        for (int band = 0; band < 3; ++band) worst = std::max(worst, ulps(forth[band], back[band]));
      }
    EXPECT_LE(worst, 4) << bsdf.name;
  }
}

TEST(EveryBsdf, ReciprocityAnImpulseThatIsFollowedBackHasTheSameMagnitude) {
  Random random(2);
  for (const Bsdf& bsdf : bsdfs())
    for (const Case& c : cases())
      for (int i = 0; i < 300; ++i) {
        const Vec3f n = random.direction(), wo = random.above(n);
        const Impulses in = bsdf.incoming_impulses(c.parameters, wo, n);
        for (int k = 0; k < in.count; ++k) {
          // Light sent from there must leave to wo: power unscaled, radiance by the squared index.
          const Vec3f wi = in.impulse[k].direction;
          const bool crosses = dot(wi, n) < 0;
          const bool refracted = crosses && refracts(bsdf);
          BsdfParameters there = c.parameters;
          if (refracted) there.eta = 1 / there.eta;
          const Impulses out = bsdf.outgoing_impulses(there, wi, crosses ? -n : n);
          const float scale = refracted ? c.parameters.eta * c.parameters.eta : 1.0f;
          // At grazing angles a cosine's rounding, 1e-7, is much of it, and of what Fresnel makes of it.
          if (std::min(std::abs(dot(n, wi)), dot(n, wo)) < 0.05f) continue;
          bool found = false;
          for (int j = 0; j < out.count; ++j) {
            if (length(out.impulse[j].direction - wo) > 1e-5f) continue;
            found = true;
            for (int band = 0; band < 3; ++band)
              EXPECT_NEAR(out.impulse[j].magnitude[band], scale * in.impulse[k].magnitude[band], 2e-5f) << bsdf.name;
          }
          EXPECT_TRUE(found) << bsdf.name << ", " << c.name;
        }
      }
}

/// The mean of samples' weights and its standard error. Radiance that was refracted counts as power.
struct Scattered {
  glm::dvec3 mean{0}, error{0};
};
Scattered scattered(const Bsdf& bsdf, const BsdfParameters& p, Vec3f w, Vec3f n, bool in, int samples, uint64_t seed) {
  Random random(seed);
  const double eta2 = double{p.eta} * p.eta;
  const bool rescales = in && refracts(bsdf);
  glm::dvec3 sum(0), squares(0);
  for (int i = 0; i < samples; ++i) {
    const BsdfSample drawn = (in ? bsdf.scatter_in : bsdf.scatter_out)(p, w, n, random.units());
    glm::dvec3 weight(drawn.weight);
    if (rescales && dot(drawn.direction, n) < 0) weight *= eta2;
    sum += weight;
    squares += weight * weight;
  }
  const glm::dvec3 mean = sum / double(samples);
  return {mean, glm::sqrt(glm::max(squares / double(samples) - mean * mean, glm::dvec3(0)) / double(samples))};
}

TEST(EveryBsdf, ProbabilityOfScatteringIsTheMeanWeightOfSamples) {
  const Vec3f n(0, 0, 1);
  uint64_t seed = 100;
  for (const Bsdf& bsdf : bsdfs())
    for (const Case& c : cases())
      for (const double angle : {0.0, 40.0, 75.0})
        for (const bool in : {true, false}) {
          const Vec3f w = tilted(n, angle);
          const Vec3f told = (in ? bsdf.probability_in : bsdf.probability_out)(c.parameters, w, n);
          const Scattered seen = scattered(bsdf, c.parameters, w, n, in, 20000, ++seed);
          for (int band = 0; band < 3; ++band)  // five standard errors, and the quadrature
            EXPECT_NEAR(told[band], seen.mean[band], 5 * seen.error[band] + 4e-3)
                << bsdf.name << ", " << c.name << ", at " << angle;
        }
}

TEST(EveryBsdf, WhiteFurnaceNothingScattersMoreThanArrivesButThePublishedBlinnPhong) {
  const Vec3f n(0, 0, 1);
  for (const Bsdf& bsdf : bsdfs()) {
    float exceeds = 0;
    for (Case c : cases()) {
      c.parameters.glossy = Vec3f(1) - c.parameters.lambertian;
      c.parameters.transmission = c.parameters.glossy;
      for (double angle = 0; angle < 90; angle += 5) {
        for (const auto probability : {bsdf.probability_in, bsdf.probability_out}) {
          const float scattered = most(probability(c.parameters, tilted(n, angle), n));
          if (c.parameters.gloss == kGlossPublished) {
            exceeds = std::max(exceeds, scattered - 1);
          } else {
            EXPECT_LE(scattered, 1 + 4e-3f) << bsdf.name << ", " << c.name << ", at " << angle;  // quadrature
          }
        }
      }
    }
    printf("  %.*s: the published factor exceeds 1 by %.4f\n", static_cast<int>(bsdf.name.size()), bsdf.name.data(),
           exceeds);
    EXPECT_LE(exceeds, 0.0752f + 4e-3f) << bsdf.name;
  }
}

TEST(EveryBsdf, SamplesFollowTheirDensityBothWays) {
  struct Run {
    const Bsdf* bsdf;
    Case c;
    double angle;
    bool in;
  };
  std::vector<Run> runs;
  int number = 0;
  for (const Bsdf& bsdf : bsdfs())
    for (const Case& c : cases()) {
      const Vec3f n(0, 0, 1), w = tilted(n, 20);
      if (bsdf.pdf(c.parameters, n, w, n) == 0 && bsdf.pdf(c.parameters, tilted(n, -20), w, n) == 0) continue;
      const double angles[] = {0, 35, 60, 80};
      const double angle = angles[number++ % 4];
      for (const bool in : {true, false}) runs.push_back({&bsdf, c, angle, in});
    }
  ASSERT_GT(runs.size(), 40u);
  const double level = world::sidak_level(0.01, static_cast<int>(runs.size()));
  Random random(3);
  for (const Run& run : runs) {
    const BsdfParameters& p = run.c.parameters;
    const Vec3f n = random.direction(), w = tilted(n, run.angle);
    const auto sample = [&](Vec3f u) -> std::optional<Vec3f> {
      const BsdfSample drawn = (run.in ? run.bsdf->scatter_in : run.bsdf->scatter_out)(p, w, n, u);
      if (drawn.impulse || !(drawn.pdf > 0)) return std::nullopt;
      return drawn.direction;
    };
    // The finite part of every member is symmetric: the density of wo given wi is pdf with the two exchanged.
    const auto density = [&](Vec3f d) { return run.bsdf->pdf(p, d, w, n); };
    const auto seen = world::chi_squared_of_directions(sample, density, {.samples = 100000, .seed = 7}, glm::dvec3(n));
    EXPECT_GT(seen.p, level) << run.bsdf->name << (run.in ? " in, " : " out, ") << run.c.name << ", at " << run.angle
                             << ": " << seen.text();
  }
}

TEST(EveryBsdf, TheWeightOfASampleIsDensityTimesCosineOverItsPdf) {
  Random random(4);
  for (const Bsdf& bsdf : bsdfs())
    for (const Case& c : cases())
      for (int i = 0; i < 3000; ++i) {
        const Vec3f n = random.direction(), w = random.above(n), u = random.units();
        for (const bool in : {true, false}) {
          const BsdfSample drawn = (in ? bsdf.scatter_in : bsdf.scatter_out)(c.parameters, w, n, u);
          if (drawn.impulse || drawn.pdf == 0) continue;
          // Sampling and asking later take other orders of the same products.
          EXPECT_NEAR(drawn.pdf, bsdf.pdf(c.parameters, drawn.direction, w, n), 1e-5f * drawn.pdf) << bsdf.name;
          const Vec3f f = in ? bsdf.finite_density(c.parameters, drawn.direction, w, n)
                             : bsdf.finite_density(c.parameters, w, drawn.direction, n);
          for (int band = 0; band < 3; ++band) {
            const float expected = f[band] * std::abs(dot(n, drawn.direction));
            EXPECT_NEAR(drawn.weight[band] * drawn.pdf, expected, 1e-5f * expected + 1e-30f) << bsdf.name;
          }
        }
      }
}

TEST(EveryBsdf, ImpulsesAreNoPartOfTheDensityAndSamplesAreTheListedOnes) {
  Random random(5);
  for (const Bsdf& bsdf : bsdfs())
    for (const Case& c : cases())
      for (int i = 0; i < 500; ++i) {
        const Vec3f n = random.direction(), w = random.above(n);
        for (const bool in : {true, false}) {
          const Impulses listed = (in ? bsdf.incoming_impulses : bsdf.outgoing_impulses)(c.parameters, w, n);
          // Were the impulse in the density, it would tower there; lobes are bounded.
          const float bound = 10 * (c.parameters.smoothness + 10) / std::max(dot(n, w), 1e-3f);
          for (int k = 0; k < listed.count; ++k)
            EXPECT_LE(most(bsdf.finite_density(c.parameters, listed.impulse[k].direction, w, n)), bound) << bsdf.name;
          const BsdfSample drawn = (in ? bsdf.scatter_in : bsdf.scatter_out)(c.parameters, w, n, random.units());
          if (!drawn.impulse) continue;
          EXPECT_EQ(drawn.pdf, 0);
          bool found = false;
          for (int k = 0; k < listed.count; ++k) found |= length(listed.impulse[k].direction - drawn.direction) < 1e-6f;
          EXPECT_TRUE(found) << bsdf.name << ", " << c.name;
        }
      }
}

TEST(EveryBsdf, SamplingPicksEachImpulseSoOftenThatItsMagnitudeComesOut) {
  const Vec3f n(0, 0, 1), w = tilted(n, 50);
  const int samples = 40000;
  for (const Bsdf& bsdf : bsdfs())
    for (const Case& c : cases()) {
      const Impulses listed = bsdf.incoming_impulses(c.parameters, w, n);
      glm::dvec3 sum[2] = {glm::dvec3(0), glm::dvec3(0)};
      double most_weight = 0;
      for (int i = 0; i < samples; ++i) {
        Random random(static_cast<uint64_t>(i) + 1000);
        const BsdfSample drawn = bsdf.scatter_in(c.parameters, w, n, random.units());
        if (!drawn.impulse) continue;
        most_weight = std::max<double>(most_weight, most(drawn.weight));
        for (int k = 0; k < listed.count; ++k)
          if (length(listed.impulse[k].direction - drawn.direction) < 1e-6f) sum[k] += drawn.weight;
      }
      for (int k = 0; k < listed.count; ++k)
        for (int band = 0; band < 3; ++band)  // five standard errors of a choice of probability 1/2 at most
          EXPECT_NEAR(sum[k][band] / samples, listed.impulse[k].magnitude[band],
                      5 * 0.5 * most_weight / std::sqrt(double{samples}))
              << bsdf.name << ", " << c.name;
    }
}

// B8: the sampler's own ends, tangents, opposite and equal directions, extreme parameters.
TEST(EveryBsdf, NoNanNoInfinityNothingNegativeFor1000000AdversarialInputs) {
  Random random(6);
  const auto awkward_unit = [&]() -> float {
    const float ends[] = {0.0f, 1 - 0x1p-24f, 0.5f, 0x1p-24f, 0x1p-149f};
    return random.below(2) ? random.unit() : ends[random.below(5)];
  };
  const auto awkward_direction = [&](Vec3f n, Vec3f other) -> Vec3f {
    const Vec3f tangent = glm::normalize(glm::cross(n, std::abs(n.x) < 0.7f ? Vec3f(1, 0, 0) : Vec3f(0, 1, 0)));
    switch (random.below(10)) {
      case 0:
        return n;
      case 1:
        return -n;
      case 2:
        return tangent;
      case 3:
        return glm::normalize(tangent + random.between(-1, 1) * 1e-7f * n);
      case 4:
        return other;
      case 5:
        return -other;
      case 6:
        return reflected_direction(other, n);
      case 7:
        return glm::normalize(tangent + 1e-20f * n);
      default:
        return random.direction();
    }
  };
  const auto pick = [&](std::initializer_list<float> values) {
    return values.begin()[random.below(int(values.size()))];
  };
  int64_t bad = 0, inputs = 0;
  std::map<std::string, int64_t> rejected;
  for (int i = 0; i < 1000000 / static_cast<int>(bsdfs().size()) + 1; ++i)
    for (const Bsdf& bsdf : bsdfs()) {
      BsdfParameters p;
      p.lambertian = Vec3f(pick({0, 1e-30f, 0.5f, 0.999f, 1}));
      p.glossy = Vec3f(1) - p.lambertian;
      if (random.below(3) == 0) p.glossy = Vec3f(0);
      p.smoothness = pick({0, 1e-30f, 1, 8192, 1e6f, 1e12f});
      p.transmission = random.below(2) ? Vec3f(1) - p.lambertian : Vec3f(0);
      p.eta = pick({1, 1 + 0x1p-23f, 1 - 0x1p-24f, 1.5f, 1 / 1.5f, 0.1f, 10, 5, 0.2f});
      p.coverage = pick({0, 1, 0x1p-24f, 1 - 0x1p-24f, 0.5f});
      p.gloss = static_cast<uint32_t>(random.below(3));
      const Vec3f axes[] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
      const Vec3f n = random.below(2) ? axes[random.below(4)] : random.direction();
      const Vec3f wi = awkward_direction(n, n), wo = awkward_direction(n, wi);
      const Vec3f u(awkward_unit(), awkward_unit(), awkward_unit());
      const auto ok = [](Vec3f v) { return is_finite(v) && least(v) >= 0; };
      const auto direction_ok = [](Vec3f d) {
        return is_finite(d) && (d == Vec3f(0) || std::abs(length(d) - 1) < 1e-5f);
      };
      bool good = ok(bsdf.finite_density(p, wi, wo, n));
      if (i % 8 == 0) good &= ok(bsdf.probability_in(p, wo, n)) && ok(bsdf.probability_out(p, wi, n));
      const float pdf = bsdf.pdf(p, wi, wo, n);
      good &= std::isfinite(pdf) && pdf >= 0;
      for (const Impulses& impulses : {bsdf.incoming_impulses(p, wo, n), bsdf.outgoing_impulses(p, wi, n)})
        for (int k = 0; k < impulses.count; ++k)
          good &= direction_ok(impulses.impulse[k].direction) && impulses.impulse[k].direction != Vec3f(0) &&
                  ok(impulses.impulse[k].magnitude);
      for (const BsdfSample& drawn : {bsdf.scatter_in(p, wo, n, u), bsdf.scatter_out(p, wi, n, u)}) {
        good &= direction_ok(drawn.direction) && ok(drawn.weight) && std::isfinite(drawn.pdf) && drawn.pdf >= 0;
        good &= drawn.weight == Vec3f(0) || drawn.direction != Vec3f(0);
        rejected[std::string(bsdf.name)] += drawn.weight == Vec3f(0);
      }
      ++inputs;
      bad += !good;
      if (!good && bad < 10)
        ADD_FAILURE() << bsdf.name << ": s " << p.smoothness << " eta " << p.eta << " k_L " << p.lambertian.x << " k_g "
                      << p.glossy.x << " gloss " << p.gloss << " n.wi " << dot(n, wi) << " n.wo " << dot(n, wo);
    }
  EXPECT_GE(inputs, 1000000);
  EXPECT_EQ(bad, 0);
  for (const auto& [name, count] : rejected) printf("  %s: %lld samples rejected\n", name.c_str(), (long long)count);
}

}  // namespace
}  // namespace render
