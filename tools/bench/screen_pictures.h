/// Pictures of the valley that subjects about the screen share.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "render/backend.h"
#include "tools/bench/benchmark.h"

namespace tools {

/// A rasterizer for one setting alone, made when it is first asked for; null where there is no device. Another value of
/// a knob makes pipelines and levels anew, and settings take turns: shared, one would count that as drawing.
std::function<render::Backend*()> rasterizer_of_its_own();

/// The mean over side x side points of each pixel, by a picture for each; empty where one fails.
render::Image supersampled(render::Backend& backend, const world::World& world, const render::Camera& camera,
                           const render::RenderKnobs& knobs, int width, int height, int side);

/// A backend, a world and a camera that make pictures of one size.
class ScreenPictures {
 public:
  static Result<std::shared_ptr<ScreenPictures>> make(const world::World& world, const std::string& backend, int width,
                                                      int height);
  /// Empty where it fails.
  render::Frame frame(const render::RenderKnobs& knobs);
  render::Image supersampled(const render::RenderKnobs& knobs, int side) {
    return tools::supersampled(*backend_, *world_, camera_, knobs, width_, height_, side);
  }

 private:
  const world::World* world_ = nullptr;
  std::unique_ptr<render::Backend> backend_;
  render::Camera camera_;
  int width_ = 0, height_ = 0;
};

/// One picture again and again, of which parts are made over several pictures: they are before the first that counts.
class SettledView {
 public:
  SettledView(std::shared_ptr<const world::World> world, const render::Camera& camera, const render::RenderKnobs& knobs,
              int width, int height)
      : world_(std::move(world)), camera_(camera), knobs_(knobs), width_(width), height_(height) {}
  /// Empty where it fails.
  render::Image draw();

 private:
  const std::function<render::Backend*()> backend_ = rasterizer_of_its_own();
  const std::shared_ptr<const world::World> world_;
  const render::Camera camera_;
  const render::RenderKnobs knobs_;
  const int width_, height_;
  bool settled_ = false;
};

/// RMS difference of all bands over the RMS of the reference; NaN where their sizes differ.
double relative_rms_of(const render::Image& image, const render::Image& reference);
/// That, mean FLIP, and the bias; NaN as above.
ErrorSample picture_error(const render::Image& image, const render::Image& reference);

}  // namespace tools
