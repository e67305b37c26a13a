/// Where a picture of a world is taken from.
#pragma once

#include <string>

#include "world/space/world_point.h"

namespace world {

struct CameraPlacement {
  std::string name;
  WorldPoint position;
  Vec3d forward{0, 0, -1};       // unit length
  double vertical_fov_deg = 60;  // 0 < fov < 180
  double lens_radius_m = 0;      // >= 0; 0: a pinhole
  double focus_distance_m = 10;  // > 0, along forward
};

}  // namespace world
