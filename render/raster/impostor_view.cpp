#include "render/raster/impostor_view.h"

#include <algorithm>
#include <limits>

#include "render/raster/impostors.shared.h"

namespace render::raster {

namespace {

/// Of texels around the box.
constexpr int kMargin = kSpreadTexels + 1;

}  // namespace

double ImpostorView::error(double metres) const {
  const double close = 1 - metres / nearest;
  if (!(close > 0)) return std::numeric_limits<double>::infinity();
  const double texel = pitch / std::sqrt(2.0) / close;
  return texel + metres * 0.5 * (1 / nearest - 1 / farthest) / (close * close);
}

double ImpostorView::reach(double radians) const {
  if (!(error(0) < radians)) return 0;
  double low = 0, high = nearest;
  for (int i = 0; i < 24; ++i) {
    const double middle = 0.5 * (low + high);
    (error(middle) <= radians ? low : high) = middle;
  }
  return low;
}

std::optional<ImpostorView> impostor_view(const Camera& eye, const Vec3d& low, const Vec3d& high, double pitch,
                                          int most_texels) {
  ImpostorView view;
  view.pitch = pitch;
  view.camera = eye;
  view.camera.window = {};
  const Vec3d middle = 0.5 * (low + high);
  const double distance = glm::length(middle);
  if (!(distance > 0)) return std::nullopt;
  view.camera.forward = middle / distance;
  // Depths, and the window at view depth 1.
  const PixelRays axes(view.camera, 1, 1);
  view.nearest = std::numeric_limits<double>::infinity(), view.farthest = 0;
  Vec3d first(view.nearest), last(-view.nearest);
  for (int i = 0; i < 8; ++i) {
    const Vec3d p(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z);
    const double z = glm::dot(p, axes.forward);
    // A corner far beside the axis would take many texels, and one behind the camera can't be shown.
    if (!(z > 0.25 * glm::length(p))) return std::nullopt;
    view.nearest = std::min(view.nearest, z), view.farthest = std::max(view.farthest, z);
    const Vec3d at(glm::dot(p, axes.right) / z, -glm::dot(p, axes.up) / z, 0);
    first = glm::min(first, at), last = glm::max(last, at);
  }
  view.near = 0.9 * view.nearest;
  // A window of whole texels, some more than the box on each side, of a picture around the axis.
  const int x = static_cast<int>(std::floor(first.x / pitch)) - kMargin,
            y = static_cast<int>(std::floor(first.y / pitch)) - kMargin;
  const int end_x = static_cast<int>(std::ceil(last.x / pitch)) + kMargin,
            end_y = static_cast<int>(std::ceil(last.y / pitch)) + kMargin;
  view.width = end_x - x, view.height = end_y - y;
  if (view.width > most_texels || view.height > most_texels) return std::nullopt;
  const int half = std::max({-x, -y, end_x, end_y});
  view.camera.vertical_fov = 2 * std::atan(half * pitch);
  view.camera.window = {double(x + half), double(y + half), 2 * half, 2 * half};
  return view;
}

}  // namespace render::raster
