/// Bright spots that make a lens flare: the sun, and luminaires that have a place, as the camera sees them.
///
/// A spot counts by the irradiance that it sends to the lens, by the part of its disk that nothing opaque hides and
/// what clouds, where they are drawn, let through of that, and fades out where it leaves the picture, within a fifth of
/// its size beyond the edge.
/// cost   32 rays a spot, of at most kMostFlareSpots spots; of the rest the weakest are left out
/// error  the part that nothing opaque hides is one of 33 values
#pragma once

#include <vector>

#include "render/camera.h"
#include "render/image/image.h"
#include "render/knobs.h"
#include "world/world.h"

namespace render {

struct FlareSpot {
  double x = 0, y = 0;  // half heights of the whole picture from its middle; y points down
  Rgb radiance;         // of a white matte surface that the spot lights, times the part of it that is seen
};

std::vector<FlareSpot> flare_spots(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs,
                                   int width, int height);

}  // namespace render
