#include "tools/bench/screen_pictures.h"

#include <cmath>

#include "render/effects/samples.h"
#include "render/image/error_metrics.h"
#include "tools/picture.h"

namespace tools {

Result<std::shared_ptr<ScreenPictures>> ScreenPictures::make(const world::World& world, const std::string& backend,
                                                             int width, int height) {
  auto maker = std::make_shared<ScreenPictures>();
  maker->world_ = &world, maker->width_ = width, maker->height_ = height;
  TRY(maker->backend_, make_backend(backend));
  TRY(const world::CameraPlacement placement, world::camera_of(world, ""));
  maker->camera_ = render::Camera::from(placement);
  return maker;
}

render::Frame ScreenPictures::frame(const render::RenderKnobs& knobs) {
  const world::WorldView view(*world_);
  auto drawn = backend_->render(view, camera_, knobs, width_, height_);
  return drawn.ok() ? std::move(*drawn) : render::Frame{};
}

std::function<render::Backend*()> rasterizer_of_its_own() {
  const auto kept = std::make_shared<std::unique_ptr<render::Backend>>();
  return [kept]() -> render::Backend* {
    if (!*kept)
      if (auto made = make_backend("raster"); made.ok()) *kept = std::move(*made);
    return kept->get();
  };
}

render::Image supersampled(render::Backend& backend, const world::World& world, const render::Camera& camera,
                           const render::RenderKnobs& knobs, int width, int height, int side) {
  render::Image mean(width, height);
  const float weight = 1.0f / static_cast<float>(side * side);
  for (int i = 0; i < side * side; ++i) {
    const glm::dvec2 shift((i % side + 0.5) / side - 0.5, (i / side + 0.5) / side - 0.5);
    const auto frame =
        backend.render(world::WorldView(world), render::shifted(camera, width, height, shift), knobs, width, height);
    if (!frame.ok()) return {};
    for (size_t p = 0; p < mean.pixels.size(); ++p) mean.pixels[p] = mean.pixels[p] + frame->image.pixels[p] * weight;
  }
  return mean;
}

render::Image SettledView::draw() {
  constexpr int kSettling = 24;  // pictures
  render::Backend* const by = backend_();
  if (!by) return {};
  const auto picture = [&] { return by->render(world::WorldView(*world_), camera_, knobs_, width_, height_); };
  for (int i = 0; i < kSettling && !settled_; ++i)
    if (!picture().ok()) return {};
  settled_ = true;
  auto frame = picture();
  return frame.ok() ? std::move(frame->image) : render::Image();
}

double relative_rms_of(const render::Image& image, const render::Image& reference) {
  if (image.pixels.size() != reference.pixels.size() || image.pixels.empty()) return std::nan("");
  double squares = 0, all = 0;
  for (size_t i = 0; i < image.pixels.size(); ++i)
    for (int band = 0; band < 3; ++band) {
      const auto got = static_cast<double>((&image.pixels[i].r)[band]);
      const auto known = static_cast<double>((&reference.pixels[i].r)[band]);
      squares += (got - known) * (got - known), all += known * known;
    }
  return std::sqrt(squares / all);
}

ErrorSample picture_error(const render::Image& image, const render::Image& reference) {
  if (image.pixels.size() != reference.pixels.size()) return ErrorSample{{std::nan(""), std::nan("")}, 0};
  const render::ErrorMetrics metrics = render::compare_images(image, reference).metrics;
  return ErrorSample{{relative_rms_of(image, reference), metrics.flip}, metrics.bias};
}

}  // namespace tools
