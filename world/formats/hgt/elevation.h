/// Elevation tiles of the Shuttle Radar Topography Mission (SRTM): one degree square, heights in metres.
///
/// A file is n x n big-endian int16, n = 1201 (3 arc seconds) or 3601 (1 arc second); row 0 is north, column 0 west;
/// the first and last rows and columns lie on the degree lines, so posts are 1/(n-1) degree apart. -32768 is a void.
/// The file's name gives the south-west corner: N42E001.hgt.
/// source USGS, SRTM Topography (documentation of version 2.1)
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "world/base/errors.h"

namespace world {

struct Elevation {
  static constexpr int16_t kVoid = -32768;
  int posts = 0;                 // n, on a side
  int south = 0, west = 0;       // degrees: the south-west corner
  std::vector<int16_t> heights;  // [row from north][column from west], m

  int16_t at(int row, int column) const {
    return heights[static_cast<size_t>(row) * static_cast<size_t>(posts) + static_cast<size_t>(column)];
  }
  /// The post nearest to a place; places outside of the tile go to its edge.
  int16_t nearest_post(double latitude, double longitude) const;
  /// Between the four posts around a place; nothing where one of them is void.
  std::optional<double> bilinear(double latitude, double longitude) const;
  /// The look-up of programs that take the tile for n x n cells rather than n x n posts: up to one post off towards
  /// north-east. For comparison with them.
  int16_t cell_post(double latitude, double longitude) const;
};

struct ElevationFacts {
  int min = 0, max = 0;  // m, like all below of posts that are not void
  int64_t sum = 0;
  uint64_t voids = 0, zeros = 0, negative = 0, known = 0;
  double mean() const { return known ? static_cast<double>(sum) / static_cast<double>(known) : 0; }
};

/// `name` is the path or name of the file; its last part says which tile it is.
Result<Elevation> parse_hgt(std::span<const uint8_t> bytes, std::string_view name);
/// The same from a zip archive with one .hgt file inside.
Result<Elevation> parse_hgt_zip(std::span<const uint8_t> bytes, std::string_view name);

ElevationFacts facts_of(const Elevation& elevation);

/// Gives each void a height from its neighbours and returns how many there were: rings of voids from the edge inwards,
/// each post the mean of its known neighbours weighted by 1/distance, then relaxed towards a membrane (Laplace), so
/// that the rings leave no creases. The same result always. Fails where all posts are void.
Result<uint64_t> fill_voids(Elevation& elevation, std::string_view name);

}  // namespace world
