// SRTM elevation (.hgt, .hgt.zip) -> world.
//
// Voxel x goes east, z south, y up; the origin is the north-west corner of the window at sea level. All three
// directions have the same metres per voxel, so the land has its true shape: by default the north-south spacing of the
// posts, at which each row of voxels is a row of posts, and columns are resampled (bilinear), because meridians
// converge. The length of a degree is taken at the middle latitude of the window. A voxel is ground where its bottom
// lies below the land: y < height * vertical_scale / metres_per_voxel. Height 0 is sea in these files, and negative
// heights near it are noise of the radar: where height <= 0, the ground ends at least one voxel deeper and water fills
// up to y = -1. The inside is solid stone (tiles of 8^3, which cost nothing), down to at least depth_voxels below the
// lowest ground; the floor is rounded down to a multiple of 8 for that reason.
//
// What lies on top follows height, slope and latitude; a rough picture of what grows there in late spring, not data:
//   steep                 granite, stone           slope above 1.1 / 0.85
//   sea floor, beach      sand                     beach: up to 4 m and nearly flat, in tiles that hold sea
//   above the snow line   snow                     at 4500 m - 50 m per degree of latitude (2400 m in the Pyrenees,
//                                                  2200 m in the Alps), +- 150 m
//   up to 300 m below     scree, dry_grass
//   up to 700 m below     dry_grass, grass         alpine meadows
//   up to 1700 m below    pine_needles, grass      woods, seen from above, with clearings
//   else                  grass, pine_needles      fields and woods
#include "world/formats/hgt.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "world/base/jobs.h"
#include "world/base/random.h"

namespace world {
namespace {

constexpr uint64_t kMaxFileBytes = uint64_t{1} << 26;
constexpr uint64_t kMaxColumns = uint64_t{1} << 26;  // some 2 GiB of surface
constexpr int kMaxVoxelsHigh = 1 << 16;

/// The blocks of the surface, by name where the standard blocks have it, else the nearest thing.
struct Ground {
  BlockId stone, granite, scree, gravel, dirt, grass, dry_grass, woods, sand, snow, water;

  static BlockId find(const BlockPalette& palette, std::initializer_list<const char*> names) {
    for (const char* name : names) {
      if (const auto id = palette.find(name)) return *id;
    }
    return 1;
  }
  explicit Ground(const BlockPalette& palette)
      : stone(find(palette, {"stone", "limestone"})),
        granite(find(palette, {"granite", "stone"})),
        scree(find(palette, {"scree", "gravel", "stone"})),
        gravel(find(palette, {"gravel", "stone"})),
        dirt(find(palette, {"dirt", "stone"})),
        grass(find(palette, {"grass", "dirt"})),
        dry_grass(find(palette, {"dry_grass", "grass"})),
        woods(find(palette, {"pine_needles", "moss", "grass"})),
        sand(find(palette, {"sand", "gravel"})),
        snow(find(palette, {"snow", "fresh_snow"})),
        water(find(palette, {"water"})) {}
};

/// Smooth noise in [-1, 1], one bump every `size` units.
double patches(double x, double z, double size, uint64_t stream) {
  x /= size, z /= size;
  const double fx = std::floor(x), fz = std::floor(z);
  const auto corner = [&](int dx, int dz) {
    return 2 * uniform01_double(random_bits(stream, static_cast<int64_t>(fx) + dx, 0, static_cast<int64_t>(fz) + dz)) -
           1;
  };
  const auto ease = [](double t) { return t * t * (3 - 2 * t); };
  const double u = ease(x - fx), v = ease(z - fz);
  return (corner(0, 0) * (1 - u) + corner(1, 0) * u) * (1 - v) + (corner(0, 1) * (1 - u) + corner(1, 1) * u) * v;
}

/// The part of the tile that becomes world, and how voxels lie over its posts.
struct Plan {
  const Elevation* elevation = nullptr;
  ImportOptions::Window window;
  double metres = 0;  // per voxel
  double vertical_scale = 1;
  double posts_per_voxel_x = 1, posts_per_voxel_z = 1;
  int64_t size_x = 0, size_z = 0;  // voxels
  int floor = 0, top = 0;          // y of the lowest and highest ground voxel
  double snow_line = 0;            // m
  bool has_sea = false;            // the tile holds heights of 0

