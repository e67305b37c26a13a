/// What light costs where a ray has arrived: BSDFs, luminaires, media one by one, and whole paths of the reference.
/// The rival of each is the least that does the same for somebody: Lambert's constant, a point without size, a march
/// of 16 steps, direct light alone; of rays among many luminaires, a loop over all.
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "render/backend.h"
#include "render/bsdf/bsdf.h"
#include "render/trace/geometry.h"
#include "render/trace/media.h"
#include "tools/bench/benchmark.h"
#include "tools/picture.h"
#include "world/base/random.h"
#include "world/luminaires/emitter.shared.h"
#include "world/luminaires/kinds.h"
#include "world/media/brick_field.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

using world::Vec2f;
using world::Vec3d;
using world::Vec3f;

constexpr int kInputs = 1024;  // a call works on so many, all drawn before it
constexpr int kMarchSteps = 16;

struct Numbers {
  uint64_t seed;
  int64_t n = 0;
  double operator()() { return world::uniform01_double(world::random_bits(seed, n++, 0, 0)); }
  float unit() { return world::uniform01(world::random_bits(seed, n++, 0, 0)); }
  Vec3d direction() {
    const double z = 2 * (*this)() - 1, phi = 6.28318530717958648 * (*this)(), r = std::sqrt(1 - z * z);
    return {r * std::cos(phi), z, r * std::sin(phi)};
  }
};

// --- BSDFs --------------------------------------------------------------------------------------------------------

/// Both directions above the surface; the lobes take their dearest formula.
struct Scatterings {
  std::vector<Vec3f> wi, wo, u;
  render::BsdfParameters parameters;
};

std::shared_ptr<const Scatterings> scatterings(uint64_t seed) {
  auto all = std::make_shared<Scatterings>();
  Numbers random{seed};
  const auto above = [&] {
    const Vec3d d = random.direction();
    return Vec3f(Vec3d(d.x, std::abs(d.y), d.z));
  };
  for (int i = 0; i < kInputs; ++i) {
    all->wi.push_back(above()), all->wo.push_back(above());
    const float x = random.unit(), y = random.unit();
    all->u.push_back({x, y, random.unit()});
  }
  all->parameters.lambertian = {0.4f, 0.3f, 0.2f};
  all->parameters.glossy = Vec3f(0.1f);
  all->parameters.transmission = Vec3f(0.3f);
  all->parameters.smoothness = 60;
  all->parameters.eta = 1.5f;
  all->parameters.coverage = 0.5f;
  all->parameters.gloss = render::shared::kGlossFresnel;
  return all;
}

Contender evaluation(const render::Bsdf& bsdf, const std::shared_ptr<const Scatterings>& s) {
  return {std::string(bsdf.name), [&bsdf, s] {
            Vec3f sum(0);
            for (size_t i = 0; i < kInputs; ++i)
              sum += bsdf.finite_density(s->parameters, s->wi[i], s->wo[i], Vec3f(0, 1, 0));
            keep(sum);
            return double{kInputs};
          }};
}

Contender scattering(const render::Bsdf& bsdf, const std::shared_ptr<const Scatterings>& s) {
  return {std::string(bsdf.name), [&bsdf, s] {
            Vec3f sum(0);
            for (size_t i = 0; i < kInputs; ++i)
              sum += bsdf.scatter_in(s->parameters, s->wo[i], Vec3f(0, 1, 0), s->u[i]).weight;
            keep(sum);
            return double{kInputs};
          }};
}

void add_bsdfs(Registry& registry) {
  for (const render::Bsdf& bsdf : render::bsdfs())
    for (const bool samples : {false, true}) {
      const std::string name(bsdf.name);
      registry.add({.name = (samples ? "scatter_" : "evaluate_") + name,
                    .what = samples ? "draws a direction from " + name + ", its weight and density"
                                    : "finite scattering density of " + name + " for two directions",
                    .unit = samples ? "M samples/s" : "M evaluations/s",
                    .scale = 1e6,
                    .threads = 1,
                    .prepare = [&bsdf, samples](BenchContext& context) -> Result<Prepared> {
                      const auto inputs = scatterings(context.seed());
                      const auto of = samples ? scattering : evaluation;
                      Prepared prepared{.ours = of(bsdf, inputs)};
                      const render::Bsdf* lambert = render::find_bsdf("lambert");
                      if (lambert && lambert != &bsdf) prepared.rivals.push_back(of(*lambert, inputs));
                      return prepared;
                    }});
    }
}

