// Pictures of density grids by delta tracking, the reference, against closed forms and against exact depths.
#include <cmath>
#include <fstream>

#include "tests/render/trace/trace_worlds.h"
#include "tests/support.h"
#include "world/media/brick_field.h"
#include "world/scenes/scene.h"

namespace render {
namespace {

using namespace world;

Frame picture(const World& w, const Camera& camera, DensityTracking tracking, int spp) {
  RenderKnobs knobs = sampled(spp);
  knobs.density_tracking = tracking;
  return trace(w, camera, knobs, 32, 32);
}

/// Both are unbiased, with samples of their own: means lie within 4 standard errors of their difference, and single
/// pixels' differences, over theirs, are spread as errors are.
void expect_same(const Frame& a, const Frame& b, const char* what) {
  double mean[3] = {}, variance[3] = {};
  int far = 0, count = 0;
  for (int y = 0; y < a.image.height; ++y)
    for (int x = 0; x < a.image.width; ++x) {
      const Rgb p = a.image.at(x, y), q = b.image.at(x, y), v = a.variance.at(x, y), w = b.variance.at(x, y);
      const double off[3] = {double{p.r} - q.r, double{p.g} - q.g, double{p.b} - q.b};
      const double squares[3] = {(double{v.r} + w.r) / a.report.samples, (double{v.g} + w.g) / a.report.samples,
                                 (double{v.b} + w.b) / a.report.samples};
      for (int band = 0; band < 3; ++band) {
        mean[band] += off[band], variance[band] += squares[band];
        far += std::abs(off[band]) > 4 * std::sqrt(squares[band]) + 1e-9;
        ++count;
      }
    }
  for (int band = 0; band < 3; ++band)
    EXPECT_NEAR(mean[band], 0, 4 * std::sqrt(variance[band])) << what << " band " << band;
  EXPECT_LE(far, 0.005 * count) << what;
}

/// 24 voxels of 0.25 m a side.
std::shared_ptr<const DensityField> cube(float density) {
  std::vector<FieldLeaf> leaves;
  for (int x = 0; x < 3; ++x)
    for (int y = 0; y < 3; ++y)
      for (int z = 0; z < 3; ++z) {
        leaves.push_back({{x, y, z}, {}});
        leaves.back().values.fill(density);
      }
  return BrickField::make(std::move(leaves), FieldSampling::nearest, "cube").value();
}

TEST(DensityTracking, AHomogeneousCubeIsTheBoxOfFogWithAClosedForm) {
  World as_grid = dark_world(), as_box = dark_world();
  for (World* w : {&as_grid, &as_box}) {
    set_sky(*w, 0.25f);
    w->environment.sun_irradiance = {10, 9, 8};
    Medium m;
    m.name = m.kind = w == &as_grid ? "density_grid" : "box_fog";
    m.scattering = {0.3f, 0.5f, 0.7f};
    m.absorption = {0.1f, 0.02f, 0.3f};
    m.anisotropy = 0.4f;
    m.sampling = FieldSampling::nearest;
    m.voxel_size = 0.25f;
    m.half_extent = {3, 3, 3};
    m.position = w == &as_grid ? WorldPoint::from(0, 0, 0) : WorldPoint::from(3, 3, 3);
    if (w == &as_grid) {
      m.scattering = {0.15f, 0.25f, 0.35f}, m.absorption = {0.05f, 0.01f, 0.15f};
      m.field = cube(2);
    }
    w->media.push_back(m);
  }
  const Camera camera = looking({11, 7, 12}, {3, 3, 3}, 40);
  expect_same(picture(as_grid, camera, DensityTracking::delta, 128),
              picture(as_box, camera, DensityTracking::delta, 128), "cube");
}

TEST(DensityTracking, ACubeThatOnlyAbsorbsLeavesTheExponentialOfItsDepth) {
  World w = dark_world();
  set_sky(w, 1);
  Medium m;
  m.name = m.kind = "density_grid";
  m.absorption = {0.05f, 0.1f, 0.2f};
  m.voxel_size = 0.25f;
  m.field = cube(2);
  m.sampling = FieldSampling::nearest;
  w.media.push_back(m);
  // Straight through 6 m.
  const Image image = trace(w, looking({3.1, 2.9, 20}, {3.1, 2.9, 0}, 0.5), sampled(256), 16, 16).image;
  expect_mean(image, {std::exp(-0.6), std::exp(-1.2), std::exp(-2.4)}, "cube", 1e-3);
}

TEST(DensityTracking, SmokeIsTheSamePictureByTrackingAndByExactDepths) {
  const auto file = shared_data("vdb/smoke.vdb");
  if (!file) GTEST_SKIP();
  const TemporaryFolder folder;
  std::ofstream(folder / "smoke.toml")
      << "[world]\nfile = \"" << std::filesystem::absolute(*file).string() << "\"\n"
      << "[sun]\ndirection = [0.5, 0.6, 0.6]\nirradiance = [10, 9.5, 9]\n"
         "[sky]\nzenith = [0.3, 0.4, 0.6]\nhorizon = [0.6, 0.65, 0.7]\nground = [0.2, 0.2, 0.2]\n"
         "[[fill]]\nmin = [0, 0, 0]\nmax = [128, 256, 128]\nblock = \"air\"\n"
         "[[medium]]\nname = \"smoke\"\nkind = \"density_grid\"\nlayer = \"density\"\n"
         "scattering_per_m = [0.2, 0.18, 0.16]\nabsorption_per_m = [0.02, 0.03, 0.05]\nanisotropy = 0.3\n";
  const auto scene = load_scene((folder / "smoke.toml").string());
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  ImportReport report;
  auto world = build_world(*scene, report);
  ASSERT_TRUE(world.ok()) << world.error().message;
  world->environment = scene->environment;
  const Camera camera = looking({56, 120, 330}, {56, 112, 56}, 50);
  const Frame tracked = picture(*world, camera, DensityTracking::delta, 64),
              exact = picture(*world, camera, DensityTracking::exact, 64);
  EXPECT_EQ(tracked.report.nan_samples + exact.report.nan_samples, 0u);
  expect_same(tracked, exact, "smoke");
  std::printf("smoke, %u samples: tracked %.0f ms, error %.4f; exact depths %.0f ms, error %.4f\n",
              tracked.report.samples, tracked.report.ms, tracked.report.relative_error, exact.report.ms,
              exact.report.relative_error);
}

}  // namespace
}  // namespace render
