/// OpenVDB's mesher (tools::VolumeToMesh) on a SolidField: dual, a vertex in each cell that the surface passes, quads
/// between them; in flat places fewer and larger ones where adaptivity is above 0.
///
/// error  vertices are floats, counted from the middle of the mesh: a mesh of 2000 voxels rounds to 1e-4 voxel
#pragma once

#include "world/base/errors.h"
#include "world/store/solid_field.h"

namespace world {

/// 0 <= adaptivity <= 1. The same mesh for any number of threads.
Result<VoxelMesh> openvdb_mesh(const SolidField& field, double adaptivity);

}  // namespace world
