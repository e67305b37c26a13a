/// Voxels of liquids that let no light through and end within their voxel (render/liquid_levels.h): what stands of them
/// beside the faces of cubes. The cubes are extracted from masks without them; each then has its own top, sides and
/// bottom. A world without any has no such masks.
#pragma once

#include <span>

#include "render/extract/greedy.h"
#include "render/liquid_levels.h"
#include "render/see_through.h"

namespace render {

/// Adds copies of all regions to a volume.
void copy_regions(const world::MaskVolume& from, world::MaskVolume& to);

class LiquidParts {
 public:
  /// Takes them out of copies of the masks. see_through: blocks that are drawn elsewhere; null: none is.
  void rebuild(const world::WorldView& view, const LiquidLevels* levels, const SeeThroughKinds* see_through,
               const world::MaskVolume& occupied, const world::MaskVolume& opaque);
  /// Follows leaves whose blocks or levels changed. False: the first ones came, and all must be made anew.
  bool update(const world::WorldView& view, std::span<const world::LeafPos> dirty, const world::MaskVolume& occupied,
              const world::MaskVolume& opaque);
  /// Of leaves whose levels changed those in which such a voxel is or was.
  std::vector<world::LeafPos> concerned(const world::WorldView& view, std::span<const world::LeafPos> moved) const;

  bool any() const { return any_; }
  /// The masks without them, where there are any.
  const world::MaskVolume& occupied() const { return occupied_; }
  const world::MaskVolume& opaque() const { return opaque_; }
  bool in_chunk(const world::WorldView& view, ChunkPos chunk) const;
  /// Adds their faces to those of a chunk's cubes.
  void add_faces(const world::WorldView& view, ChunkPos chunk, bool merge_faces, ChunkRecords& out) const;
  size_t bytes() const { return any_ ? occupied_.bytes() + opaque_.bytes() : 0; }

 private:
  bool is_part(const world::BlockPalette& palette, world::BlockId block) const;
  world::LeafMask mask_of(const world::WorldView& view, world::LeafPos l) const;
  void cut(world::LeafPos l, const world::LeafMask& parts, const world::MaskVolume& occupied,
           const world::MaskVolume& opaque);

  const LiquidLevels* levels_ = nullptr;
  const SeeThroughKinds* see_through_ = nullptr;
  bool any_ = false;
  world::MaskVolume occupied_, opaque_, parts_;
};

}  // namespace render
