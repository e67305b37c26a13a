/// The ray caster: one ray a pixel through the grid's masks, on all threads, without a GPU.
///
/// A pixel shows the first visible face on its ray: the face of voxel A seen from the voxel B before it, where A is not
/// air, B is not opaque, and A is opaque or B is air or A's id is larger (render/extract/faces.h has the same rule).
/// From a camera in air that is the first voxel that is not air. From a camera inside a block it is what lies behind
/// the inner faces of that block, as in the rasterizer, which culls them. The sun's shadow is a second ray, from the
/// voxel in front of the face, exactly on it, through opaque voxels.
///
/// Unless the knob transparency says opaque, see-through blocks are layers instead: the ray goes straight on through
/// them to what lies behind (render/raycast/straight_walk.h), as the rasterizer's lists do.
///
/// That is so where one ray a pixel of direct light is asked for and the world has no luminaires, media or meshes.
/// Otherwise each sample is a call of an integrator (render/trace/transport.h), as light_transport says; integrators
/// draw cubes, whatever `contours` says.
///
/// Where the world has a level set (or contour_iso names a density) and contours are on, rays meet the smooth surface
/// (world/store/contour_walk.h) and the sun and the sky light its own normal. From inside a full voxel all is cubes.
///
/// knobs  view_distance (Euclidean, to the hit), sun_shadow, contours, contour_iso, light_transport and those of
///        render/trace/picture.h
/// error  without contours none beyond double rounding of the ray itself: the first hit equals the flat walk's, bit
///        for bit
/// fails  usage, where the picture's size or the camera is out of range
#pragma once

#include <memory>

#include "render/backend.h"

namespace render {

world::Result<std::unique_ptr<Backend>> make_raycast_backend();

}  // namespace render
