/// Where the picture of a box is taken from, how large it is, and how wrong it is once the camera has moved.
///
/// The picture is a window of a plane perpendicular to the axis from the eye to the box's middle. Drawn later, it
/// stands in the world at the depth that halves what parallax does at both ends of the box:
///
///   1/plane = (1/nearest + 1/farthest) / 2
///
/// A point at p on a ray from the eye is shown at q on the same ray. A camera that has moved by m sees each of them
/// moved by atan2(m s sin, 1 - m s cos) with s = 1/|p| and s = 1/|q|, the angles between the ray and m; the derivative
/// by s is at most m / (1 - m s)^2, and |1/|p| - 1/|q|| at most (1/nearest - 1/farthest) / 2. Beside that a pixel shows
/// what the middle of its texel saw, half a diagonal away at most.
///
/// source  Paulo Maciel, Peter Shirley. Visual Navigation of Large Environments Using Textured Clusters. 1995
///         Gernot Schaufler. Dynamically Generated Impostors. 1995 (pictures taken anew when an angle grows too large)
#pragma once

#include <optional>

#include "render/camera.h"

namespace render::raster {

struct ImpostorView {
  Camera camera;             // off the planes of the grid; its window is the picture
  int width, height;         // texels
  double pitch;              // of a texel, at view depth 1
  double nearest, farthest;  // view depths of the box
  double near;               // of the picture's depths: depth = near / view depth

  PixelRays rays() const { return {camera, width, height}; }
  double plane() const { return 2 / (1 / nearest + 1 / farthest); }
  /// The largest angle between where something is and where the picture shows it, to a camera moved by `metres`, rad;
  /// infinite where no bound is known.
  double error(double metres) const;
  /// How far a camera may move until that is `radians`, m, or somewhat less; 0 where it is more from the start.
  double reach(double radians) const;
};

/// Of a box relative to the camera. Nothing where the camera is within it or so near that it would fill a wide angle,
/// or where a side has more than most_texels.
std::optional<ImpostorView> impostor_view(const Camera& camera, const Vec3d& low, const Vec3d& high, double pitch,
                                          int most_texels);

}  // namespace render::raster
