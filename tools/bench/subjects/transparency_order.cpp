/// What an order of see-through layers is worth, and what rays that bend or are mirrored are, by pictures of the scene
/// glasshouse (160 x 90, quick: 80 x 45) on the device that the raster backend finds.
///
///   order       opaque, weighted (no order), sorted by the middles of merged faces and of unit faces, lists; the
///               reference is the ray caster's straight rays, which are in exact order
///   coverage    lists with partial coverage by 16 samples, hashed and correlated; the same reference, exact coverage
///   reflection, none, screen, planar and traced, with what is seen through bent in the same way; the reference is the
///   refraction  ray caster at light_transport=whitted. Nothing throws a shadow of the sun there, on either side: what
///               bends light is black to a shadow ray of Whitted's and clear to one of the rasterizer's, which is
///               another approximation than the one that is measured (and four times as large)
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "render/image/error_metrics.h"
#include "render/raycast/raycast.h"
#include "tools/bench/screen_pictures.h"
#include "tools/picture.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

using render::Image;
using render::RenderKnobs;

/// The scene, its camera and the ray caster.
struct Garden {
  world::World world;
  render::Camera camera;
  std::unique_ptr<render::Backend> raycast;
  int width = 160, height = 90;

  static Result<std::shared_ptr<Garden>> make(bool quick) {
    auto garden = std::make_shared<Garden>();
    TRY(const world::Scene scene, world::load_scene("glasshouse"));
    world::ImportReport report;
    TRY(garden->world, world::build_world(scene, report));
    garden->camera = render::Camera::from(garden->world.cameras.front());
    TRY(garden->raycast, render::make_raycast_backend());
    if (quick) garden->width = 80, garden->height = 45;
    return garden;
  }
  Image draw(render::Backend& backend, const RenderKnobs& knobs) const {
    const world::WorldView view(world);
    auto frame = backend.render(view, camera, knobs, width, height);
    return frame.ok() ? std::move(frame->image) : Image(width, height);
  }
};

/// Mean difference of radiance over the reference's mean, FLIP, and the mean signed difference.
ErrorSample difference(const Image& image, const Image& right) {
  double error = 0, bias = 0, sum = 0;
  for (size_t i = 0; i < right.pixels.size(); ++i) {
    const float a[] = {image.pixels[i].r, image.pixels[i].g, image.pixels[i].b};
    const float b[] = {right.pixels[i].r, right.pixels[i].g, right.pixels[i].b};
    for (int c = 0; c < 3; ++c) error += std::abs(double{a[c]} - b[c]), bias += double{a[c]} - b[c], sum += b[c];
  }
  return {{error / sum, render::compare_images(image, right).metrics.flip}, bias / sum};
}

}  // namespace

void add_subject_transparency_order(Registry& registry) {
  Subject subject{
      .question = "what does the exact order of see-through layers cost, and what a bent or mirrored ray?",
      .reference = "order, coverage: straight rays of the ray caster; reflection: its light_transport=whitted",
      .metrics = {"mean error of radiance (relative)", "mean FLIP"},
      .work_unit = "pixels"};
  subject.threads = 0;
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    if (auto device = make_backend("raster"); !device.ok()) return device.error();  // whether there is a device
    TRY(const std::shared_ptr<Garden> garden, Garden::make(context.quick()));
    std::vector<Setting> settings;
    const auto add = [&](const std::string& method, const std::string& problem, int knob, bool is_default,
                         RenderKnobs knobs, const RenderKnobs& of_reference) {
      knobs.lod_error_px = 0;  // the ray caster knows no coarser levels
      Setting s{.method = method, .setting = fmt::format("{}@{}", method, knob), .problem = problem};
      s.knob = knob, s.is_default = is_default;
      const auto raster = rasterizer_of_its_own();
      s.measure = [=, &context](uint64_t) {
        const auto right = context.shared<Image>("transparency_order " + problem, [&] {
          return std::make_shared<Image>(garden->draw(*garden->raycast, of_reference));
        });
        return difference(garden->draw(*raster(), knobs), *right);
      };
      s.run = [=] {
        keep(garden->draw(*raster(), knobs).pixels[0].r);
        return static_cast<double>(garden->width) * garden->height;
      };
      settings.push_back(std::move(s));
    };
    RenderKnobs straight;
    straight.reflection = render::Reflection::none, straight.refraction = render::Refraction::none;
    const auto ordered = [&](render::Transparency order, bool merge) {
      RenderKnobs k = straight;
      k.transparency = order, k.merge_faces = merge;
      return k;
    };
    using render::Transparency;
    add("opaque", "order", 0, false, ordered(Transparency::opaque, true), straight);
    add("weighted", "order", 1, false, ordered(Transparency::weighted, true), straight);
    add("sorted merged faces", "order", 2, false, ordered(Transparency::sorted, true), straight);
    add("sorted unit faces", "order", 3, false, ordered(Transparency::sorted, false), straight);
    add("lists", "order", 4, true, ordered(Transparency::lists, true), straight);
    using render::CoveragePattern;
    for (const auto& [name, pattern] :
         {std::pair{"correlated samples", CoveragePattern::correlated},
          std::pair{"hashed samples", CoveragePattern::hashed}, std::pair{"exact share", CoveragePattern::exact}}) {
      RenderKnobs k = straight;
      k.coverage_pattern = pattern;
      add(name, "coverage", static_cast<int>(pattern), pattern == CoveragePattern::exact, k, straight);
    }
    RenderKnobs whitted;
    whitted.light_transport = render::LightTransport::whitted, whitted.light_samples = 1;
    whitted.sun_shadow = render::SunShadow::none;
    using render::Reflection, render::Refraction;
    const struct {
      const char* name;
      Reflection reflection;
      Refraction refraction;
    } rungs[] = {{"sky alone and straight", Reflection::none, Refraction::none},
                 {"planar and straight", Reflection::planar, Refraction::none},
                 {"screen and straight", Reflection::screen, Refraction::none},
                 {"screen and screen", Reflection::screen, Refraction::screen},
                 {"traced and straight", Reflection::traced, Refraction::none},
                 {"traced and traced", Reflection::traced, Refraction::traced}};
    int knob = 0;
    for (const auto& rung : rungs) {
      RenderKnobs k;
      k.sun_shadow = render::SunShadow::none;
      k.reflection = rung.reflection, k.refraction = rung.refraction;
      add(rung.name, "reflection and refraction", knob++,
          k.reflection == RenderKnobs{}.reflection && k.refraction == RenderKnobs{}.refraction, k, whitted);
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
