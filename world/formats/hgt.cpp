// SRTM elevation (.hgt, .hgt.zip) -> world, as world/formats/heights/land.h says. The length of a degree is taken at
// the middle latitude of the window, because meridians converge. Height 0 is sea in these files.
#include "world/formats/hgt.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "world/formats/heights/land.h"

namespace world {
namespace {

constexpr uint64_t kMaxFileBytes = uint64_t{1} << 26;

void add_facts(const Elevation& elevation, const ElevationFacts& facts, uint64_t filled, ImportReport& report) {
  report.fact("posts", fmt::format("{0} x {0}", elevation.posts));
  report.fact("south-west corner", fmt::format("{} {}", elevation.south, elevation.west));
  report.fact("min m", std::to_string(facts.min));
  report.fact("max m", std::to_string(facts.max));
  report.fact("mean m", fmt::format("{:.6f}", facts.mean()));
  report.fact("voids", std::to_string(facts.voids));
  report.fact("voids filled", std::to_string(filled));
  report.fact("zeros", std::to_string(facts.zeros));
  report.fact("negative", std::to_string(facts.negative));
}

}  // namespace

DegreeLength degree_length(double latitude) {
  // source NIMA. World Geodetic System 1984, TR8350.2: semi-major axis and flattening; radii of curvature.
  constexpr double kAxis = 6378137.0, kFlattening = 1 / 298.257223563;
  constexpr double kEccentricity2 = kFlattening * (2 - kFlattening);
  constexpr double kRadian = std::numbers::pi / 180;
  const double sine = std::sin(latitude * kRadian), w2 = 1 - kEccentricity2 * sine * sine, w = std::sqrt(w2);
  return {kRadian * kAxis * (1 - kEccentricity2) / (w2 * w), kRadian * kAxis / w * std::cos(latitude * kRadian)};
}

Result<World> world_from_elevation(Elevation elevation, const std::string& name, const ImportOptions& options,
                                   ImportReport& report) {
  const ElevationFacts facts = facts_of(elevation);
  TRY(const uint64_t filled, fill_voids(elevation, name));
  TRY(const ImportOptions::Window window, window_of(elevation.posts, elevation.posts, options, name));
  add_facts(elevation, facts, filled, report);
  if (filled) report.warnings.push_back(fmt::format("{} voids were filled from their neighbours", filled));

  HeightGrid grid;
  grid.columns = grid.rows = elevation.posts;
  grid.heights.assign(elevation.heights.begin(), elevation.heights.end());
  // Spacing of the posts, in metres, at the middle of the window.
  const double degrees_per_post = 1.0 / (elevation.posts - 1);
  grid.latitude = elevation.south + 1 - (window.row + 0.5 * (window.height - 1)) * degrees_per_post;
  const DegreeLength degree = degree_length(grid.latitude);
  grid.spacing_z = degree.north * degrees_per_post;
  grid.spacing_x = std::max(degree.east * degrees_per_post, 1e-3);  // nothing is left of it at the poles
  grid.sea = true;
  grid.beaches = facts.zeros > 0;
  TRY(World world, land_from_heights(grid, window, "hgt", name, options, report));
  world.metadata["elevation.south_west"] = fmt::format("{} {}", elevation.south, elevation.west);
  return world;
}

const Format& hgt_format() {
  static const Format format = {
      .name = "hgt",
      .extensions = {".hgt", ".hgt.zip"},
      .what = "SRTM elevation, 3 or 1 arc seconds",
      .recognizes = nullptr,
      .read = [](const std::filesystem::path& path, const ImportOptions& options,
                 ImportReport& report) -> Result<World> {
        TRY(const std::vector<uint8_t> bytes, read_file(path, kMaxFileBytes));
        const bool zipped = bytes.size() > 4 && bytes[0] == 'P' && bytes[1] == 'K' && bytes[2] == 3 && bytes[3] == 4;
        TRY(Elevation elevation, zipped ? parse_hgt_zip(bytes, path.string()) : parse_hgt(bytes, path.string()));
        return world_from_elevation(std::move(elevation), path.string(), options, report);
      },
      .write = nullptr,
  };
  return format;
}

}  // namespace world
