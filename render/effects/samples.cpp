#include "render/effects/samples.h"

#include "render/effects/chain.h"
#include "world/base/jobs.h"

namespace render {

namespace {

double halton(uint64_t index, uint64_t base) {
  double value = 0, digit = 1;
  for (; index > 0; index /= base) digit /= static_cast<double>(base), value += digit * double(index % base);
  return value;
}

}  // namespace

std::vector<glm::dvec2> sample_shifts(AntiAliasing anti_aliasing, uint64_t picture) {
  // In sixteenths of a pixel.
  const auto points = [](std::initializer_list<glm::dvec2> sixteenths) {
    std::vector<glm::dvec2> shifts;
    for (const glm::dvec2& p : sixteenths) shifts.push_back(p / 16.0);
    return shifts;
  };
  switch (anti_aliasing) {
    case AntiAliasing::none:
      break;
    case AntiAliasing::x2:
      return points({{4, 4}, {-4, -4}});
    case AntiAliasing::x4:
      return points({{-2, -6}, {6, -2}, {-6, 2}, {2, 6}});
    case AntiAliasing::x8:
      return points({{1, -3}, {-1, 3}, {5, 1}, {-3, -5}, {-5, 5}, {-7, -1}, {3, 7}, {7, -7}});
    case AntiAliasing::temporal: {
      const uint64_t i = picture % 8;
      // The mean of the eight is the middle.
      return {{halton(i + 1, 2) - 0.4453125, halton(i + 1, 3) - 0.5}};
    }
  }
  return {{0, 0}};
}

Camera shifted(const Camera& camera, int width, int height, const glm::dvec2& shift) {
  Camera moved = camera;
  if (shift == glm::dvec2(0)) return moved;
  if (moved.window.whole_width <= 0) moved.window.whole_width = width;
  if (moved.window.whole_height <= 0) moved.window.whole_height = height;
  moved.window.x += shift.x, moved.window.y += shift.y;
  return moved;
}

world::Result<Frame> average_samples(Backend& backend, const world::WorldView& view, const Camera& camera,
                                     const RenderKnobs& knobs, int width, int height) {
  RenderKnobs bare = without_effects(knobs);
  bare.anti_aliasing = AntiAliasing::none;
  const std::vector<glm::dvec2> shifts = sample_shifts(knobs.anti_aliasing);
  const auto weight = 1.0f / static_cast<float>(shifts.size());
  Frame mean;
  for (const glm::dvec2& shift : shifts) {
    TRY(Frame one, backend.render(view, shifted(camera, width, height, shift), bare, width, height));
    if (mean.image.pixels.empty()) mean.image = Image(width, height);
    world::parallel_ranges(mean.image.pixels.size(), 65536, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) mean.image.pixels[i] = mean.image.pixels[i] + one.image.pixels[i] * weight;
    });
    one.report.add_passes(mean.report);
    one.report.ms += mean.report.ms;
    mean.report = std::move(one.report);
  }
  TRY_STATUS(finish_picture(view, camera, knobs, mean));
  return mean;
}

}  // namespace render
