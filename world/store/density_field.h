/// A world's density layer as a field that rays sample: a copy in bricks, without OpenVDB in the way.
#pragma once

#include "world/media/brick_field.h"
#include "world/store/layer.h"

namespace world {

/// Voxels and tiles that are 0 cost nothing; `name` is whose they are, for messages. The copy doesn't follow later
/// changes of the layer.
Result<std::shared_ptr<const DensityField>> density_field(const FloatLayer& layer, FieldSampling sampling,
                                                          const std::string& name);

}  // namespace world
