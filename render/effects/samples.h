/// Where in a pixel a picture looks: for anti-aliasing by several pictures, each shifted by parts of a pixel.
#pragma once

#include <vector>

#include "render/backend.h"

namespace render {

/// Shifts from the middle of a pixel, in pixels, within +-1/2; one of 0 where there is no anti-aliasing. Of `temporal`
/// the one of the `picture`th in a row: eight points of Halton's sequence of bases 2 and 3, in turn.
/// source  Vulkan specification, "Standard sample locations"; John Halton. On the efficiency of certain quasi-random
///         sequences of points. 1960
std::vector<glm::dvec2> sample_shifts(AntiAliasing anti_aliasing, uint64_t picture = 0);

/// The camera of a picture of width x height that looks through shifted points.
Camera shifted(const Camera& camera, int width, int height, const glm::dvec2& shift);

/// The mean of a backend's pictures through the points of knobs.anti_aliasing, then the effects.
world::Result<Frame> average_samples(Backend& backend, const world::WorldView& view, const Camera& camera,
                                     const RenderKnobs& knobs, int width, int height);

}  // namespace render
