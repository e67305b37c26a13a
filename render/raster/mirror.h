/// The plane of the grid that mirrors most of a picture, and the picture that is seen in it (knob reflection=planar).
#pragma once

#include <optional>

#include "render/camera.h"
#include "render/image/image.h"
#include "world/store/ray_stream.h"
#include "world/world.h"

namespace render::raster {

struct MirrorPlane {
  int axis = 1;
  int32_t plane = 0;  // of the world
  int side = 1;       // on which the eye is: 1: at larger coordinates
};

/// What the eye sees in the plane, taken by the mirrored eye; what lies behind the plane is left out of it.
struct MirrorPicture {
  MirrorPlane plane;
  Camera camera;
  Image image;
};

/// The plane with most of the water, glass and mirrors that a grid of 32 x 18 rays meets first; none where it has less
/// than a fiftieth of them.
std::optional<MirrorPlane> find_mirror_plane(const world::WorldView& view, const world::RayStream& occupied,
                                             const Camera& camera, int width, int height);
Camera mirrored_camera(const Camera& camera, const MirrorPlane& mirror);

}  // namespace render::raster
