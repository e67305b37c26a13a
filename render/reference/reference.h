/// The reference: paths traced through all that a world holds, until the picture's error is as small as asked.
///
/// Unbiased in each band, but for what render/trace/geometry.h says of luminaires that lie on faces (1e-4 of their
/// distance) and a depth of double's rounding. It is what "exact" means where no closed form exists; its own error is
/// reported, see Film::relative_error: with independent samples a standard error, with the sobol sequence a bound.
/// knobs  spp, max_depth, sample_sequence, view_distance; light_transport is always path
/// fails  as trace_picture()
#pragma once

#include <memory>

#include "render/backend.h"

namespace render {

world::Result<std::unique_ptr<Backend>> make_reference_backend();

}  // namespace render
