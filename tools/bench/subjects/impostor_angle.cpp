/// What pictures of far chunks, kept from picture to picture, spoil and save: impostor_error_px of 0 to 4.
///
/// The valley, whole, 640x360, from its camera "far", which flies on: impostors are made at the start, then each
/// picture is drawn half a metre on; errors are those of four of them, two metres apart, so that impostors are seen at
/// angles that they weren't made from, up to what the knob lets be. The reference is what faces show there: impostors
/// spoil nothing else. Times are of pictures on the way, those that make an impostor anew among them.
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "render/backend.h"
#include "tools/bench/screen_pictures.h"
#include "tools/picture.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

constexpr int kWidth = 640, kHeight = 360;
constexpr int kSettling = 8;              // pictures until all impostors are made
constexpr int kOnTheWay = 4, kSteps = 4;  // pictures that are compared; pictures up to the next of them

/// A flight that goes on where it was.
struct Flight {
  std::function<render::Backend*()> backend;
  const world::World* world;
  render::Camera start;
  render::RenderKnobs knobs;
  int at = 0;

  Result<render::Image> draw(int step) {
    render::Backend* const by = backend();
    if (!by) return world::usage_error("no device");
    render::Camera camera = start;
    camera.position = start.position + world::Vec3d(0.4, 0, 0.3) * double(step);
    TRY(render::Frame frame, by->render(world::WorldView(*world), camera, knobs, kWidth, kHeight));
    return std::move(frame.image);
  }
  /// Of the places that are compared; empty where one fails.
  std::vector<render::Image> pictures() {
    std::vector<render::Image> all;
    for (int i = 0; i < kSettling; ++i)
      if (!draw(0).ok()) return {};
    for (int step = 1; step <= kOnTheWay * kSteps; ++step) {
      auto drawn = draw(step);
      if (!drawn.ok()) return {};
      if (step % kSteps == 0) all.push_back(std::move(*drawn));
    }
    return all;
  }
};

}  // namespace

void add_subject_impostor_angle(Registry& registry) {
  Subject subject{.question = "what do pictures that stand for far chunks spoil, and what do they save?",
                  .reference = "the faces of those chunks, at the same places",
                  .metrics = {"RMS error of radiance (relative)", "mean FLIP"},
                  .work_unit = "pictures",
                  .knob_unit = "eighths of a pixel",
                  .threads = 2};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    TRY(const world::World* valley, context.world("valley"));
    TRY(const world::CameraPlacement far, world::camera_of(*valley, "far"));
    const auto flight = [&](int eighths) {
      auto made = std::make_shared<Flight>();
      made->backend = rasterizer_of_its_own(), made->world = valley, made->start = render::Camera::from(far);
      made->knobs.impostor_error_px = static_cast<float>(eighths) / 8;
      return made;
    };
    const auto faces = flight(0);
    for (const int eighths : {0, 2, 4, 8, 16, 32}) {
      if (context.quick() && eighths == 2) continue;
      const auto drawn = eighths == 0 ? faces : flight(eighths);
      Setting s{.method = eighths == 0 ? "faces" : "impostors",
                .setting = fmt::format("{}@{}", eighths == 0 ? "faces" : "impostors", eighths),
                .problem = "valley"};
      s.knob = eighths, s.is_default = eighths == std::lround(8 * render::RenderKnobs{}.impostor_error_px);
      s.measure = [=, &context](uint64_t) {
        const auto truth = context.shared<std::vector<render::Image>>(
            "impostor_angle", [&] { return std::make_shared<std::vector<render::Image>>(faces->pictures()); });
        const std::vector<render::Image> seen = drawn->pictures();
        if (seen.empty() || truth->size() != seen.size()) return ErrorSample{{std::nan(""), std::nan("")}, 0};
        ErrorSample mean{{0, 0}, 0};
        for (size_t i = 0; i < seen.size(); ++i) {
          const ErrorSample one = picture_error(seen[i], (*truth)[i]);
          for (size_t m = 0; m < mean.errors.size(); ++m)
            mean.errors[m] += one.errors[m] / static_cast<double>(seen.size());
          mean.bias += one.bias / static_cast<double>(seen.size());
        }
        return mean;
      };
      s.run = [drawn] {
        drawn->at = (drawn->at + 1) % 200;  // there and back
        keep(drawn->draw(drawn->at < 100 ? drawn->at : 200 - drawn->at).ok());
        return 1.0;
      };
      settings.push_back(std::move(s));
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