  /// Metres above the sea at the middle of a column; columns outside repeat the edge.
  double height(int64_t x, int64_t z) const {
    const double column = std::clamp(static_cast<double>(x) * posts_per_voxel_x, 0.0, double(window.width - 1));
    const double row = std::clamp(static_cast<double>(z) * posts_per_voxel_z, 0.0, double(window.height - 1));
    const int c = std::min(static_cast<int>(column), std::max(window.width - 2, 0));
    const int r = std::min(static_cast<int>(row), std::max(window.height - 2, 0));
    const double u = column - c, v = row - r;
    const auto post = [&](int dr, int dc) -> double {
      return elevation->at(window.row + std::min(r + dr, window.height - 1),
                           window.column + std::min(c + dc, window.width - 1));
    };
    return (post(0, 0) * (1 - u) + post(0, 1) * u) * (1 - v) + (post(1, 0) * (1 - u) + post(1, 1) * u) * v;
  }
  /// The highest ground voxel of a column.
  int ground(double height_m) const {
    const int y = static_cast<int>(std::ceil(height_m * vertical_scale / metres)) - 1;
    return height_m <= 0 ? std::min(y, -2) : y;
  }
};

/// One column: ground up to `ground`, of which the top voxel is `surface` and the next ones `soil`; then water.
struct Column {
  int ground = 0;
  BlockId surface = 0, soil = 0;
  bool sea = false;
};

Column make_column(const Plan& plan, const Ground& blocks, int64_t x, int64_t z, double h, double slope) {
  const double east = static_cast<double>(x) * plan.metres, south = static_cast<double>(z) * plan.metres;
  // Patches of some metres, but never so small that voxels alternate.
  const auto noise = [&](double metres, uint64_t stream) {
    return patches(east, south, std::max(metres, 6 * plan.metres), stream);
  };
  const double below_snow = plan.snow_line - (h + 110 * noise(1500, 1) + 40 * noise(300, 2));
  const double woods = noise(900, 3) + 0.5 * noise(200, 4);
  BlockId surface, soil = blocks.dirt;
  if (h <= 0 || (plan.has_sea && h < 4 && slope < 0.05)) {
    surface = soil = blocks.sand;
  } else if (slope > 1.1) {
    surface = soil = blocks.granite;
  } else if (below_snow < 0) {
    surface = blocks.snow, soil = blocks.stone;
  } else if (slope > 0.85) {
    surface = soil = blocks.stone;
  } else if (below_snow < 300) {
    const bool bare = slope > 0.3 || below_snow < 120;
    surface = bare ? blocks.scree : blocks.dry_grass;
    soil = bare ? blocks.gravel : blocks.dirt;
  } else if (below_snow < 700) {
    surface = woods > 0.1 ? blocks.grass : blocks.dry_grass;
  } else if (below_snow < 1700) {
    surface = woods > -0.5 ? blocks.woods : blocks.grass;
  } else {
    surface = woods > 0.3 ? blocks.woods : woods < -0.7 ? blocks.dry_grass : blocks.grass;
  }
  return {.ground = plan.ground(h), .surface = surface, .soil = soil, .sea = h <= 0};
}

/// All regions of one 128 x 128 square of columns.
std::vector<RegionBuilder> build_square(const Plan& plan, const Ground& blocks, int region_x, int region_z) {
  constexpr int kHalo = kRegionSize + 2;
  const int64_t x0 = int64_t{region_x} * kRegionSize, z0 = int64_t{region_z} * kRegionSize;
  std::vector<float> heights(kHalo * kHalo);
  const auto height = [&](int x, int z) -> float& { return heights[static_cast<size_t>((x + 1) * kHalo + z + 1)]; };
  for (int x = -1; x <= kRegionSize; ++x) {
    for (int z = -1; z <= kRegionSize; ++z) height(x, z) = static_cast<float>(plan.height(x0 + x, z0 + z));
  }
  // The columns; those outside of the window are empty (ground below the floor).
  std::vector<Column> columns(kRegionSize * kRegionSize, Column{.ground = plan.floor - 1});
  int highest = plan.floor;
  for (int x = 0; x < kRegionSize; ++x) {
    for (int z = 0; z < kRegionSize; ++z) {
      if (x0 + x >= plan.size_x || z0 + z >= plan.size_z) continue;
      const double east = (height(x + 1, z) - height(x - 1, z)) / (2 * plan.metres);
      const double south = (height(x, z + 1) - height(x, z - 1)) / (2 * plan.metres);
      Column& column = columns[static_cast<size_t>(x * kRegionSize + z)];
      column = make_column(plan, blocks, x0 + x, z0 + z, height(x, z), std::sqrt(east * east + south * south));
      highest = std::max({highest, column.ground, column.sea ? -1 : column.ground});
    }
  }
  const int soil_depth = std::clamp(static_cast<int>(std::lround(3 / plan.metres)), 0, 8);
  std::vector<RegionBuilder> built;
  for (int ry = plan.floor >> kRegionLog2; ry <= highest >> kRegionLog2; ++ry) {
    RegionBuilder region({region_x, ry, region_z});
    for (int leaf = 0; leaf < kLeavesPerRegion; ++leaf) {
      const LeafPos l = leaf_offset_in_region(leaf);
      const int y0 = ry * kRegionSize + l.y * kLeafSize;
      int lowest_ground = INT32_MAX, highest_any = INT32_MIN;
      for (int x = l.x * kLeafSize; x < (l.x + 1) * kLeafSize; ++x) {
        for (int z = l.z * kLeafSize; z < (l.z + 1) * kLeafSize; ++z) {
          const Column& column = columns[static_cast<size_t>(x * kRegionSize + z)];
          lowest_ground = std::min(lowest_ground, column.ground);
          highest_any = std::max(highest_any, column.sea ? -1 : column.ground);
        }
      }
      if (highest_any < y0 || y0 + kLeafSize <= plan.floor) continue;  // air
      if (lowest_ground - soil_depth - 1 >= y0 + kLeafSize - 1) {
        region.set_uniform(leaf, blocks.stone);
        continue;
      }
      BlockId values[kLeafVoxels] = {};
      for (int index = 0; index < kLeafVoxels; ++index) {
        const VoxelPos v = offset_in_leaf(index);
        const Column& column =
            columns[static_cast<size_t>((l.x * kLeafSize + v.x) * kRegionSize + l.z * kLeafSize + v.z)];
        const int y = y0 + v.y;
        if (column.ground < plan.floor) continue;
        if (y > column.ground) {
          values[index] = column.sea && y < 0 ? blocks.water : kAir;
        } else {
          values[index] = y == column.ground                ? column.surface
                          : y >= column.ground - soil_depth ? column.soil
                                                            : blocks.stone;
        }
      }
      region.set_leaf(leaf, values);
    }
    built.push_back(std::move(region));
  }
  return built;
}

Result<Plan> make_plan(const Elevation& elevation, const std::string& name, const ImportOptions& options) {
  Plan plan;
  plan.elevation = &elevation;
  plan.window = options.window;
  ImportOptions::Window& w = plan.window;
  const int n = elevation.posts;
  if (w.width == 0 && w.column >= 0) w.width = n - w.column;
  if (w.height == 0 && w.row >= 0) w.height = n - w.row;
  if (w.column < 0 || w.row < 0 || w.width < 1 || w.height < 1 || w.column > n - w.width || w.row > n - w.height) {
    return usage_error(fmt::format(
        "{}: the window {} {} {} {} (column, row, width, height) does not lie within the {} x {} posts of the tile",
        name, options.window.column, options.window.row, options.window.width, options.window.height, n, n));
  }
  if (!(options.vertical_scale > 0) || !std::isfinite(options.vertical_scale) || options.depth_voxels < 1 ||
      !(options.metres_per_voxel >= 0) || !std::isfinite(options.metres_per_voxel)) {
    return usage_error(fmt::format("{}: metres per voxel, vertical scale and depth must be above 0", name));
  }
  // Spacing of the posts, in metres, at the middle of the window.
  const double degrees_per_post = 1.0 / (n - 1);
  const double latitude = elevation.south + 1 - (w.row + 0.5 * (w.height - 1)) * degrees_per_post;
  const DegreeLength degree = degree_length(latitude);
  const double spacing_z = degree.north * degrees_per_post;
  const double spacing_x = std::max(degree.east * degrees_per_post, 1e-3);  // nothing is left of it at the poles
  plan.metres = options.metres_per_voxel > 0 ? options.metres_per_voxel : spacing_z;
  plan.vertical_scale = options.vertical_scale;
  plan.posts_per_voxel_x = plan.metres / spacing_x;
  plan.posts_per_voxel_z = plan.metres / spacing_z;
  const double size_x = std::floor((w.width - 1) / plan.posts_per_voxel_x + 1e-9) + 1;
  const double size_z = std::floor((w.height - 1) / plan.posts_per_voxel_z + 1e-9) + 1;
  if (size_x * size_z > static_cast<double>(kMaxColumns)) {
    return usage_error(
        fmt::format("{}: {:.0f} x {:.0f} columns of voxels are too many (at most {} in all); choose more metres per "
                    "voxel or a smaller window",
                    name, size_x, size_z, kMaxColumns));
  }
  plan.size_x = static_cast<int64_t>(size_x);
  plan.size_z = static_cast<int64_t>(size_z);
  plan.snow_line = std::clamp(4500 - 50 * std::abs(latitude), 300.0, 4500.0);

  double lowest = INT32_MAX, highest = INT32_MIN;
  for (int row = w.row; row < w.row + w.height; ++row) {
    for (int column = w.column; column < w.column + w.width; ++column) {
      lowest = std::min<double>(lowest, elevation.at(row, column));
      highest = std::max<double>(highest, elevation.at(row, column));
    }
  }
  if (std::max(std::abs(lowest), std::abs(highest)) * plan.vertical_scale / plan.metres > kMaxVoxelsHigh) {
    return usage_error(fmt::format(
        "{}: the land would be more than {} voxels high; choose more metres per voxel or a smaller vertical scale",
        name, kMaxVoxelsHigh));
  }
  plan.top = plan.ground(highest);
  plan.floor = (plan.ground(lowest) - options.depth_voxels + 1) & ~(kLeafSize - 1);
  return plan;
}

void add_facts(const Elevation& elevation, const ElevationFacts& facts, uint64_t filled, const Plan& plan,
               ImportReport& report) {
  const auto fact = [&](const char* name, const std::string& value) { report.facts.emplace_back(name, value); };
  fact("posts", fmt::format("{0} x {0}", elevation.posts));
  fact("south-west corner", fmt::format("{} {}", elevation.south, elevation.west));
  fact("min m", std::to_string(facts.min));
  fact("max m", std::to_string(facts.max));
  fact("mean m", fmt::format("{:.6f}", facts.mean()));
  fact("voids", std::to_string(facts.voids));
  fact("voids filled", std::to_string(filled));
  fact("zeros", std::to_string(facts.zeros));
  fact("negative", std::to_string(facts.negative));
  fact("window",
       fmt::format("{} {} {} {}", plan.window.column, plan.window.row, plan.window.width, plan.window.height));
  fact("metres per voxel", fmt::format("{:.6g}", plan.metres));
  fact("columns", fmt::format("{} x {}", plan.size_x, plan.size_z));
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
  TRY(Plan plan, make_plan(elevation, name, options));
  plan.has_sea = facts.zeros > 0;
  add_facts(elevation, facts, filled, plan, report);
  if (filled) report.warnings.push_back(fmt::format("{} voids were filled from their neighbours", filled));

  World world(standard_blocks());
  const Ground blocks(*world.palette);
  const auto regions = [](int64_t voxels) { return static_cast<size_t>((voxels + kRegionSize - 1) >> kRegionLog2); };
  const size_t wide = regions(plan.size_x), deep = regions(plan.size_z);
  // Rows of squares in parallel; each is adopted before the next, so only one row is held twice.
  for (size_t rx = 0; rx < wide; ++rx) {
    std::vector<std::vector<RegionBuilder>> row(deep);
    parallel_for(deep,
                 [&](size_t rz) { row[rz] = build_square(plan, blocks, static_cast<int>(rx), static_cast<int>(rz)); });
    for (std::vector<RegionBuilder>& square : row) {
      for (RegionBuilder& region : square) world.store.adopt(std::move(region));
    }
  }
  world.metadata["format"] = "hgt";
  world.metadata["voxel_size_m"] = fmt::format("{:.9g}", plan.metres);
  world.metadata["elevation.south_west"] = fmt::format("{} {}", elevation.south, elevation.west);
  world.metadata["elevation.window"] =
      fmt::format("{} {} {} {}", plan.window.column, plan.window.row, plan.window.width, plan.window.height);
  world.metadata["elevation.vertical_scale"] = fmt::format("{:g}", plan.vertical_scale);
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
        TRY(World world, world_from_elevation(std::move(elevation), path.string(), options, report));
        world.metadata["source"] = path.filename().string();
        return world;
      },
      .write = nullptr,
  };
  return format;
}

}  // namespace world
