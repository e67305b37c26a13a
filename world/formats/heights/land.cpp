#include "world/formats/heights/land.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "world/base/jobs.h"
#include "world/base/random.h"

namespace world {
namespace {

constexpr uint64_t kMaxColumns = uint64_t{1} << 26;  // some 2 GiB of surface
// A region takes 34 kB before it holds anything: squares of 128 x 128 columns beyond the first hold so many on average.
constexpr double kMostThinSquares = 256, kLeastColumns = 1024;
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
  const HeightGrid* grid = nullptr;
  ImportOptions::Window window;
  double metres = 0;  // per voxel
  double vertical_scale = 1;
  double posts_per_voxel_x = 1, posts_per_voxel_z = 1;
  int64_t size_x = 0, size_z = 0;  // voxels
  int floor = 0;                   // y of the lowest ground voxel
  double snow_line = 0;            // m

  /// Metres above the sea at the middle of a column; columns outside repeat the edge.
  double height(int64_t x, int64_t z) const {
    const double column = std::clamp(static_cast<double>(x) * posts_per_voxel_x, 0.0, double(window.width - 1));
    const double row = std::clamp(static_cast<double>(z) * posts_per_voxel_z, 0.0, double(window.height - 1));
    const int c = std::min(static_cast<int>(column), std::max(window.width - 2, 0));
    const int r = std::min(static_cast<int>(row), std::max(window.height - 2, 0));
    const double u = column - c, v = row - r;
    const auto post = [&](int dr, int dc) {
      return grid->at(window.row + std::min(r + dr, window.height - 1),
                      window.column + std::min(c + dc, window.width - 1));
    };
    // A missing post counts only where it weighs anything.
    const auto mix = [](double a, double b, double t) { return t == 0 ? a : t == 1 ? b : a * (1 - t) + b * t; };
    return mix(mix(post(0, 0), post(0, 1), u), v == 0 ? 0 : mix(post(1, 0), post(1, 1), u), v);
  }
  /// The highest ground voxel of a column.
  int ground(double height_m) const {
    // Heights that came from voxels are whole numbers of them, but for rounding.
    const int y = static_cast<int>(std::ceil(height_m * vertical_scale / metres - 1e-7)) - 1;
    return grid->sea && height_m <= 0 ? std::min(y, -2) : y;
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
  const bool sea = plan.grid->sea && h <= 0;
  if (sea || (plan.grid->beaches && h < 4 && slope < 0.05)) {
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
  return {.ground = plan.ground(h), .surface = surface, .soil = soil, .sea = sea};
}

/// All regions of one 128 x 128 square of columns.
std::vector<RegionBuilder> build_square(const Plan& plan, const Ground& blocks, int region_x, int region_z) {
  constexpr int kHalo = kRegionSize + 2;
  const int64_t x0 = int64_t{region_x} * kRegionSize, z0 = int64_t{region_z} * kRegionSize;
  // What of the square lies in the window: strips of posts are mostly none of theirs.
  const int wide = static_cast<int>(std::min<int64_t>(plan.size_x - x0, kRegionSize)),
            deep = static_cast<int>(std::min<int64_t>(plan.size_z - z0, kRegionSize));
  std::vector<double> heights(kHalo * kHalo);
  const auto height = [&](int x, int z) -> double& { return heights[static_cast<size_t>((x + 1) * kHalo + z + 1)]; };
  for (int x = -1; x <= wide; ++x) {
    for (int z = -1; z <= deep; ++z) height(x, z) = plan.height(x0 + x, z0 + z);
  }
  // The columns; those outside of the window are empty (ground below the floor).
  std::vector<Column> columns(kRegionSize * kRegionSize, Column{.ground = plan.floor - 1});
  int highest = plan.floor;
  for (int x = 0; x < wide; ++x) {
    for (int z = 0; z < deep; ++z) {
      if (std::isnan(height(x, z))) continue;
      const auto slope = [&](double before, double after) {
        return std::isnan(before) || std::isnan(after) ? 0.0 : (after - before) / (2 * plan.metres);
      };
      const double east = slope(height(x - 1, z), height(x + 1, z)), south = slope(height(x, z - 1), height(x, z + 1));
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
      if (l.x * kLeafSize >= wide || l.z * kLeafSize >= deep) continue;
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

Result<Plan> make_plan(const HeightGrid& grid, const ImportOptions::Window& window, const std::string& name,
                       const ImportOptions& options) {
  Plan plan;
  plan.grid = &grid;
  plan.window = window;
  if (!(options.vertical_scale > 0) || !std::isfinite(options.vertical_scale) || options.depth_voxels < 1 ||
      !(options.metres_per_voxel >= 0) || !std::isfinite(options.metres_per_voxel)) {
    return usage_error(fmt::format("{}: metres per voxel, vertical scale and depth must be above 0", name));
  }
  // What the user asked for is the user's mistake; what the file says is the file's.
  const auto refused = [&](const std::string& what) {
    const bool asked = options.metres_per_voxel > 0 || options.vertical_scale != 1;
    return asked ? usage_error(what) : input_error(what);
  };
  plan.metres = options.metres_per_voxel > 0 ? options.metres_per_voxel : grid.spacing_z;
  plan.vertical_scale = options.vertical_scale;
  plan.posts_per_voxel_x = plan.metres / grid.spacing_x;
  plan.posts_per_voxel_z = plan.metres / grid.spacing_z;
  const double size_x = std::floor((window.width - 1) / plan.posts_per_voxel_x + 1e-9) + 1;
  const double size_z = std::floor((window.height - 1) / plan.posts_per_voxel_z + 1e-9) + 1;
  if (!(size_x * size_z <= static_cast<double>(kMaxColumns))) {
    return refused(
        fmt::format("{}: {:.0f} x {:.0f} columns of voxels are too many (at most {} in all); choose more metres per "
                    "voxel or a smaller window",
                    name, size_x, size_z, kMaxColumns));
  }
  const double squares = std::ceil(size_x / kRegionSize) * std::ceil(size_z / kRegionSize);
  if (squares > kMostThinSquares + size_x * size_z / kLeastColumns) {
    return refused(fmt::format(
        "{}: a strip of {:.0f} x {:.0f} columns of voxels is too long for its width; choose a smaller window", name,
        size_x, size_z));
  }
  plan.size_x = static_cast<int64_t>(size_x);
  plan.size_z = static_cast<int64_t>(size_z);
  plan.snow_line = std::clamp(4500 - 50 * std::abs(grid.latitude), 300.0, 4500.0);

  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (int row = window.row; row < window.row + window.height; ++row) {
    for (int column = window.column; column < window.column + window.width; ++column) {
      const double h = grid.at(row, column);
      if (std::isnan(h)) continue;
      lowest = std::min(lowest, h);
      highest = std::max(highest, h);
    }
  }
  if (!(lowest <= highest)) return input_error(fmt::format("{}: no post of the window has a height", name));
  // Land that is a hundred times as high as wide is damage, unless it was asked for.
  const double most = options.metres_per_voxel > 0 || options.vertical_scale != 1
                          ? kMaxVoxelsHigh
                          : std::min<double>(kMaxVoxelsHigh, 4096 + 16 * std::max(window.width, window.height));
  if (!(std::max(std::abs(lowest), std::abs(highest)) * plan.vertical_scale / plan.metres <= most)) {
    return refused(fmt::format(
        "{}: the land would be more than {} voxels high; choose more metres per voxel or a smaller vertical scale",
        name, most));
  }
  plan.floor = (plan.ground(lowest) - options.depth_voxels + 1) & ~(kLeafSize - 1);
  return plan;
}

}  // namespace

Result<ImportOptions::Window> window_of(int columns, int rows, const ImportOptions& options, const std::string& name) {
  ImportOptions::Window w = options.window;
  if (w.width == 0 && w.column >= 0) w.width = columns - w.column;
  if (w.height == 0 && w.row >= 0) w.height = rows - w.row;
  if (w.column < 0 || w.row < 0 || w.width < 1 || w.height < 1 || w.column > columns - w.width ||
      w.row > rows - w.height) {
    return usage_error(fmt::format(
        "{}: the window {} {} {} {} (column, row, width, height) does not lie within the {} x {} posts of the tile",
        name, options.window.column, options.window.row, options.window.width, options.window.height, columns, rows));
  }
  return w;
}

void add_height_facts(const HeightGrid& grid, ImportReport& report) {
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest, sum = 0;
  uint64_t posts = 0;
  for (const double h : grid.heights) {
    if (std::isnan(h)) continue;
    lowest = std::min(lowest, h), highest = std::max(highest, h), sum += h;
    ++posts;
  }
  report.fact("posts", fmt::format("{} x {}", grid.columns, grid.rows));
  report.fact("with heights", std::to_string(posts));
  report.fact("min m", fmt::format("{:g}", lowest));
  report.fact("max m", fmt::format("{:g}", highest));
  report.fact("mean m", fmt::format("{:.6f}", posts ? sum / static_cast<double>(posts) : 0));
}

Result<World> land_from_heights(const HeightGrid& grid, const ImportOptions::Window& window, std::string_view format,
                                const std::string& name, const ImportOptions& options, ImportReport& report) {
  TRY(const Plan plan, make_plan(grid, window, name, options));
  report.fact("window", fmt::format("{} {} {} {}", window.column, window.row, window.width, window.height));
  report.fact("metres per voxel", fmt::format("{:.6g}", plan.metres));
  report.fact("columns", fmt::format("{} x {}", plan.size_x, plan.size_z));

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
  set_origin(world, format, name, plan.metres);
  world.metadata["elevation.window"] =
      fmt::format("{} {} {} {}", window.column, window.row, window.width, window.height);
  world.metadata["elevation.vertical_scale"] = fmt::format("{:g}", plan.vertical_scale);
  return world;
}

}  // namespace world
