/// A picture by samples: camera rays through a box filter, an integrator for each, a film.
///
/// Samples are taken in passes of all pixels; pixels in parallel, each pixel's samples in order. So the picture is the
/// same bits for any number of threads, and for any number of stops on the way.
/// knobs  spp, max_depth, sample_sequence and those of the integrator
/// fails  usage, where the picture's size, the camera or a knob is out of range; input, where an image of a luminaire
///        or a film can't be read
#pragma once

#include "render/backend.h"
#include "render/trace/transport.h"
#include "render/trace/world_lit.h"

namespace render {

/// bodies: relative to the camera; light_transport=whitted meets them wherever its rays go. lit: the world's light for
/// direct light; null: the open sky alone.
world::Result<Frame> trace_picture(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs,
                                   const Sampling& sampling, int width, int height,
                                   std::span<const shared::DrawnBox> bodies = {}, const WorldLitSource* lit = nullptr);

/// The ray of one sample; lens and pixel from the sampler's first dimensions. `centre`: through the pixel's centre.
world::GridRay camera_ray(const Camera& camera, const PixelRays& rays, int x, int y, const Sampler& sampler,
                          bool centre);

}  // namespace render
