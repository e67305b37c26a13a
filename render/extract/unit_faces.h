/// Faces of single voxels, and parts of them, merged to records: for what the bit planes of greedy.h can't say, faces
/// that tell what lies beyond them and those that end at a liquid's level.
#pragma once

#include <vector>

#include "render/extract/greedy.h"
#include "world/base/function_ref.h"

namespace render {

/// One unit face, by its voxel in the chunk, or the part of a side from `bottom` to `top` sixteenths of its height; a
/// top (+Y) lies at `top`.
struct UnitFace {
  uint32_t key;                   // faces of unlike keys are never one; not 0
  uint8_t face, plane, row, bit;  // in the order of kPlaneAxes
  uint8_t bottom = 0, top = 16;
  bool again = false;  // another face of the same voxel and direction: of two parts, the upper one

  bool is_part() const { return bottom != 0 || top != 16; }
};

/// Rectangles of equal keys and parts, or with merge_faces off a record a face, in the place of what `out` held.
/// `name(key, upper)`: the bits of word 1 beside the direction, with the upper end of a part, 16 as 0. Sorts the units.
void merge_units(std::vector<UnitFace>& units, bool merge_faces, world::FunctionRef<uint32_t(uint32_t, uint32_t)> name,
                 ChunkRecords& out);

}  // namespace render
