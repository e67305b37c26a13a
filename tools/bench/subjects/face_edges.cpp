/// Coverage of faces by the rasterizer's 1/256 pixel grid, or solved at each pixel: the knob face_edges, on the valley
/// at three sizes, under the open sky alone and without textures, so that nothing but edges differs.
#include <fmt/format.h>

#include "tools/bench/screen_pictures.h"

namespace tools {

void add_subject_face_edges(Registry& registry) {
  Subject subject{.question = "what does it cost that no pixel shows another face than the one its ray meets?",
                  .reference = "the same picture by rays, which are right to the last bit",
                  .metrics = {"RMS error (relative)", "FLIP", "share of pixels that differ"},
                  .work_unit = "pixels",
                  .knob_unit = "pixels across",
                  .threads = 0};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    TRY(const world::World* valley, context.world("valley"));
    render::RenderKnobs knobs;
    knobs.lod_error_px = 0, knobs.view_distance = 256;
    knobs.sun_shadow = render::SunShadow::none, knobs.textures = render::TextureFilter::off;
    knobs.transparency = render::Transparency::opaque;
    std::vector<Setting> settings;
    for (const int width : {320, 640, 1280}) {
      if (context.quick() && width > 640) continue;
      const int height = width * 9 / 16;
      TRY(const auto rays, ScreenPictures::make(*valley, "raycast", width, height));
      for (const render::FaceEdges edges : {render::FaceEdges::hardware, render::FaceEdges::exact}) {
        TRY(const auto maker, ScreenPictures::make(*valley, "raster", width, height));
        const std::string method(knob_choices(edges)[static_cast<size_t>(edges)]);
        Setting s{.method = method, .setting = fmt::format("{}@{}", method, width)};
        s.problem = fmt::format("{}x{}", width, height), s.knob = width;
        s.is_default = edges == render::RenderKnobs{}.face_edges;
        render::RenderKnobs of_setting = knobs;
        of_setting.face_edges = edges;
        s.measure = [=, &context](uint64_t) {
          const auto truth = context.shared<render::Image>(fmt::format("face_edges {}", width), [&] {
            return std::make_shared<render::Image>(rays->frame(knobs).image);
          });
          const render::Image drawn = maker->frame(of_setting).image;
          ErrorSample error = picture_error(drawn, *truth);
          double differing = 0;
          for (size_t i = 0; i < drawn.pixels.size() && i < truth->pixels.size(); ++i) {
            const render::Rgb &a = drawn.pixels[i], &b = truth->pixels[i];
            differing += std::abs(a.g - b.g) > 1e-3f * std::max(a.g, b.g);
          }
          error.errors.push_back(differing / static_cast<double>(truth->pixels.size()));
          return error;
        };
        s.run = [=] {
          keep(maker->frame(of_setting).image.pixels.size());
          return static_cast<double>(width * height);
        };
        settings.push_back(std::move(s));
      }
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
