// Bicubic spline surfaces.
//
//   kind = "spline_patch"
//   basis = "bspline"          a uniform cubic B-spline over the net; or "bezier": patches that share their outer
//   points,
//                              so that rows and columns are 3 k + 1
//   rows, columns              of the net, at least 4 each
//   points = [x, y, z, ...]    rows * columns points, row by row
//   closed_rows, closed_columns = false      of a B-spline: a direction that wraps
//   error_voxels = 0.1         how far its triangles may lie from it
//   fill, thickness_m          as of a mesh; "solid" where the surface is closed, else "shell"
//   file = "teapot.bpt"        in place of the net: the number of patches, then for each "3 3" and 16 points
//
// source Gerald Farin. Curves and Surfaces for CAGD. 2001 (chapters 8 and 16)
#include <array>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "world/base/file.h"
#include "world/sources/mesh/mesh_shape.h"
#include "world/sources/mesh/patches.h"
#include "world/sources/source.h"

namespace world {
namespace {

constexpr int32_t kMostSide = 1024;
// A triangle takes about a microsecond and 300 bytes until voxels are asked for. Any net may have the first number of
// them, which is a patch of 360 x 360 parts; larger nets more, and none more than the last.
constexpr double kTrianglesOfAnyNet = 1 << 18, kTrianglesOfPatch = 1024, kMostTriangles = 1 << 23;
constexpr uint64_t kMostFileBytes = uint64_t{1} << 26;

/// Numbers of a .bpt file, one after the other.
Result<std::vector<BezierPatch>> read_bpt(const std::filesystem::path& path) {
  TRY(const std::vector<uint8_t> bytes, read_file(path, kMostFileBytes));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  size_t at = 0;
  const auto next = [&](double& out) {
    at = std::min(text.find_first_not_of(" \t\r\n", at), text.size());
    const auto [end, bad] = std::from_chars(text.data() + at, text.data() + text.size(), out);
    if (bad != std::errc() || !std::isfinite(out)) return false;
    at = static_cast<size_t>(end - text.data());
    return true;
  };
  const auto error = [&](const char* what) {
    return input_error(fmt::format("{}: byte {}: expected {}", path.string(), at, what));
  };
  double count = 0;
  if (!next(count) || count < 1 || count > static_cast<double>(bytes.size()))
    return error("the number of patches, at least 1");
  std::vector<BezierPatch> patches;
  for (double i = 0; i < count; ++i) {
    double u = 0, v = 0;
    if (!next(u) || !next(v) || u != 3 || v != 3) return error("\"3 3\", the degrees of a bicubic patch");
    BezierPatch patch;
    for (Vec3d& p : patch)
      for (int axis = 0; axis < 3; ++axis)
        if (!next(p[axis])) return error("a coordinate of a control point");
    patches.push_back(patch);
  }
  return patches;
}

std::vector<BezierPatch> read_net(TomlTable& table, bool& closed) {
  int basis = 0;
  int32_t rows = 0, columns = 0;
  constexpr std::array<std::string_view, 2> kBases{"bspline", "bezier"};
  table.read_choice("basis", basis, kBases);
  bool closed_rows = false, closed_columns = false;
  table.read("closed_rows", closed_rows);
  table.read("closed_columns", closed_columns);
  closed = closed_rows && closed_columns;
  const bool high = table.require("rows", rows, NumberRange{4, kMostSide}),
             wide = table.require("columns", columns, NumberRange{4, kMostSide});
  if (!high || !wide) return {};
  std::vector<double> numbers(3 * static_cast<size_t>(rows) * static_cast<size_t>(columns));
  if (!table.require("points", std::span<double>(numbers), NumberRange{-1e9, 1e9})) return {};
  std::vector<Vec3d> net;
  for (size_t i = 0; i < numbers.size(); i += 3) net.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  if (basis == 0) return patches_from_bspline(net, rows, columns, closed_rows, closed_columns);
  if (rows % 3 != 1 || columns % 3 != 1) {
    table.fail("rows", "a net of Bezier patches has 3 k + 1 rows and columns");
    return {};
  }
  std::vector<BezierPatch> patches;
  for (int row = 0; row + 3 < rows; row += 3) {
    for (int column = 0; column + 3 < columns; column += 3) {
      BezierPatch patch;
      for (int i = 0; i < 16; ++i)
        patch[static_cast<size_t>(i)] = net[static_cast<size_t>((row + i / 4) * columns + column + i % 4)];
      patches.push_back(patch);
    }
  }
  return patches;
}

std::shared_ptr<const Shape> read_spline_patch(TomlTable& table, const SourceContext& context) {
  std::string file;
  bool closed = true;
  std::vector<BezierPatch> patches;
  if (table.read("file", file)) {
    std::filesystem::path path = file;
    if (path.is_relative()) path = context.folder / path;
    Result<std::vector<BezierPatch>> read = read_bpt(path);
    if (!read) {
      table.fail("file", read.error().message);
      return nullptr;
    }
    patches = std::move(*read);
  } else {
    patches = read_net(table, closed);
  }
  double error = 0.1;
  int kind = closed ? 0 : 1;
  constexpr std::array<std::string_view, 2> kFills{"solid", "shell"};
  table.read("error_voxels", error, {.min = 1e-3, .max = 100});
  table.read_choice("fill", kind, kFills);
  MeshFill fill{.shell = kind == 1};
  table.read("thickness_m", fill.thickness, {.min = 0, .max = 1e9});
  if (fill.shell && fill.thickness == 0) fill.thickness = context.voxel_m;
  if (patches.empty()) return nullptr;
  // The same number for all, so that neighbours meet without cracks.
  int divisions = 1;
  for (const BezierPatch& patch : patches)
    divisions = std::max(divisions, divisions_for(patch, error * context.voxel_m));
  const auto count = static_cast<double>(patches.size());
  const double most = std::min(kMostTriangles, kTrianglesOfAnyNet + kTrianglesOfPatch * count);
  if (2.0 * divisions * divisions * count > most) {
    table.fail(
        "error_voxels",
        fmt::format("{} patches of {} x {} parts would be more than {:.0f} triangles: allow a larger error, or a "
                    "larger voxel_size_m",
                    patches.size(), divisions, divisions, most));
    return nullptr;
  }
  MeshShapeReport report;
  return mesh_shape(triangles_of(patches, divisions), fill, report);
}

}  // namespace

SourceKind spline_patch_source() {
  return {.name = "spline_patch", .what = "bicubic B-spline and Bezier surfaces", .read = read_spline_patch};
}

}  // namespace world
