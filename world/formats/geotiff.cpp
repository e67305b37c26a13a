// GeoTIFF elevation (.tif, .tiff) -> world, as world/formats/heights/land.h says; through GDAL, where the build found
// it.
//
// The first band; its "no data" is no post. Rows are taken as north to south, columns as west to east: files whose
// transform turns the grid are refused. Degrees become metres on the WGS 84 ellipsoid at the middle latitude.
//
// The library is loaded when the first such file is read: it brings a hundred others, which would cost every start of
// the program 50 ms and more.
#include <cmath>

#include <fmt/format.h>

#include "world/formats/format.h"
#ifndef LOAM_HAS_GDAL
#define LOAM_HAS_GDAL 0
#endif
#if LOAM_HAS_GDAL
#include <cfenv>

#include <dlfcn.h>
#include <gdal.h>

#include <cpl_conv.h>
#include <cpl_error.h>
#include <ogr_srs_api.h>

#include "world/base/trial.h"
#include "world/formats/heights/land.h"
#include "world/formats/hgt.h"
#endif

namespace world {
namespace {

#if LOAM_HAS_GDAL

constexpr int64_t kMostPosts = int64_t{1} << 26;
constexpr double kLeastSpacing = 1e-3, kMostSpacing = 1e6;  // m between posts: beyond it the file is damaged

/// The functions of GDAL that are used, each as its header declares it.
#define GDAL_FUNCTIONS(F)     \
  F(GDALAllRegister)          \
  F(CPLSetErrorHandler)       \
  F(CPLQuietErrorHandler)     \
  F(CPLGetLastErrorMsg)       \
  F(GDALOpenEx)               \
  F(GDALClose)                \
  F(GDALGetRasterXSize)       \
  F(GDALGetRasterYSize)       \
  F(GDALGetRasterCount)       \
  F(GDALGetGeoTransform)      \
  F(GDALGetSpatialRef)        \
  F(GDALGetRasterBand)        \
  F(GDALRasterIO)             \
  F(GDALGetRasterNoDataValue) \
  F(GDALGetRasterScale)       \
  F(GDALGetRasterOffset)      \
  F(OSRIsGeographic)          \
  F(OSRIsProjected)           \
  F(OSRGetLinearUnits)
struct Gdal {
#define F(name) decltype(&::name) name = nullptr;
  GDAL_FUNCTIONS(F)
#undef F
  bool loaded = false;

