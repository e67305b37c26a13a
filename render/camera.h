/// A pinhole or thin lens camera whose rays are relative to its own voxel, so that pictures don't depend on the
/// distance from the origin: positions enter the arithmetic only as (voxel - camera voxel), an exact integer.
#pragma once

#include <cmath>

#include "world/scenes/scene.h"
#include "world/space/world_point.h"

namespace render {

using world::Vec3d;

/// A part of a larger picture: a tile of it, or the whole of it seen through points beside the middles of its pixels.
struct PictureWindow {
  double x = 0, y = 0;                    // where it begins, pixels of the whole from its upper left corner
  int whole_width = 0, whole_height = 0;  // 0: the picture is the whole

  friend bool operator==(const PictureWindow&, const PictureWindow&) = default;
};

struct Camera {
  world::WorldPoint position;
  Vec3d forward{0, 0, -1};       // unit length
  double vertical_fov = 1.0472;  // radians, 0 < fov < pi
  double lens_radius = 0;        // m; 0: a pinhole, and all there is for raster
  double focus_distance = 10;    // m along forward, > 0: what lies there is sharp
  PictureWindow window;          // the field of view is that of the whole

  static Camera from(const world::CameraPlacement& placement) {
    return {placement.position,
            glm::normalize(placement.forward),
            placement.vertical_fov_deg * 3.14159265358979323846 / 180,
            placement.lens_radius_m,
            placement.focus_distance_m,
            {}};
  }
};

/// The basis of a picture: ray_direction(px, py) = corner + px * step_x + py * step_y, through pixel centres at
/// (column + 0.5, row + 0.5). Not normalised: its component along `forward` is 1, so t is the view depth in metres.
struct PixelRays {
  Vec3d right, up, forward;       // orthonormal; up has the positive y
  double tan_half_x, tan_half_y;  // of the whole picture
  Vec3d corner, step_x, step_y;
  /// A point p relative to the camera, at depth z = p . forward, lies at (p . window_right) / (z window_half_x) from
  /// the middle of the window, from -1 at its left to 1 at its right; and so upwards.
  Vec3d window_right, window_up;
  double window_half_x, window_half_y;
  double longest;  // length of the longest direction of the window: 1 / cosine of its farthest corner

  PixelRays(const Camera& camera, int width, int height) {
    const PictureWindow& window = camera.window;
    const int whole_width = window.whole_width > 0 ? window.whole_width : width;
    const int whole_height = window.whole_height > 0 ? window.whole_height : height;
    forward = camera.forward;
    const Vec3d vertical = std::abs(forward.y) > 0.999999 ? Vec3d(0, 0, forward.y > 0 ? 1 : -1) : Vec3d(0, 1, 0);
    right = glm::normalize(glm::cross(forward, vertical));
    up = glm::cross(right, forward);
    tan_half_y = std::tan(camera.vertical_fov / 2);
    tan_half_x = tan_half_y * whole_width / whole_height;
    corner = forward - tan_half_x * right + tan_half_y * up;
    step_x = 2 * tan_half_x / whole_width * right;
    step_y = -2 * tan_half_y / whole_height * up;
    if (window.x != 0 || window.y != 0) corner += window.x * step_x + window.y * step_y;
    const double middle_x = (2 * (window.x + 0.5 * width) / whole_width - 1) * tan_half_x;
    const double middle_y = (1 - 2 * (window.y + 0.5 * height) / whole_height) * tan_half_y;
    window_right = right - middle_x * forward, window_up = up - middle_y * forward;
    window_half_x = tan_half_x * width / whole_width, window_half_y = tan_half_y * height / whole_height;
    const double far_x = std::abs(middle_x) + window_half_x, far_y = std::abs(middle_y) + window_half_y;
    longest = std::sqrt(1 + far_x * far_x + far_y * far_y);
  }
  Vec3d direction(double pixel_x, double pixel_y) const { return corner + pixel_x * step_x + pixel_y * step_y; }
};

}  // namespace render
