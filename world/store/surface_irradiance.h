/// What arrives on the faces of a box of the world, in W/m^2: what sim/light's flux writes and render/ reads.
///
/// A face belongs to the clear voxel before it: (voxel, face), with the wall across the face.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "world/store/leaf_mask.h"
#include "world/units/quantity.h"

namespace world {

class SurfaceIrradiance {
 public:
  struct Leaf {
    std::array<LeafMask, kFaces> wall;                    // clear voxels whose neighbour across the face stops light
    std::array<std::array<uint32_t, 8>, kFaces> first{};  // place in `values` of the first face of wall[face].word[x]
  };
  LeafPos low{0, 0, 0};             // corner of the box
  std::array<int32_t, 3> size{};    // leaves along each axis
  std::vector<Leaf> leaves;         // by (x * size[1] + y) * size[2] + z
  std::vector<Irradiance3> values;  // by leaf, face, voxel

  /// Null where no wall is, and outside of the box.
  const Irradiance3* find(VoxelPos clear, int face) const {
    const LeafPos l = leaf_from_voxel(clear);
    size_t place = 0;
    for (int a = 0; a < 3; ++a) {
      const int32_t from_corner = l[a] - low[a];
      if (from_corner < 0 || from_corner >= size[a]) return nullptr;
      place = place * static_cast<size_t>(size[a]) + static_cast<size_t>(from_corner);
    }
    const Leaf& leaf = leaves[place];
    const int index = index_in_leaf(clear);
    if (!leaf.wall[face].test(index)) return nullptr;
    const uint64_t below = leaf.wall[face].word[index >> 6] & ((1ull << (index & 63)) - 1);
    return &values[leaf.first[face][index >> 6] + static_cast<uint32_t>(std::popcount(below))];
  }
  size_t bytes() const { return leaves.capacity() * sizeof(Leaf) + values.capacity() * sizeof(Irradiance3); }
};

}  // namespace world