// --- luminaires ---------------------------------------------------------------------------------------------------

/// Pictures of 64 x 64 for what an image modulates, 128 triangles for a mesh.
world::Luminaire typical_luminaire(const world::LuminaireKind& kind) {
  namespace keys = world::shared;
  world::Luminaire l;
  l.name = l.kind = kind.name;
  l.power = {30, 60, 90}, l.irradiance = {3, 2, 1}, l.radiance = {0.5f, 1, 2};
  l.radius = kind.keys & keys::kKeyClamp ? 0.01f : 0.5f;
  if (kind.keys & keys::kKeyCone) l.half_angle = 0.8f, l.inner_half_angle = 0.6f;
  if (kind.keys & (keys::kKeySlide | keys::kKeySky)) {
    auto image = std::make_shared<world::LightImage>();
    image->width = image->height = 64;
    for (int i = 0; i < 64 * 64; ++i) {
      const float v = 0.1f + world::uniform01(world::random_bits(7, i, 0, 0));
      image->pixels.push_back({v, 0.5f * v, v * v});
    }
    l.light_image = image;
  }
  if (kind.keys & keys::kKeyFile)
    for (int i = 0; i < 64; ++i) {
      const Vec3f at(0.1f * float(i % 8), 0.02f * float(i % 3), 0.1f * float(i / 8)), x(0.1f, 0, 0), z(0, 0, 0.1f);
      l.triangles.insert(l.triangles.end(), {at, at + x, at + z, at + x + z, at + z, at + x});
    }
  return l;
}

Result<Contender> light_samples(const world::LuminaireKind& kind, uint64_t seed) {
  TRY(world::LuminaireSampler made, world::LuminaireSampler::make(typical_luminaire(kind)));
  const auto sampler = std::make_shared<const world::LuminaireSampler>(std::move(made));
  struct Question {
    Vec3d receiver;
    Vec2f u;
  };
  std::vector<Question> questions;
  Numbers random{seed};
  for (int i = 0; i < kInputs; ++i) {
    const Vec3d receiver(4 * random() - 2, -1 - 3 * random(), 4 * random() - 2);
    const float x = random.unit();
    questions.push_back({receiver, {x, random.unit()}});
  }
  return Contender{std::string(kind.name), [sampler, questions = std::move(questions)] {
                     float sum = 0;
                     for (const Question& q : questions) sum += sampler->sample(q.receiver, q.u).biradiance.g;
                     keep(sum);
                     return double{kInputs};
                   }};
}

void add_luminaires(Registry& registry) {
  for (const world::LuminaireKind& kind : world::luminaire_members())
    registry.add({.name = "sample_" + std::string(kind.name),
                  .what = "a point of a luminaire '" + std::string(kind.name) + "' and its biradiance, 2 to 5 m off",
                  .unit = "M samples/s",
                  .scale = 1e6,
                  .threads = 1,
                  .prepare = [&kind](BenchContext& context) -> Result<Prepared> {
                    Prepared prepared;
                    TRY(prepared.ours, light_samples(kind, context.seed()));
                    for (const world::LuminaireKind& other : world::luminaire_members())
                      if (other.name == "omni" && kind.name != "omni") {
                        TRY(Contender rival, light_samples(other, context.seed()));
                        prepared.rivals.push_back(std::move(rival));
                      }
                    return prepared;
                  }});
}

/// A ray among many luminaires that have an area, and which of them it meets.
struct LampField {
  world::World world{world::standard_blocks()};
  world::WorldView view{world};
  std::optional<render::TraceScene> scene;
  std::optional<render::Tracer> tracer;
  std::vector<render::TraceRay> rays;
  std::vector<render::Crossing> crossings;

