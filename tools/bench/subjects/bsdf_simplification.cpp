/// How wrong a surface looks outdoors when its highlight is simplified, and what an evaluation costs.
///
/// A horizontal surface under the sky and the sun, seen from 0 to 85 degrees off the normal, in the plane of the sun
/// and across it. What it sends to the eye is integrated over the sky with 16384 directions drawn from the lobe itself,
/// by a lattice of three irrational steps; the sun's one direction is evaluated, as in a picture. The lobe that ships
/// is the reference, since it alone conserves energy at all angles and ends as the mirror: its own error is 0, and that
/// of the others is what their simplification does. Half the directions move it by 3e-4 at most. "matte" is what the
/// raster backend draws: k_L + k_g without a highlight.
#include <array>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "render/bsdf/blinn_phong.shared.h"
#include "render/bsdf/bsdf.h"
#include "render/shading.h"
#include "tools/bench/benchmark.h"
#include "world/base/random.h"

namespace tools {

namespace {

using render::BsdfParameters;
using world::Vec3f;

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr int kEvaluations = 1000000;  // a call
const Vec3f kUp(0, 1, 0);

struct Model {
  std::string name;
  uint32_t gloss;
  bool matte = false;
};
const Model kReference{"with Fresnel", render::shared::kGlossFresnel};

struct Material {
  std::string name;
  BsdfParameters parameters;
};

Result<std::vector<Material>> materials() {
  std::vector<Material> all;
  const world::BlockPalette& blocks = world::standard_blocks();
  for (const char* name : {"rusty_iron", "obsidian", "gold_block"}) {
    const auto id = blocks.find(name);
    if (!id) return world::input_error(std::string("there is no block '") + name + "'");
    all.push_back({name, render::bsdf_parameters(blocks[*id], 1.00029f, false)});
  }
  BsdfParameters plastic;
  plastic.lambertian = {0.5f, 0.1f, 0.08f};
  plastic.glossy = Vec3f(0.04f);
  plastic.smoothness = 60;
  all.push_back({"dull plastic", plastic});
  return all;
}

BsdfParameters simplified(BsdfParameters p, const Model& model) {
  p.gloss = model.gloss;
  if (model.matte) p.lambertian += p.glossy, p.glossy = Vec3f(0);
  return p;
}

Vec3f tilted(double degrees, double azimuth) {
  const double across = std::sin(degrees * kDegree);
  return Vec3f(across * std::cos(azimuth * kDegree), std::cos(degrees * kDegree), across * std::sin(azimuth * kDegree));
}

/// Where the surface is looked at from; the sun's azimuth is 0.
std::vector<Vec3f> views() {
  std::vector<Vec3f> all;
  for (const double azimuth : {180.0, 90.0})
    for (const double degrees : {0.0, 20.0, 40.0, 55.0, 70.0, 85.0}) all.push_back(tilted(degrees, azimuth));
  return all;
}

glm::dvec3 reflected_radiance(const BsdfParameters& p, const render::Bsdf& bsdf, Vec3f wo, int directions) {
  const world::Environment environment;
  const Vec3f sun = tilted(50, 0);
  glm::dvec3 sky(0);
  for (int i = 0; i < directions; ++i) {
    // source  Martin Roberts. The Unreasonable Effectiveness of Quasirandom Sequences. 2018; g^4 = g + 1
    const auto at = [&](double step) {
      const double u = 0.5 + step * i;
      return static_cast<float>(std::min(u - std::floor(u), 1 - 0x1p-24));
    };
    const render::BsdfSample drawn =
        bsdf.scatter_in(p, wo, kUp, {at(0.8191725133961645), at(0.6710436067037893), at(0.5497004779019703)});
    const render::Rgb light = world::sky_radiance(environment, drawn.direction.y);
    sky += glm::dvec3(drawn.weight.x * light.r, drawn.weight.y * light.g, drawn.weight.z * light.b);
  }
  const world::Irradiance3 e = environment.sun_irradiance;
  const Vec3f f = bsdf.finite_density(p, sun, wo, kUp) * sun.y;
  return sky / double(directions) + glm::dvec3(f.x * e.r, f.y * e.g, f.z * e.b);
}

/// Metrics: mean and largest error relative to the reference, over views and bands; bias: mean signed error.
ErrorSample errors_of(const Material& material, const Model& model, int directions) {
  const render::Bsdf& bsdf = *render::find_bsdf("blinn_phong");
  double sum = 0, signed_sum = 0, largest = 0;
  for (const Vec3f& wo : views()) {
    const glm::dvec3 right = reflected_radiance(simplified(material.parameters, kReference), bsdf, wo, directions);
    const glm::dvec3 seen = reflected_radiance(simplified(material.parameters, model), bsdf, wo, directions);
    for (int band = 0; band < 3; ++band) {
      const double error = (seen[band] - right[band]) / right[band];
      sum += std::abs(error);
      signed_sum += error;
      largest = std::max(largest, std::abs(error));
    }
  }
  const double count = 3.0 * static_cast<double>(views().size());
  return {{sum / count, largest}, signed_sum / count};
}

struct Pairs {
  std::vector<std::array<Vec3f, 2>> all;
};

std::shared_ptr<const Pairs> make_pairs(uint64_t seed) {
  auto pairs = std::make_shared<Pairs>();
  for (int64_t i = 0; i < 1000; ++i) {
    const auto draw = [&](uint64_t stream) {
      return world::uniform01_double(world::random_bits(seed, i, 0, 0, 0, stream));
    };
    pairs->all.push_back({tilted(89 * draw(0), 360 * draw(1)), tilted(89 * draw(2), 360 * draw(3))});
  }
  return pairs;
}

}  // namespace

void add_subject_bsdf_simplification(Registry& registry) {
  Subject subject{
      .question = "how wrong does a surface look under sky and sun with a simpler highlight?",
      .reference = "the lobe that ships (Fresnel, conserving), integrated with 16384 directions drawn from it",
      .metrics = {"error of radiance (mean relative)", "error of radiance (largest relative)"},
      .work_unit = "evaluations; a call makes 1e6: 1 ms a call is 1 ns an evaluation",
      .noise_floor = 3e-4};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    TRY(const std::vector<Material> all, materials());
    const auto pairs = make_pairs(context.seed());
    const int directions = context.quick() ? 1024 : 16384;
    std::vector<Setting> settings;
    for (const Model& model :
         {Model{"matte", render::shared::kGlossExact, true}, Model{"published factor", render::shared::kGlossPublished},
          Model{"exact factor", render::shared::kGlossExact}, kReference})
      for (const Material& material : all) {
        Setting setting{.method = model.name, .setting = fmt::format("{}@{}", model.name, material.name)};
        setting.problem = material.name;
        setting.knob = material.parameters.smoothness;
        setting.is_default = model.name == kReference.name;
        setting.measure = [=](uint64_t) { return errors_of(material, model, directions); };
        const render::Bsdf* bsdf = render::find_bsdf(model.matte ? "lambert" : "blinn_phong");
        const BsdfParameters parameters = simplified(material.parameters, model);
        setting.run = [=] {
          Vec3f sum(0);
          for (int round = 0; round < kEvaluations / static_cast<int>(pairs->all.size()); ++round)
            for (const auto& [wi, wo] : pairs->all) sum += bsdf->finite_density(parameters, wi, wo, kUp);
          keep(sum);
          return static_cast<double>(kEvaluations);
        };
        settings.push_back(std::move(setting));
      }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
