/// A pinhole or thin lens camera whose rays are relative to its own voxel, so that pictures don't depend on the
/// distance from the origin: positions enter the arithmetic only as (voxel - camera voxel), an exact integer.
#pragma once

#include <cmath>

#include "world/scenes/scene.h"
#include "world/space/world_point.h"

namespace render {

using world::Vec3d;

struct Camera {
  world::WorldPoint position;
  Vec3d forward{0, 0, -1};       // unit length
  double vertical_fov = 1.0472;  // radians, 0 < fov < pi
  double lens_radius = 0;        // m; 0: a pinhole, and all there is for raster
  double focus_distance = 10;    // m along forward, > 0: what lies there is sharp

  static Camera from(const world::CameraPlacement& placement) {
    return {placement.position, glm::normalize(placement.forward),
            placement.vertical_fov_deg * 3.14159265358979323846 / 180, placement.lens_radius_m,
            placement.focus_distance_m};
  }
};

/// The basis of a picture: ray_direction(px, py) = corner + px * step_x + py * step_y, through pixel centres at
/// (column + 0.5, row + 0.5). Not normalised: its component along `forward` is 1, so t is the view depth in metres.
struct PixelRays {
  Vec3d right, up, forward;  // orthonormal; up has the positive y
  double tan_half_x, tan_half_y;
  Vec3d corner, step_x, step_y;

  PixelRays(const Camera& camera, int width, int height) {
    forward = camera.forward;
    const Vec3d vertical = std::abs(forward.y) > 0.999999 ? Vec3d(0, 0, forward.y > 0 ? 1 : -1) : Vec3d(0, 1, 0);
    right = glm::normalize(glm::cross(forward, vertical));
    up = glm::cross(right, forward);
    tan_half_y = std::tan(camera.vertical_fov / 2);
    tan_half_x = tan_half_y * width / height;
    corner = forward - tan_half_x * right + tan_half_y * up;
    step_x = 2 * tan_half_x / width * right;
    step_y = -2 * tan_half_y / height * up;
  }
  Vec3d direction(double pixel_x, double pixel_y) const { return corner + pixel_x * step_x + pixel_y * step_y; }
};

}  // namespace render
