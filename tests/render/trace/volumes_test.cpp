// Free paths and transmittances of several media and bands at once, against closed forms.
#include "render/trace/volumes.h"

#include "tests/render/trace/trace_worlds.h"
#include "world/media/brick_field.h"

namespace render {
namespace {

using namespace world;

Medium medium(const std::string& kind, Absorption3 absorption, Absorption3 scattering) {
  Medium m;
  m.kind = m.name = kind;
  m.absorption = absorption;
  m.scattering = scattering;
  return m;
}

/// Media of a world along a ray from the origin towards +x.
struct Along {
  World world;
  WorldView view;
  TraceScene scene;
  Tracer tracer;
  std::vector<MediumStretch> stretches;
  Vec3d direction{1, 0, 0};
  Along(std::vector<Medium> media, double t_end, Vec3d towards = {1, 0, 0})
      : world([&] {
          World w = dark_world();
          w.media = std::move(media);
          return w;
        }()),
        view(world),
        scene(std::move(*TraceScene::build(view))),
        tracer(scene),
        direction(glm::normalize(towards)) {
    TraceRay ray;
    ray.ray = GridRay(WorldPoint::from(0, 0, 0), direction);
    media_along(tracer, ray, {}, t_end, stretches);
  }
};

/// Estimates over paths of the contribution `value(event, bands)`, by band and with its error.
template <class Value>
PixelSamples over_paths(const Along& along, double t_end, int paths, Value value,
                        DensityTracking tracking = DensityTracking::delta) {
  PixelSamples sum;
  for (int i = 0; i < paths; ++i) {
    RandomStream random(hash_combine(77, static_cast<uint64_t>(i)));
    Bands bands;
    bands.hero = i % 3;
    Vec3d emitted(0);
    const ScatterEvent event = follow_media(along.stretches, along.direction, t_end, tracking, random, bands, emitted);
    sum.add(value(event, bands, emitted));
  }
  return sum;
}
void expect(const PixelSamples& got, Vec3d expected, const char* what) {
  for (int b = 0; b < 3; ++b)
    EXPECT_NEAR(got.mean[b], expected[b], 4 * std::sqrt(got.squares[b]) / got.count + 1e-12) << what << " band " << b;
}

Along three_media() {
  Medium fog = medium("height_fog", {0.01f, 0.02f, 0.03f}, {0.05f, 0.3f, 0.5f});
  fog.scale_height = 3;
  Medium box = medium("box_fog", {0.1f, 0, 0}, {0, 0.2f, 1});
  box.position = WorldPoint::from(4, 0, 0);
  box.half_extent = {1, 1, 1};
  Medium dark = medium("homogeneous", {0.02f, 0.05f, 0.01f}, {});
  return Along({fog, box, dark}, 8, {1, 0.2, 0.1});
}

TEST(FollowMedia, WhatPassesIsTheTransmittanceOfEachBand) {
  const Along along = three_media();
  const Transmittance closed = transmittance(along.stretches, along.direction);
  expect(over_paths(along, 8, 200000,
                    [](const ScatterEvent& e, const Bands& b, const Vec3d&) {
                      return e.scatters ? Vec3d(0) : b.beta / Bands::mean(b.made);
                    }),
         closed.value, "passed");
}

TEST(FollowMedia, WhatScattersIsTheIntegralOfScatteringTimesTransmittance) {
  // Of one medium: sigma_s / sigma_t (1 - T). `made` and `beta` differ by orders of magnitude between bands.
  const Vec3f s(0.01f, 0.25f, 2), a(0.01f, 0.05f, 0.5f);
  const Along along({medium("homogeneous", {a.x, a.y, a.z}, {s.x, s.y, s.z})}, 3);
  Vec3d expected;
  for (int b = 0; b < 3; ++b) expected[b] = s[b] / (s[b] + a[b]) * -std::expm1(-3 * (double{s[b]} + a[b]));
  expect(over_paths(along, 3, 200000,
                    [](const ScatterEvent& e, const Bands& b, const Vec3d&) {
                      return e.scatters ? b.beta / Bands::mean(b.made) : Vec3d(0);
                    }),
         expected, "scattered");
}

TEST(FollowMedia, PathsWeighedAgainstJoiningALightAreCountedOnce) {
  // Light from beyond, found by paths that pass and, deterministically, by joining: weights of the two must sum to 1.
  // Passing: beta / mean(made + lit p); joining with density p: T p / mean(p + T_made p_path).
  const Along along = three_media();
  const Transmittance closed = transmittance(along.stretches, along.direction);
  for (const double p : {0.1, 1.0, 20.0}) {
    const PixelSamples passed = over_paths(along, 8, 200000, [&](const ScatterEvent& e, const Bands& b, const Vec3d&) {
      return e.scatters ? Vec3d(0) : b.beta / Bands::mean(b.made + b.lit * p);
    });
    // The path sampled its direction with density 1, the light with p.
    const Vec3d joined = closed.value * p / Bands::mean(Vec3d(p) + closed.made);
    for (int b = 0; b < 3; ++b)
      EXPECT_NEAR(passed.mean[b] + joined[b], closed.value[b], 4 * std::sqrt(passed.squares[b]) / passed.count + 1e-12)
          << p;
  }
}

TEST(FollowMedia, MediaShineWithTheirEmissionTimesWhatTheyStop) {
  Medium m = medium("homogeneous", {0.1f, 0.5f, 2}, {0.1f, 0, 1});
  m.emission = {3, 2, 1};
  const Along along({m}, 2);
  Vec3d expected;
  for (int b = 0; b < 3; ++b) expected[b] = Vec3d(3, 2, 1)[b] * -std::expm1(-2 * Vec3d(0.2, 0.5, 3)[b]);
  expect(over_paths(along, 2, 200000, [](const ScatterEvent&, const Bands&, const Vec3d& emitted) { return emitted; }),
         expected, "emitted");
  const FogView fog = fog_along(along.stretches, along.direction);
  for (int b = 0; b < 3; ++b) EXPECT_NEAR(fog.added[b], expected[b], 1e-6);
}

TEST(FollowMedia, NothingIsNanAtExtremes) {
  for (const float strength : {1e-30f, 1e-3f, 1e4f, 1e30f})
    for (const double t_end : {1e-6, 1.0, 1e9, kInfinity}) {
      const Along along({medium("homogeneous", {strength, 0, 1}, {0, strength, 1e-20f})}, t_end);
      const PixelSamples sum = over_paths(along, t_end, 300, [](const ScatterEvent&, const Bands& b, const Vec3d& e) {
        return b.beta / Bands::mean(b.made) + 0.0 * (b.beta / Bands::mean(b.made + b.lit * 0.5)) + e;
      });
      EXPECT_EQ(sum.rejected, 0u) << strength << " over " << t_end;
      const Transmittance t = transmittance(along.stretches, along.direction);
      for (int b = 0; b < 3; ++b) EXPECT_TRUE(t.value[b] >= 0 && t.value[b] <= 1);
    }
}

// --- density grids ------------------------------------------------------------------------------------------------

/// Voxels of 0.5 m from -2 to 10 m along x and from -2 to 2 m across: `value(i)` by number.
template <class Value>
Medium grid(Absorption3 absorption, Absorption3 scattering, FieldSampling sampling, Value value) {
  Medium m = medium("density_grid", absorption, scattering);
  m.voxel_size = 0.5f;
  std::vector<FieldLeaf> leaves;
  for (int x = -1; x < 2; ++x)
    for (int y = -1; y < 1; ++y)
      for (int z = -1; z < 1; ++z) {
        FieldLeaf& leaf = leaves.emplace_back();
        leaf.leaf = {x, y, z};
        for (size_t i = 0; i < leaf.values.size(); ++i) leaf.values[i] = value(leaves.size() * kLeafVoxels + i);
      }
  m.field = BrickField::make(std::move(leaves), sampling, "grid").value();
  return m;
}
float speckled(size_t i) {
  const float u = uniform01(random_bits(5, static_cast<int64_t>(i), 0, 0));
  return u < 0.6f ? 0 : 6 * (u - 0.6f);
}
float solid(size_t) { return 1; }

/// Grids that scatter, shine and absorb, each other and a fog with a closed form over them.
Along grids() {
  const Medium smoke = grid({0.01f, 0.02f, 0.4f}, {0.1f, 0.5f, 1.5f}, FieldSampling::trilinear, speckled);
  Medium fire =
      grid({0.2f, 0.1f, 0.05f}, {0.02f, 0, 0}, FieldSampling::nearest, [](size_t i) { return speckled(i + 9); });
  fire.emission = {3, 2, 1};
  const Medium soot = grid({0.1f, 0.3f, 0}, {}, FieldSampling::trilinear, [](size_t i) { return speckled(2 * i); });
  Medium fog = medium("height_fog", {0, 0.02f, 0.01f}, {0.05f, 0.1f, 0.2f});
  fog.scale_height = 3;
  return Along({smoke, fog, fire, soot}, 8, {1, 0.1, -0.05});
}

TEST(DensityTracking, WhatPassesAHomogeneousCubeIsTheExponentialOfItsDepth) {
  const Vec3d sigma(0.1, 0.45, 1.2);
  for (const FieldSampling sampling : {FieldSampling::nearest, FieldSampling::trilinear}) {
    const Along along({grid({0.05f, 0.05f, 0.2f}, {0.05f, 0.4f, 1}, sampling, solid)}, 3);
    const Vec3d exact(std::exp(-3 * sigma.x), std::exp(-3 * sigma.y), std::exp(-3 * sigma.z));
    expect(over_paths(along, 3, 200000,
                      [](const ScatterEvent& e, const Bands& b, const Vec3d&) {
                        return e.scatters ? Vec3d(0) : b.beta / Bands::mean(b.made);
                      }),
           exact, "passed");
    const Vec3d albedo = Vec3d(0.05, 0.4, 1) / sigma;
    expect(over_paths(along, 3, 200000,
                      [](const ScatterEvent& e, const Bands& b, const Vec3d&) {
                        return e.scatters ? b.beta / Bands::mean(b.made) : Vec3d(0);
                      }),
           albedo * (Vec3d(1) - exact), "scattered");
  }
}

TEST(DensityTracking, PathsAreThoseOfExactDepthsInTheMean) {
  const Along along = grids();
  ASSERT_EQ(along.stretches.size(), 4u);
  const auto passed = [](const ScatterEvent& e, const Bands& b, const Vec3d&) {
    return e.scatters ? Vec3d(0) : b.beta / Bands::mean(b.made);
  };
  const auto scattered = [](const ScatterEvent& e, const Bands& b, const Vec3d&) {
    return e.scatters ? b.beta * (1 + e.t) / Bands::mean(b.made) : Vec3d(0);  // and where
  };
  const auto emitted = [](const ScatterEvent&, const Bands&, const Vec3d& light) { return light; };
  expect(over_paths(along, 8, 200000, passed), transmittance(along.stretches, along.direction).value, "passed");
  const auto agree = [&](auto value, const char* what) {
    const PixelSamples tracked = over_paths(along, 8, 200000, value),
                       exact = over_paths(along, 8, 200000, value, DensityTracking::exact);
    for (int b = 0; b < 3; ++b)
      EXPECT_NEAR(tracked.mean[b], exact.mean[b],
                  4 * std::sqrt(tracked.squares[b] + exact.squares[b]) / tracked.count + 1e-12)
          << what << " band " << b;
  };
  agree(scattered, "scattered");
  agree(emitted, "emitted");
}

/// Estimates of what passes, over heroes: value / mean(weight(estimate)).
template <class Weight>
PixelSamples over_shadows(const Along& along, Weight weight) {
  PixelSamples sum;
  for (int i = 0; i < 200000; ++i) {
    RandomStream random(hash_combine(78, static_cast<uint64_t>(i)));
    const Transmittance t = tracked_transmittance(along.stretches, along.direction, i % 3, random);
    sum.add(t.value / Bands::mean(weight(t)));
  }
  return sum;
}

TEST(DensityTracking, RatioTrackedTransmittancesAreRightInTheMean) {
  const Along along = grids();
  expect(over_shadows(along, [](const Transmittance& t) { return t.lit; }),
         transmittance(along.stretches, along.direction).value, "passed");
}

TEST(DensityTracking, PathsWeighedAgainstJoiningALightAreCountedOnce) {
  // As above; now both ways draw collisions, and know each other's densities.
  const Along along = grids();
  const Vec3d closed = transmittance(along.stretches, along.direction).value;
  for (const double p : {0.1, 1.0, 20.0}) {
    const PixelSamples passed = over_paths(along, 8, 200000, [&](const ScatterEvent& e, const Bands& b, const Vec3d&) {
      return e.scatters ? Vec3d(0) : b.beta / Bands::mean(b.made + b.lit * p);
    });
    const PixelSamples joined = over_shadows(along, [&](const Transmittance& t) { return t.lit * p + t.made; });
    for (int b = 0; b < 3; ++b)
      EXPECT_NEAR(passed.mean[b] + p * joined.mean[b], closed[b],
                  4 * std::sqrt(passed.squares[b] + p * p * joined.squares[b]) / passed.count + 1e-12)
          << p << " band " << b;
  }
}

TEST(DensityTracking, NothingIsNanAtExtremes) {
  for (const float strength : {1e-30f, 1e-3f, 1e3f, 1e30f}) {  // of the last, tracking would not end
    const Along along({grid({strength, 0, 1}, {0, strength, 1e-20f}, FieldSampling::trilinear, speckled),
                       grid({0, 0, strength}, {}, FieldSampling::nearest, speckled)},
                      8);
    const PixelSamples paths = over_paths(along, 8, 300, [](const ScatterEvent&, const Bands& b, const Vec3d& e) {
      return b.beta / Bands::mean(b.made) + 0.0 * (b.beta / Bands::mean(b.made + b.lit * 0.5)) + e;
    });
    EXPECT_EQ(paths.rejected, 0u) << strength;
    for (int i = 0; i < 300; ++i) {
      RandomStream random(static_cast<uint64_t>(i));
      const Transmittance t = tracked_transmittance(along.stretches, along.direction, i % 3, random);
      const Vec3d weighed = t.value / Bands::mean(t.lit + t.made);
      for (int b = 0; b < 3; ++b) EXPECT_TRUE(weighed[b] >= 0 && weighed[b] < 100) << strength << ' ' << weighed[b];
    }
  }
}

TEST(FogAlong, OverlappingMediaOfConstantDensityAreExact) {
  // Two boxes that overlap in the middle third: piece by piece.
  Medium a = medium("box_fog", {1, 1, 1}, {}), b = medium("box_fog", {0.5f, 2, 0}, {});
  a.position = WorldPoint::from(2, 0, 0);
  b.position = WorldPoint::from(3, 0, 0);
  a.half_extent = b.half_extent = {1, 1, 1};
  a.emission = {1, 0, 0};
  b.emission = {0, 1, 5};
  const Along along({a, b}, 10);
  const FogView fog = fog_along(along.stretches, along.direction);
  for (int band = 0; band < 3; ++band) {
    const double x = 1, y = Vec3d(0.5, 2, 0)[band], ex = Vec3d(1, 0, 0)[band], ey = Vec3d(0, 1, 5)[band];
    const double first = ex * (1 - std::exp(-x)),
                 middle = (x * ex + y * ey) / (x + y) * (1 - std::exp(-x - y)) * std::exp(-x),
                 last = y > 0 ? ey * (1 - std::exp(-y)) * std::exp(-2 * x - y) : 0;
    EXPECT_NEAR(fog.added[band], first + middle + last, 1e-6) << band;
    EXPECT_NEAR(fog.value[band], std::exp(-2 * x - 2 * y), 1e-6) << band;
  }
}

TEST(Phase, ItsDensityIntegratesToOneAndItsMeanCosineIsTheAnisotropy) {
  for (const double g : {-0.9, -0.3, 0.0, 1e-4, 0.5, 0.95}) {
    constexpr int kSteps = 200000;
    double whole = 0, mean = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double c = -1 + 2 * (i + 0.5) / kSteps, p = phase_density(g, c) * 2 * kTestPi * 2 / kSteps;
      whole += p, mean += p * c;
    }
    EXPECT_NEAR(whole, 1, 1e-4) << g;
    EXPECT_NEAR(mean, g, 1e-4) << g;
    // Samples: mean cosine, and its square, which for this function is (1 + 2 g^2) / 3.
    const Vec3d forward = glm::normalize(Vec3d(0.3, -0.7, 0.2));
    double cosine = 0, squared = 0;
    for (int i = 0; i < kSteps; ++i) {
      const glm::vec2 u(uniform01(random_bits(1, i, 0, 0)), uniform01(random_bits(2, i, 0, 0)));
      const double c = dot(sample_phase(g, forward, u), forward);
      cosine += c / kSteps, squared += c * c / kSteps;
    }
    EXPECT_NEAR(cosine, g, 4 * 0.6 / std::sqrt(kSteps)) << g;
    EXPECT_NEAR(squared, (1 + 2 * g * g) / 3, 4 * 0.35 / std::sqrt(kSteps)) << g;
  }
}

}  // namespace
}  // namespace render
