/// The four sides of a voxel, in the order round the vertical: where what moves by its weight goes.
#pragma once

#include "world/space/coords.h"

namespace sim {

inline constexpr int kSides = 4;
inline constexpr world::VoxelPos kSideStep[kSides] = {{1, 0, 0}, {0, 0, 1}, {-1, 0, 0}, {0, 0, -1}};
inline constexpr world::Face kSideFace[kSides] = {world::kFacePosX, world::kFacePosZ, world::kFaceNegX,
                                                  world::kFaceNegZ};
constexpr int opposite_side(int side) { return side ^ 2; }

}  // namespace sim
