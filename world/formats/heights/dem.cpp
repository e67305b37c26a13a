// USGS Digital Elevation Model (.dem), ASCII -> world.
//
// Records of 1024 characters: a head (type A), then profiles from south to north (type B), west to east, then at most
// one of accuracies (type C). Profiles of a UTM quadrangle, which is a skewed four-sided figure, begin and end at
// different rows; where a row of the box around it has no post there is no land.
//
//   A    1..40 name   529..534 unit of the ground (1 feet, 2 metres, 3 arc seconds)   535..540 of heights (1 feet, 2
//   metres)
//        547..738 corners, 8 numbers: SW, NW, NE, SE   739..786 least and greatest height   817..852 resolution x, y, z
//        853..864 rows, columns
//   B    1..12 row, column   13..24 posts, 1   25..72 x, y of the first   73..96 height to add   97..144 least,
//   greatest
//        145.. heights, 146 of 6 characters; further records hold 170 each
//
// source USGS. Standards for Digital Elevation Models, part 2: Specifications. 1998
#include "world/formats/heights/dem.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "world/base/file.h"
#include "world/formats/bytes.h"
#include "world/formats/heights/land.h"
#include "world/formats/hgt.h"

namespace world {
namespace {

constexpr size_t kRecord = 1024, kFirstHeights = 146, kHeights = 170, kProfileHead = 144;
constexpr double kFoot = 0.3048;
constexpr int64_t kMostPosts = int64_t{1} << 26;

/// Fields by their character numbers, from 1, as the standard counts them.
class Record {
 public:
  Record(std::span<const uint8_t> bytes, size_t at, std::string_view file)
      : text_(reinterpret_cast<const char*>(bytes.data()) + at, std::min(kRecord, bytes.size() - at)),
        at_(at),
        file_(file) {}

