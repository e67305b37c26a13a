/// Light through media, from luminaires and as levels: A, L and CL of the catalogue.
#include <cmath>

#include "render/trace/media.h"
#include "sim/light/flood.h"
#include "tools/bench/stability.h"
#include "world/base/jobs.h"
#include "world/base/random.h"
#include "world/luminaires/luminaire.h"
#include "world/media/medium.h"
#include "world/media/medium.shared.h"

namespace tools {

namespace {

constexpr double kPi = 3.14159265358979323846;

double thin_fog(bool naive) {
  double worst = 0;
  for (const double x : {1e-4, 1e-6, 3e-8, 1e-9}) {
    const double exact = static_cast<double>(-std::expm1l(-static_cast<long double>(x)));
    const double got =
        naive ? double{1 - std::exp(-static_cast<float>(x))} : static_cast<double>(world::shared::opacity(x));
    worst = std::max(worst, std::abs(got / exact - 1));
  }
  return worst;
}

double split_fog() {
  world::Medium m;
  m.kind = "height_fog", m.scale_height = 20;
  const world::Vec3d origin(-40, 2, 1), direction = glm::normalize(world::Vec3d(1, -0.05, 0.02));
  const double whole = render::closed_transmittance(m, origin, direction, 0, 100, 0.05);
  double product = 1;
  for (int i = 0; i < 1000; ++i)
    product *= render::closed_transmittance(m, origin, direction, 0.1 * i, 0.1 * (i + 1), 0.05);
  return std::abs(product - whole);
}

/// Depth of height fog along rays that are all but level, against its series.
double level_fog(bool naive) {
  world::Medium m;
  m.kind = "height_fog", m.scale_height = 20;
  double worst = 0;
  for (const double slope : {0.0, 1e-320, -1e-17, 1e-17, 1e-8, -1e-8}) {
    const double x = 5 * slope, exact = 100 * (1 - x / 2 + x * x / 6);
    const double depth = naive ? 20 / slope * (1 - std::exp(-100 * slope / 20))
                               : world::medium_depth(m, {0, 0, 0}, {std::sqrt(1 - slope * slope), slope, 0}, 0, 100);
    const double error = std::abs(depth - exact);
    worst = std::isnan(error) ? INFINITY : std::max(worst, error);
  }
  return worst;
}

Result<double> sphere_far_away() {
  world::Luminaire l;
  l.name = l.kind = "sphere";
  l.radiance = {1, 1, 1};
  l.radius = 0.25f;
  TRY(const world::LuminaireSampler sphere, world::LuminaireSampler::make(l));
  double worst = 0;
  for (const double ratio : {1.001, 1.5, 3.0, 100.0, 1e6}) {
    const double mean_cosine = (1 + std::sqrt((1 - 1 / ratio) * (1 + 1 / ratio))) / 2;
    const double exact = kPi / (ratio * ratio);
    const double got = sphere.sample({0, -0.25 * ratio, 0}, {0.3f, 0.4f}).biradiance.g * mean_cosine;
    worst = std::max(worst, std::abs(got / exact - 1));
  }
  return worst;
}
double sphere_far_away_naive() {
  const float ratio = 1e-6f, solid_angle = 2 * float(kPi) * (1 - std::sqrt(1 - ratio * ratio));
  return std::abs(double{solid_angle} / (kPi * 1e-12) - 1);
}

Result<double> light_after_edits() {
  world::World w(world::standard_blocks());
  sim::FloodLight light(w.store, world::LightModel::flood_rgb);
  const char* const names[] = {"lamp_warm", "lamp_blue", "stone", "water", "glass_red", "air", "air"};
  double wrong = 0;
  for (int i = 1; i <= 2000; ++i) {
    world::VoxelPos v;
    for (int a = 0; a < 3; ++a) v[a] = static_cast<int32_t>(world::random_bits(1, i, a, 3) % 32) - 16;
    world::EditBatch batch;
    batch.fill({v, v}, w.palette->find(names[world::random_bits(1, i, 3, 3) % 7]).value());
    TRY_STATUS(w.store.apply(batch));
    light.update();
    if (i % 200) continue;
    sim::FloodLight anew(w.store, world::LightModel::flood_rgb);
    anew.compute();
    wrong += anew.volume().content_hash() != light.volume().content_hash();
  }
  return wrong;
}

}  // namespace

void add_stability_light(std::vector<StabilityCase>& cases) {
  cases.push_back({"A2", "thin fog takes away its optical depth", "relative", 1e-15, "four units of a double",
                   [](BenchContext&) -> Result<double> { return thin_fog(false); }, [] { return thin_fog(true); }});
  cases.push_back({"A4", "a thousand pieces of fog let through what the whole does", "of transmittance", 1e-12,
                   "a thousand roundings of a double", [](BenchContext&) -> Result<double> { return split_fog(); }});
  cases.push_back({"A6", "height fog has no seam where a ray is level", "m of depth", 1e-9, "series to x^2",
                   [](BenchContext&) -> Result<double> { return level_fog(false); }, [] { return level_fog(true); }});
  cases.push_back({"L2", "a sphere above the horizon is an omni at any distance", "relative", 1e-6, "closed form",
                   [](BenchContext&) { return sphere_far_away(); }, sphere_far_away_naive});
  cases.push_back({"CL1", "light after 2000 edits is all light anew", "hashes", 0, "bit equality",
                   [](BenchContext&) { return light_after_edits(); }});
}

}  // namespace tools
