/// Samples a solid into the store.
///
/// An octree descends from the solid's bounds: cubes that lie outside are left, those inside become uniform leaves
/// (which cost no bytes), and only those on the surface are divided, down to the voxel. So empty space and solid inside
/// cost little, and no voxel is missed, however thin the solid is.
///
/// error  A voxel's middle is right. With supersampling s the volume of a voxel is known to about 1/s of a layer; the
///        surface lies within half a voxel's diagonal of the true one. First order in the voxel size (Hausdorff), at
///        coverage 0.5; measured by `loam bench pareto source_sampling`.
/// cost   proportional to the surface in voxels, times s^3
#pragma once

#include <glm/mat3x3.hpp>

#include "world/sources/shape.h"
#include "world/store/store.h"

namespace world {

/// The knobs.
struct Sampling {
  double voxel_size_m = 1;  // metres of the source a voxel, > 0
  int supersampling = 1;    // points along each axis of a voxel, 1..16
  /// A voxel is filled where at least this part of its points lies inside, (0, 1]; 0: where the solid may touch it at
  /// all, which misses nothing and takes a few too many.
  double coverage = 0.5;
};
constexpr int kMostSupersampling = 16;

/// world = position + transform * source / voxel_size_m.
struct Placement {
  WorldPoint position;
  glm::dmat3 transform{1.0};  // has an inverse
};

struct SamplingReport {
  uint64_t voxels = 0;   // filled, whether or not they were before
  uint64_t queries = 0;  // boxes and points that the shape was asked about: work that is the same in each run
};

/// Fills the voxels of the solid with `block` (air carves it out); the others stay. `clip` bounds what is filled.
/// Fails where the solid is not bounded after clipping, reaches past the world's border, or covers more than 2^15
/// regions. The result is the same for any number of threads.
Result<SamplingReport> sample_shape(Store& store, const Shape& shape, const Placement& placement,
                                    const Sampling& sampling, BlockId block, const VoxelBox* clip = nullptr);

}  // namespace world