  static Result<std::shared_ptr<LampField>> make(int count, uint64_t seed) {
    auto field = std::make_shared<LampField>();
    Numbers random{seed};
    const auto place = [&] { return world::WorldPoint::from(256 * random(), 256 * random(), 256 * random()); };
    for (int i = 0; i < count; ++i) {
      world::Luminaire l;
      l.kind = "rectangle";
      l.position = place();
      l.axis = Vec3f(random.direction());
      l.up = Vec3f(glm::normalize(glm::cross(Vec3d(l.axis), random.direction())));
      l.power = {1, 1, 1};
      field->world.luminaires.push_back(l);
    }
    TRY(field->scene, render::TraceScene::build(field->view));
    field->tracer.emplace(*field->scene);
    for (int i = 0; i < kInputs; ++i) {
      render::TraceRay ray;
      ray.ray = world::GridRay(place(), random.direction());
      field->rays.push_back(ray);
    }
    return field;
  }
};

void add_lamp_fields(Registry& registry) {
  for (const int count : {10, 1000, 100000})
    registry.add({.name = fmt::format("ray_among_{}", count),
                  .what = fmt::format("the first of {} rectangles of 1 m in a cube of 256 m that a ray meets", count),
                  .unit = "M rays/s",
                  .scale = 1e6,
                  .threads = 1,
                  .prepare = [count](BenchContext& context) -> Result<Prepared> {
                    TRY(const std::shared_ptr<LampField> field, LampField::make(count, context.seed()));
                    return Prepared{.ours = {"tree",
                                             [=] {
                                               double sum = 0;
                                               for (const render::TraceRay& r : field->rays)
                                                 sum += field->tracer->intersect(r, field->crossings).t < 1e9;
                                               keep(sum);
                                               return double{kInputs};
                                             }},
                                    .rivals = {{"a loop over all", [=] {
                                                  // Fewer rays: 10^5 of them take a millisecond each.
                                                  const size_t rays = count > 1000 ? 8 : kInputs;
                                                  double sum = 0;
                                                  for (size_t i = 0; i < rays; ++i) {
                                                    const world::GridRay& r = field->rays[i].ray;
                                                    double nearest = 1e9;
                                                    for (const render::SceneLuminaire& l : field->scene->luminaires()) {
                                                      const auto hit =
                                                          l.sampler.meet(field->rays[i].start() - l.luminaire->position,
                                                                         Vec3f(r.direction));
                                                      if (hit) nearest = std::min(nearest, hit->distance);
                                                    }
                                                    sum += nearest < 1e9;
                                                  }
                                                  keep(sum);
                                                  return static_cast<double>(rays);
                                                }}}};
                  }});
}

// --- media --------------------------------------------------------------------------------------------------------

/// 48 voxels wide, trilinear; density falls smoothly to 0.
Result<std::shared_ptr<const world::BrickField>> ball() {
  std::vector<world::FieldLeaf> leaves;
  for (int x = -3; x < 3; ++x)
    for (int y = -3; y < 3; ++y)
      for (int z = -3; z < 3; ++z) {
        world::FieldLeaf& leaf = leaves.emplace_back();
        leaf.leaf = {x, y, z};
        for (int i = 0; i < world::kLeafVoxels; ++i) {
          const world::VoxelPos v = world::voxel_from_leaf(leaf.leaf) + world::offset_in_leaf(i);
          const double r2 = double(v.x) * v.x + double(v.y) * v.y + double(v.z) * v.z;
          leaf.values[static_cast<size_t>(i)] = static_cast<float>(std::max(0.0, 1 - r2 / (24 * 24)));
        }
      }
  return world::BrickField::make(std::move(leaves), world::FieldSampling::trilinear, "ball");
}

struct Line {
  Vec3d origin, direction;
  double t0, t1;
};