  Gdal() {
    // Among so many libraries one may be built with -ffast-math, which changes how this thread rounds.
    std::fenv_t rounding;
    std::fegetenv(&rounding);
    void* const library = ::dlopen(LOAM_GDAL_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    std::fesetenv(&rounding);
    if (!library) return;
    loaded = true;
#define F(function)                                                                \
  function = reinterpret_cast<decltype(&::function)>(::dlsym(library, #function)); \
  loaded = loaded && function;
    GDAL_FUNCTIONS(F)
#undef F
  }
};
const Gdal& gdal() {
  static const Gdal functions;
  return functions;
}

struct CloseDataset {
  void operator()(void* dataset) const { gdal().GDALClose(dataset); }
};
using Dataset = std::unique_ptr<void, CloseDataset>;

/// The height grid of a file. GDAL is a large library that reads foreign files: the caller tries this in a child first.
Result<HeightGrid> read_with_gdal(const std::string& name, uint64_t file_bytes) {
  const Gdal& g = gdal();
  g.GDALAllRegister();
  g.CPLSetErrorHandler(g.CPLQuietErrorHandler);
  const char* const drivers[] = {"GTiff", nullptr};
  const Dataset dataset(g.GDALOpenEx(name.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, drivers, nullptr, nullptr));
  const auto said = [&g] {
    std::string message;
    for (const char* c = g.CPLGetLastErrorMsg(); *c && message.size() < 200; ++c)
      message += *c >= 32 && *c < 127 ? *c : '?';
    return message;
  };
  if (!dataset) return input_error(fmt::format("{}: GDAL cannot read it as a GeoTIFF: {}", name, said()));
  const int columns = g.GDALGetRasterXSize(dataset.get()), rows = g.GDALGetRasterYSize(dataset.get());
  const auto posts = int64_t{columns} * rows;
  // A post takes some 60 bytes until it is land, of 16 for each byte of the file and 256 MiB; four posts a byte is what
  // the strongest packing of real land reaches.
  if (columns < 1 || rows < 1 || posts > kMostPosts || static_cast<uint64_t>(posts) > 3'000'000 + 4 * file_bytes)
    return input_error(
        fmt::format("{}: its {} x {} posts are more than a file of its size may unpack to", name, columns, rows));
  if (g.GDALGetRasterCount(dataset.get()) < 1) return input_error(fmt::format("{}: it has no band", name));
  HeightGrid grid;
  grid.columns = columns, grid.rows = rows;
  double transform[6] = {0, 1, 0, 0, 0, -1};
  const bool placed = g.GDALGetGeoTransform(dataset.get(), transform) == CE_None;
  if (transform[2] != 0 || transform[4] != 0 || !(transform[1] > 0) || !(transform[5] < 0) ||
      !std::isfinite(transform[1] * transform[5]))
    return input_error(
        fmt::format("{}: its grid is turned, or does not run from north-west to south-east; turn it with "
                    "gdalwarp first",
                    name));
  grid.spacing_x = transform[1], grid.spacing_z = -transform[5];
  const OGRSpatialReferenceH place = g.GDALGetSpatialRef(dataset.get());
  if (placed && place && g.OSRIsGeographic(place)) {
    grid.latitude = std::clamp(transform[3] + 0.5 * rows * transform[5], -90.0, 90.0);
    const DegreeLength degree = degree_length(grid.latitude);
    grid.spacing_x = std::max(degree.east * grid.spacing_x, 1e-3), grid.spacing_z *= degree.north;
  } else if (place && g.OSRIsProjected(place)) {
    const double metres = g.OSRGetLinearUnits(place, nullptr);
    grid.spacing_x *= metres, grid.spacing_z *= metres;
  }
  for (const double spacing : {grid.spacing_x, grid.spacing_z}) {
    if (!(spacing >= kLeastSpacing && spacing <= kMostSpacing))
      return input_error(fmt::format("{}: its posts lie {:g} m apart, and must lie {:g} to {:g}", name, spacing,
                                     kLeastSpacing, kMostSpacing));
  }
  const GDALRasterBandH band = g.GDALGetRasterBand(dataset.get(), 1);
  grid.heights.resize(static_cast<size_t>(posts));
  if (g.GDALRasterIO(band, GF_Read, 0, 0, columns, rows, grid.heights.data(), columns, rows, GDT_Float64, 0, 0) !=
      CE_None)
    return input_error(fmt::format("{}: GDAL cannot read its heights: {}", name, said()));
  int has_missing = 0, has_scale = 0, has_offset = 0;
  const double missing = g.GDALGetRasterNoDataValue(band, &has_missing), scale = g.GDALGetRasterScale(band, &has_scale),
               offset = g.GDALGetRasterOffset(band, &has_offset);
  for (double& h : grid.heights) {
    if ((has_missing && h == missing) || !(std::abs(h) < 1e6)) {
      h = std::nan("");
      continue;
    }
    if (has_scale && scale != 0) h *= scale;
    if (has_offset) h += offset;
  }
  return grid;
}

Result<World> read_geotiff(const std::filesystem::path& path, const ImportOptions& options, ImportReport& report) {
  std::error_code error;
  const uint64_t bytes = std::filesystem::file_size(path, error);
  if (error) return input_error(fmt::format("{}: cannot open: {}", path.string(), error.message()));
  if (!gdal().loaded)
    return input_error(
        fmt::format("{}: GDAL was here when Loam was built, and its library {} is not now; install "
                    "libgdal32",
                    path.string(), LOAM_GDAL_LIBRARY));
  const TrialLimits limits{.memory_bytes = (uint64_t{256} << 20) + 16 * bytes,
                           .cpu_seconds = 5 + static_cast<unsigned>(bytes >> 20)};
  const Status tried = try_in_child(limits, [&]() -> Status {
    const Result<HeightGrid> grid = read_with_gdal(path.string(), bytes);
    return grid.ok() ? Status() : Status(grid.error());
  });
  if (!tried) {
    const std::string& message = tried.error().message;
    return message.starts_with(path.string())
               ? tried.error()
               : input_error(fmt::format("{}: the file is damaged: {}", path.string(), message));
  }
  TRY(const HeightGrid grid, read_with_gdal(path.string(), bytes));
  TRY(const ImportOptions::Window window, window_of(grid.columns, grid.rows, options, path.string()));
  add_height_facts(grid, report);
  return land_from_heights(grid, window, "geotiff", path.string(), options, report);
}

#else

Result<World> read_geotiff(const std::filesystem::path& path, const ImportOptions&, ImportReport&) {
  return input_error(
      fmt::format("{}: this build of Loam reads no GeoTIFF, because GDAL was missing when it was made; "
                  "install libgdal-dev and build again (rm -r build), or convert the file: gdal_translate "
                  "-of USGSDEM IN.tif OUT.dem",
                  path.string()));
}

#endif

}  // namespace

const Format& geotiff_format() {
  static const Format format = {
      .name = "geotiff",
      .extensions = {".tif", ".tiff"},
      .what = LOAM_HAS_GDAL ? "GeoTIFF elevation" : "GeoTIFF elevation (not in this build: GDAL was missing)",
      .recognizes =
          [](const std::vector<uint8_t>& head) {
            return head.size() >= 4 && ((head[0] == 'I' && head[1] == 'I' && head[2] == 42 && head[3] == 0) ||
                                        (head[0] == 'M' && head[1] == 'M' && head[2] == 0 && head[3] == 42));
          },
      .read = read_geotiff,
      .write = nullptr,
  };
  return format;
}

}  // namespace world
