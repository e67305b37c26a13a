/// Elevation tiles -> world; the mapping is described in hgt.cpp.
#pragma once

#include "world/formats/format.h"
#include "world/formats/hgt/elevation.h"

namespace world {

/// Metres on the WGS 84 ellipsoid along one degree at a latitude in degrees.
struct DegreeLength {
  double north, east;
};
DegreeLength degree_length(double latitude);

/// The world of a tile: voids are filled, counted and reported. `name` is for errors.
Result<World> world_from_elevation(Elevation elevation, const std::string& name, const ImportOptions& options,
                                   ImportReport& report);
const Format& hgt_format();

}  // namespace world
