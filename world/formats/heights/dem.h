/// USGS Digital Elevation Models; the format is described in dem.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "world/formats/format.h"

namespace world {

struct DemFile {
  struct Profile {
    double x = 0, y = 0;          // of its southernmost post, in the unit of the ground
    std::vector<int> raw;         // from south to north, as in the file
    std::vector<double> heights;  // in the unit of heights; NaN where missing
  };
  std::string name;
  int ground_unit = 2, height_unit = 2;  // 1 feet, 2 metres, 3 arc seconds
  std::array<double, 8> corners{};       // x, y of SW, NW, NE, SE
  double least = 0, greatest = 0;        // as the head says
  std::array<double, 3> resolution{};    // x, y, z
  int columns = 0;                       // profiles
  std::vector<Profile> profiles;
  uint64_t leftover = 0;  // bytes after the last profile
};

Result<DemFile> parse_dem(std::span<const uint8_t> bytes, std::string_view name);
Result<World> world_from_dem(const DemFile& dem, const std::string& name, const ImportOptions& options,
                             ImportReport& report);

}  // namespace world