Result<Prepared> prepare_medium(const std::string& kind, int number, uint64_t seed) {
  auto medium = std::make_shared<world::Medium>();
  medium->kind = kind, medium->kind_number = number;
  medium->half_extent = Vec3f(24), medium->scale_height = 20;
  if (kind == "density_grid") {
    TRY(medium->field, ball());
  }
  auto lines = std::make_shared<std::vector<Line>>();
  Numbers random{seed};
  for (int tries = 0; static_cast<int>(lines->size()) < kInputs; ++tries) {
    if (tries > 100 * kInputs) return world::input_error("no ray meets the medium '" + kind + "'");
    const Vec3d direction = random.direction(), origin = 20.0 * random() * random.direction() - 60.0 * direction;
    const world::MediumInterval in = world::medium_interval(*medium, origin, direction, 200);
    if (!in.empty()) lines->push_back({origin, direction, in.t0, in.t1});
  }
  return Prepared{.ours = {"exact",
                           [=] {
                             double sum = 0;
                             for (const Line& l : *lines)
                               sum += world::medium_depth(*medium, l.origin, l.direction, l.t0, l.t1);
                             keep(sum);
                             return double{kInputs};
                           }},
                  .rivals = {{"16 steps", [=] {
                                Numbers unused{1};
                                double sum = 0;
                                for (const Line& l : *lines)
                                  sum += render::marched_depth(*medium, l.origin, l.direction, l.t0, l.t1,
                                                               render::MarchRule::midpoint, kMarchSteps, unused);
                                keep(sum);
                                return double{kInputs};
                              }}}};
}

void add_media(Registry& registry) {
  const std::vector<std::string> kinds = world::medium_kinds();
  for (size_t number = 0; number < kinds.size(); ++number)
    registry.add({.name = "depth_" + kinds[number],
                  .what = "depth of the medium '" + kinds[number] + "' along rays of up to 200 m that meet it",
                  .unit = "M rays/s",
                  .scale = 1e6,
                  .threads = 1,
                  .prepare = [kind = kinds[number], number](BenchContext& context) {
                    return prepare_medium(kind, static_cast<int>(number), context.seed());
                  }});
}

// --- paths --------------------------------------------------------------------------------------------------------

/// Millions of camera samples a second of one picture; making the scene ready is not counted.
Result<std::function<double()>> camera_samples(BenchContext& context, const std::string& name,
                                               const std::string& backend_name) {
  TRY(const world::World* world, context.world(name));
  TRY(const world::CameraPlacement placement, world::camera_of(*world, ""));
  TRY(render::RenderKnobs knobs, resolve_knobs("usual", world->knobs, {}, {}));
  TRY(std::shared_ptr<render::Backend> backend, make_backend(backend_name));
  const render::Camera camera = render::Camera::from(placement);
  knobs.spp = context.quick() ? 4 : 16;
  knobs.light_transport = render::LightTransport::direct;  // the reference follows all paths, whatever it is told
  const int width = 128, height = 72;
  return std::function<double()>([=] {
    const auto frame = backend->render(world::WorldView(*world), camera, knobs, width, height);
    if (!frame.ok() || frame->report.passes.size() < 2) return std::nan("");
    return 1e-3 * width * height * knobs.spp / frame->report.passes[1].ms;
  });
}

void add_paths(Registry& registry) {
  for (const char* scene : {"cornell", "valley"})
    registry.add(
        {.name = std::string("paths_") + scene,
         .what = std::string("camera samples of ") + scene + " at 128x72 by the reference: paths of any length",
         .unit = "M paths/s",
         .timing = Timing::reported,
         .threads = 1,
         .clock = Clock::wall,
         .repetitions = 3,
         .prepare = [scene](BenchContext& context) -> Result<Prepared> {
           TRY(auto ours, camera_samples(context, scene, "reference"));
           TRY(auto rival, camera_samples(context, scene, "raycast"));
           return Prepared{.ours = {"reference", std::move(ours)}, .rivals = {{"direct light", std::move(rival)}}};
         }});
}

}  // namespace

void add_suite_shading(Registry& registry) {
  add_bsdfs(registry);
  add_luminaires(registry);
  add_lamp_fields(registry);
  add_media(registry);
  add_paths(registry);
}

}  // namespace tools
