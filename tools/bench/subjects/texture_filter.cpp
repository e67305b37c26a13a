/// What each filter of the blocks' textures costs, and how far its picture is from the mean over each pixel: the
/// valley, whole, 640x360, by the rasterizer, from its first camera and from the one on the ground, where more is seen
/// at a slant. The sky alone lights it, and there are no coarser levels, so that nothing else differs.
///
/// off    blocks in one colour
/// point  the texel at the pixel's middle
/// mip    @n: texture_anisotropy of n
/// exact  the mean over 8 x 8 places of each pixel's footprint
/// The reference is the mean of 16 x 16 pictures by `point`, each through another place of the pixels. Pixels in which
/// pictures without textures differ hold an edge of something, and don't count.
#include <algorithm>
#include <memory>

#include <fmt/format.h>

#include "render/backend.h"
#include "tools/bench/screen_pictures.h"
#include "tools/picture.h"

namespace tools {

namespace {

constexpr int kWidth = 640, kHeight = 360;

render::RenderKnobs knobs_of(render::TextureFilter filter, int anisotropy) {
  render::RenderKnobs knobs;
  knobs.textures = filter, knobs.texture_anisotropy = std::max(anisotropy, 1);  // of the filters that have probes
  knobs.sun_shadow = render::SunShadow::none;
  knobs.view_distance = 256;
  knobs.lod_error_px = 0;
  return knobs;
}

struct Truth {
  render::Image image;
  std::vector<bool> counts;  // of each pixel
};

Truth truth_of(const world::World& world, const render::Camera& camera, int side) {
  const auto rays = make_backend("raycast");
  CHECK(rays.ok());
  const auto mean_of = [&](render::TextureFilter filter, int n) {
    return supersampled(**rays, world, camera, knobs_of(filter, 1), kWidth, kHeight, n);
  };
  Truth truth{mean_of(render::TextureFilter::point, side), {}};
  const render::Image one = mean_of(render::TextureFilter::off, 1), several = mean_of(render::TextureFilter::off, 4);
  for (size_t i = 0; i < one.pixels.size(); ++i) {
    const render::Rgb &a = one.pixels[i], &b = several.pixels[i];
    const auto near = [](float x, float y) { return std::abs(x - y) <= 1e-4f * std::abs(y); };
    truth.counts.push_back(near(a.r, b.r) && near(a.g, b.g) && near(a.b, b.b));
  }
  return truth;
}

}  // namespace

void add_subject_texture_filter(Registry& registry) {
  Subject subject{
      .question = "what does a filter of textures blur or let flicker, and what does it cost?",
      .reference = "the mean of 16x16 pictures by rays, each through another place of the pixels (quick: 8x8)",
      .metrics = {"RMS error of radiance (relative)", "mean FLIP"},
      .work_unit = "pictures",
      .knob_unit = "probes",
      .threads = 2};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    TRY(const world::World* valley, context.world("valley"));
    struct Step {
      const char* name;
      render::TextureFilter filter;
      int anisotropy;
    };
    using render::TextureFilter;
    for (const Step& step : {Step{"off", TextureFilter::off, 0}, Step{"point", TextureFilter::point, 0},
                             Step{"mip", TextureFilter::mip, 1}, Step{"mip", TextureFilter::mip, 2},
                             Step{"mip", TextureFilter::mip, 4}, Step{"mip", TextureFilter::mip, 8},
                             Step{"mip", TextureFilter::mip, 16}, Step{"exact", TextureFilter::exact, 0}}) {
      for (const std::string name : {"oblique", "ground"}) {
        const auto backend = rasterizer_of_its_own();  // from elsewhere it would extract faces anew
        TRY(const world::CameraPlacement placed, world::camera_of(*valley, name));
        const render::Camera camera = render::Camera::from(placed);
        const auto draw = [=] {
          auto frame = backend()->render(world::WorldView(*valley), camera, knobs_of(step.filter, step.anisotropy),
                                         kWidth, kHeight);
          return frame.ok() ? std::move(frame->image) : render::Image();
        };
        const std::string method = fmt::format("{} {}", name, step.name);
        Setting s{.method = method, .setting = method, .problem = name};
        if (step.anisotropy > 0) s.setting += fmt::format("@{}", step.anisotropy);
        s.knob = step.anisotropy;
        s.is_default =
            step.filter == render::RenderKnobs{}.textures &&
            (step.filter != TextureFilter::mip || step.anisotropy == render::RenderKnobs{}.texture_anisotropy);
        s.measure = [=, &context](uint64_t) {
          const auto truth = context.shared<Truth>("texture_filter " + name, [&] {
            return std::make_shared<Truth>(truth_of(*valley, camera, context.quick() ? 8 : 16));
          });
          render::Image drawn = draw();
          for (size_t i = 0; i < drawn.pixels.size() && i < truth->counts.size(); ++i)
            if (!truth->counts[i]) drawn.pixels[i] = truth->image.pixels[i];
          return picture_error(drawn, truth->image);
        };
        s.run = [=] {
          keep(draw().pixels.size());
          return 1.0;
        };
        settings.push_back(std::move(s));
      }
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
