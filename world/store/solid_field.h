/// A surface field without gaps, as meshers want it: a finite value at the middle of each voxel, below or at 0 inside.
///
/// Where the field has no value the blocks say which side it is, and where a block contradicts it (somebody dug or
/// built there) the block wins: the rules of contours.h, so that meshes and contours show one surface.
///
/// A cell lies between the middles of eight voxels; that of voxel v reaches from v to v + (1, 1, 1). A leaf has 8^3
/// cells, for which it reads 9^3 values: neighbours read the same numbers where they meet.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include <glm/vec3.hpp>

#include "world/space/world_point.h"
#include "world/store/contours.h"
#include "world/store/store.h"

namespace world {

/// Triangles, counter-clockwise seen from outside; in voxels, of which (0, 0, 0) reaches from 0 to 1.
struct VoxelMesh {
  std::vector<Vec3d> vertices;
  std::vector<glm::uvec3> triangles;
};

/// Both must outlive it. Reading is free for any number of threads.
class SolidField {
 public:
  static constexpr int kAlong = kLeafSize + 1, kSamples = kAlong * kAlong * kAlong;
  using Values = std::array<float, kSamples>;  // by (x * 9 + y) * 9 + z

  /// Without blocks, all is outside where the field has no value.
  SolidField(const SurfaceField& field, const MaskVolume* blocks);

  /// The values from the leaf's lowest voxel on. True where the surface passes between any of them.
  bool read(LeafPos leaf, Values& values) const;
  /// All leaves with a cell that the surface passes, and any others; sorted.
  std::vector<LeafPos> leaves() const;
  float beyond() const { return field_->beyond(); }

 private:
  const SurfaceField* field_;
  const MaskVolume* blocks_;
};

/// The field of a store: its level set, else its density at `iso`, which is above 0; null where it has neither.
std::unique_ptr<SurfaceField> surface_field(const Store& store, float iso);

/// The leaves with a cell that the surface passes, sorted, and their values; read on all threads.
std::vector<LeafPos> crossed_leaves(const SolidField& field, std::vector<SolidField::Values>& values);

}  // namespace world
