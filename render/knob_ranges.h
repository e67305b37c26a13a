/// What may be asked for of the numbers among the knobs of pictures: render/knob_ranges.def. The table of knobs refuses
/// any other text, and the backends any other record.
#pragma once

#include "render/knobs.h"

namespace render {

/// Fails at the first number that is out of its range, or isn't one.
world::Status check_ranges(const RenderKnobs& knobs);

}  // namespace render