  std::string_view text(size_t first, size_t last) const {
    if (first > text_.size()) return {};
    return trimmed(text_.substr(first - 1, last - first + 1));
  }
  Result<double> number(size_t first, size_t last, const char* what) const {
    std::string word(text(first, last));
    // Fortran's exponents: 0.5D+06.
    std::replace(word.begin(), word.end(), 'D', 'E'), std::replace(word.begin(), word.end(), 'd', 'e');
    const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
    double value = 0;
    const auto [end, bad] = std::from_chars(begin, word.data() + word.size(), value);
    if (bad != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
      return byte_error(file_, at_ + first - 1, fmt::format("expected {}, not \"{}\"", what, printable(word)));
    return value;
  }
  Result<int> whole(size_t first, size_t last, const char* what) const {
    TRY(const double value, number(first, last, what));
    if (value != std::floor(value) || std::abs(value) > 1e9)
      return byte_error(file_, at_ + first - 1, fmt::format("expected {}, not {}", what, value));
    return static_cast<int>(value);
  }

 private:
  static std::string_view trimmed(std::string_view s) {
    const size_t first = s.find_first_not_of(" \n\r"), last = s.find_last_not_of(" \n\r");
    return first == s.npos ? std::string_view() : s.substr(first, last - first + 1);
  }
  static std::string printable(std::string_view s) {
    std::string clean;
    for (const char c : s.substr(0, 32)) clean += c >= 32 && c < 127 ? c : '?';
    return clean;
  }
  std::string_view text_;
  size_t at_;
  std::string_view file_;
};

}  // namespace

Result<DemFile> parse_dem(std::span<const uint8_t> bytes, std::string_view name) {
  if (bytes.size() < kRecord)
    return byte_error(name, bytes.size(), "the file ends inside its first record; expected an ASCII .dem of the USGS");
  DemFile dem;
  const Record head(bytes, 0, name);
  dem.name = std::string(head.text(1, 140));
  for (char& c : dem.name) c = c >= 32 && c < 127 ? c : '?';
  TRY(dem.ground_unit, head.whole(529, 534, "the unit of the ground (1, 2 or 3)"));
  TRY(dem.height_unit, head.whole(535, 540, "the unit of heights (1 or 2)"));
  if (dem.ground_unit < 1 || dem.ground_unit > 3 || dem.height_unit < 1 || dem.height_unit > 2)
    return byte_error(name, 528, "the units must be 1 (feet), 2 (metres) or 3 (arc seconds, of the ground only)");
  for (size_t i = 0; i < 8; ++i) {
    TRY(dem.corners[i], head.number(547 + 24 * i, 570 + 24 * i, "a coordinate of a corner"));
  }
  TRY(dem.least, head.number(739, 762, "the least height"));
  TRY(dem.greatest, head.number(763, 786, "the greatest height"));
  for (size_t i = 0; i < 3; ++i) {
    TRY(dem.resolution[i], head.number(817 + 12 * i, 828 + 12 * i, "a resolution"));
    if (!(dem.resolution[i] > 0)) return byte_error(name, 816 + 12 * i, "a resolution must be above 0");
  }
  TRY(dem.columns, head.whole(859, 864, "the number of profiles"));
  if (dem.columns < 1 || static_cast<uint64_t>(dem.columns) > bytes.size() / kRecord)
    return byte_error(name, 858, fmt::format("the file can't hold {} profiles", dem.columns));

  size_t at = kRecord;
  for (int column = 0; column < dem.columns; ++column) {
    const auto cut = [&] {
      return byte_error(
          name, bytes.size(),
          fmt::format("the file ends inside profile {} of {}; it is damaged or cut off", column + 1, dem.columns));
    };
    if (bytes.size() - at < kProfileHead) return cut();
    Record record(bytes, at, name);
    DemFile::Profile profile;
    TRY(const int posts, record.whole(13, 18, "the number of posts of a profile"));
    TRY(profile.x, record.number(25, 48, "the x of a profile"));
    TRY(profile.y, record.number(49, 72, "the y of a profile"));
    TRY(const double datum, record.number(73, 96, "the height to add"));
    if (posts < 1 || static_cast<uint64_t>(posts) > (bytes.size() - at) / 6)
      return byte_error(name, at + 12, fmt::format("the file can't hold a profile of {} posts", posts));
    for (int i = 0; i < posts; ++i) {
      const size_t index = static_cast<size_t>(i);
      size_t field = kProfileHead + 6 * index;
      if (index >= kFirstHeights) {
        const size_t in_record = (index - kFirstHeights) % kHeights;
        if (in_record == 0) {
          at += kRecord;
          if (at >= bytes.size()) return cut();
          record = Record(bytes, at, name);
        }
        field = 6 * in_record;
      }
      TRY(const int value, record.whole(field + 1, field + 6, "a height"));
      profile.raw.push_back(value);
      // -32767 and below mark a missing post.
      profile.heights.push_back(value <= -32767 ? std::nan("") : datum + value * dem.resolution[2]);
    }
    at += kRecord;
    dem.profiles.push_back(std::move(profile));
    if (at > bytes.size() && column + 1 < dem.columns) return cut();
  }
  dem.leftover = bytes.size() > at ? bytes.size() - at : 0;
  return dem;
}

Result<World> world_from_dem(const DemFile& dem, const std::string& name, const ImportOptions& options,
                             ImportReport& report) {
  // The grid of posts around all profiles.
  double west = dem.profiles[0].x, east = west, south = dem.profiles[0].y, north = south;
  for (const DemFile::Profile& p : dem.profiles) {
    west = std::min(west, p.x), east = std::max(east, p.x);
    south = std::min(south, p.y);
    north = std::max(north, p.y + static_cast<double>(p.heights.size() - 1) * dem.resolution[1]);
  }
  const double columns = std::round((east - west) / dem.resolution[0]) + 1,
               rows = std::round((north - south) / dem.resolution[1]) + 1;
  uint64_t known = 0;
  for (const DemFile::Profile& p : dem.profiles) known += p.heights.size();
  // A skewed quadrangle fills most of its box; a small part of it is damage.
  if (!(columns * rows <= static_cast<double>(kMostPosts)) || columns * rows > 4.0 * static_cast<double>(known) + 1e6)
    return input_error(
        fmt::format("{}: its {} posts are spread over {:.0f} x {:.0f}; that is damaged", name, known, columns, rows));
  HeightGrid grid;
  grid.columns = static_cast<int>(columns), grid.rows = static_cast<int>(rows);
  grid.heights.assign(static_cast<size_t>(grid.columns) * static_cast<size_t>(grid.rows), std::nan(""));
  const double metres = dem.height_unit == 1 ? kFoot : 1;
  for (const DemFile::Profile& p : dem.profiles) {
    const auto column = static_cast<size_t>(std::round((p.x - west) / dem.resolution[0]));
    const auto first = static_cast<int64_t>(std::round((p.y - south) / dem.resolution[1]));
    for (size_t i = 0; i < p.heights.size(); ++i) {
      const int64_t row = grid.rows - 1 - (first + static_cast<int64_t>(i));
      if (row >= 0)
        grid.heights[static_cast<size_t>(row) * static_cast<size_t>(grid.columns) + column] = p.heights[i] * metres;
    }
  }
  if (dem.ground_unit == 3) {
    const double latitude = std::clamp(0.5 * (south + north) / 3600, -90.0, 90.0);
    const DegreeLength degree = degree_length(latitude);
    grid.latitude = latitude;
    grid.spacing_x = std::max(degree.east * dem.resolution[0] / 3600, 1e-3);
    grid.spacing_z = degree.north * dem.resolution[1] / 3600;
  } else {
    const double unit = dem.ground_unit == 1 ? kFoot : 1;
    grid.spacing_x = dem.resolution[0] * unit, grid.spacing_z = dem.resolution[1] * unit;
    // UTM: y is the distance from the equator along the meridian, some 111 km a degree.
    grid.latitude = std::clamp(0.5 * (south + north) * unit / 111000, 0.0, 84.0);
  }
  TRY(const ImportOptions::Window window, window_of(grid.columns, grid.rows, options, name));
  report.fact("name", dem.name);
  report.fact("profiles", std::to_string(dem.profiles.size()));
  add_height_facts(grid, report);
  TRY(World world, land_from_heights(grid, window, "dem", name, options, report));
  world.metadata["elevation.name"] = dem.name;
  return world;
}

}  // namespace world
