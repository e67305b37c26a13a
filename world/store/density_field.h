/// A world's density layer as a field that rays sample: a copy in bricks, without OpenVDB in the way.
#pragma once

#include "world/media/brick_field.h"
#include "world/store/layer.h"

namespace world {

/// Voxels and tiles that are 0 cost nothing; `name` is whose they are, for messages. The copy doesn't follow later
/// changes of the layer.
Result<std::shared_ptr<const DensityField>> density_field(const FloatLayer& layer, FieldSampling sampling,
                                                          const std::string& name);

/// Density grids without a field sample the world's layer, whose voxels count from the medium's position. Fails where
/// one needs it and it is null.
Status fill_density_grids(const FloatLayer* layer, std::vector<Medium>& media);

/// True where the field says what the layer says now.
bool is_copy_of(const DensityField& field, const FloatLayer& layer);

}  // namespace world
