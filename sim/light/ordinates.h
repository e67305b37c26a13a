/// Directions in which flux travels: sets of ordinates with the symmetries of the cube, so that no axis is favoured.
///
///   6                the axes alone: light goes along rows
///   8 n^2            each octant's triangle cut into n^2: T_n, n = 1 .. 8
/// Weights are solid angles and sum to 4 pi; all are positive.
/// error  the irradiance below a uniform hemisphere is `half_range` instead of pi. Whoever turns exitance to radiance
///        divides by half_range, and so no energy is lost or won whatever the set.
/// source Thurgood, Pollard, Becker. The TN Quadrature Set for the Discrete Ordinates Method. J. Heat Transfer 117,
///        1995
#pragma once

#include <array>
#include <vector>

#include "world/base/errors.h"

namespace sim {

/// One direction of an octant, mirrored into it: all components >= 0.
struct Ordinate {
  float along[3];  // cosines with the axes, unit length
  float weight;    // sr
};

struct Ordinates {
  /// By octant: bit a is set where directions go to the negative side of axis a. The axes' directions lie in octants 0
  /// and 7, each once.
  std::array<std::vector<Ordinate>, 8> octants;
  int count = 0;
  double half_range = 0;  // sum of weight * cosine over the side of an axis; the same for all six
};

/// 6, 8, 32, 72, 128, 200, 288, 392 or 512 directions; another number is an error that lists them.
world::Result<Ordinates> ordinates(int count);

}  // namespace sim
