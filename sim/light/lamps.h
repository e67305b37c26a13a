/// Glowing blocks as lamps of their own: what they send straight to the surfaces of a flux grid, by rays instead of
/// along ordinates, which would show as lobes.
///
/// Faces of one block in one plane are merged to rectangles. A surface gets, from each that looks at it,
///   E = sum over points Q of L cos cos' A / (n |Q - P|^2) V(P, Q),    L = P / (6 pi A)
/// with P its middle and n points evenly on the rectangle.
/// error   that of the midpoint rule: of the order of (extent / distance)^2 / n near a lamp; shadows' edges to half a
/// voxel cost    points * lamps that look at it, rays a surface source  McGuire, Hughes et al. Computer Graphics:
/// Principles and Practice, 3rd edition. 2013, section 14.11 (biradiance)
#pragma once

#include <vector>

#include "sim/light/flux_grid.h"
#include "world/units/quantity.h"

namespace sim {

struct LampLight {
  std::vector<world::Irradiance3> irradiance;  // W/m^2 by number of surface; empty where nothing glows
  std::vector<uint32_t> glowing;               // surfaces whose emission this is, ascending
  size_t lamps = 0;                            // rectangles
};

/// `points` a lamp, at least 1. Where there are more than `most_lamps` rectangles, those that shine most are taken.
LampLight lamps_on_surfaces(const world::Store& store, const FluxGrid& grid, int points, size_t most_lamps = 64);

}  // namespace sim
