// Pictures of heights (.png) -> world, and back. The first row is north, the first column west.
//
//   grey, 16 or 8 bits   height = low + sample * (high - low) / 65535 (255): --height-range LOW HIGH says them; else a
//   grey
//                        level is 0.1 m. Pictures that Loam wrote say themselves what a level is.
//   RGB, 8 bits          Terrain-RGB: height = -10000 + (R * 65536 + G * 256 + B) * 0.1 m
//   alpha 0              no post
// Posts are --post-spacing metres apart; else what a picture of Loam says, else 90 m for grey (3 arc seconds) and 30 m
// for Terrain-RGB. What was assumed is a warning.
//
// Writing gives each column the height of its highest voxel: one grey level is a voxel, 0 where a column is empty.
//
// source Mapbox. Terrain-RGB tileset (its documentation of the code)
#include "world/formats/png_height.h"

#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include "world/base/file.h"
#include "world/formats/bytes.h"
#include "world/formats/heights/land.h"
#include "world/formats/heights/picture.h"

namespace world {
namespace {

constexpr const char *kLevelKey = "loam:metres_per_level", *kZeroKey = "loam:metres_at_zero",
                     *kSpacingKey = "loam:metres_per_post", *kEmptyKey = "loam:zero_is_empty";
constexpr uint32_t kMostSide = 1 << 15;

/// A number that a picture of Loam says of itself; none where it is missing or no finite number.
std::optional<double> said(const HeightPicture& picture, const char* key) {
  const auto text = picture.texts.find(key);
  if (text == picture.texts.end()) return std::nullopt;
  char* end = nullptr;
  const double value = std::strtod(text->second.c_str(), &end);
  return end != text->second.c_str() && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

}  // namespace

Result<World> world_from_height_png(std::span<const uint8_t> bytes, const std::string& name,
                                    const ImportOptions& options, ImportReport& report) {
  TRY(const HeightPicture picture, read_height_png(bytes, name));
  const bool rgb = picture.channels >= 3, alpha = picture.channels == 2 || picture.channels == 4;
  if (rgb && picture.bits != 8)
    return byte_error(name, 24, "the PNG has 16 bits of colour; expected 16 bits of grey, or Terrain-RGB of 8 bits");
  const double levels = picture.bits == 16 ? 65535 : 255;
  const auto level = said(picture, kLevelKey), zero = said(picture, kZeroKey), spacing = said(picture, kSpacingKey);
  double low = zero.value_or(0), unit = level.value_or(0.1);
  if (options.height_range_m) {
    low = options.height_range_m->first;
    unit = (options.height_range_m->second - low) / levels;
  }
  HeightGrid grid;
  grid.columns = static_cast<int>(picture.width), grid.rows = static_cast<int>(picture.height);
  grid.spacing_x = grid.spacing_z = options.post_spacing_m > 0 ? options.post_spacing_m
                                    : spacing && *spacing > 0  ? *spacing
                                    : rgb                      ? 30.0
                                                               : 90.0;
  grid.heights.reserve(size_t{picture.width} * picture.height);
  const bool zero_is_empty = picture.texts.contains(kEmptyKey);
  uint64_t sum = 0;
  uint16_t least = 65535, greatest = 0;
  for (uint32_t row = 0; row < picture.height; ++row) {
    for (uint32_t column = 0; column < picture.width; ++column) {
      const uint16_t sample = picture.at(row, column);
      double h = low + sample * unit;
      if (rgb) h = -10000 + 0.1 * (sample * 65536.0 + picture.at(row, column, 1) * 256.0 + picture.at(row, column, 2));
      const bool missing =
          (alpha && picture.at(row, column, picture.channels - 1) == 0) || (zero_is_empty && sample == 0);
      grid.heights.push_back(missing ? std::nan("") : h);
      sum += sample, least = std::min(least, sample), greatest = std::max(greatest, sample);
    }
  }
  const bool own = level && zero && spacing;
  if (!own && !rgb && !options.height_range_m)
    report.warnings.push_back(
        "the picture does not say its heights: a grey level was taken for 0.1 m; "
        "--height-range LOW HIGH says them");
  if (!own && !(options.post_spacing_m > 0))
    report.warnings.push_back(
        fmt::format("the picture does not say how far its posts lie apart: {:g} m was taken; "
                    "--post-spacing says it",
                    grid.spacing_z));
  TRY(const ImportOptions::Window window, window_of(grid.columns, grid.rows, options, name));
  report.fact("kind", rgb ? "Terrain-RGB" : fmt::format("grey, {} bits", picture.bits));
  if (!rgb) {
    report.fact("raw min", std::to_string(least));
    report.fact("raw max", std::to_string(greatest));
    report.fact("raw sum", std::to_string(sum));
  }
  add_height_facts(grid, report);
  return land_from_heights(grid, window, "png_height", name, options, report);
}

Status write_height_png_of(const World& world, const std::filesystem::path& path) {
  const VoxelBox box = world.store.bounds();
  const int64_t width = int64_t{box.max.x} - box.min.x + 1, height = int64_t{box.max.z} - box.min.z + 1,
                levels = int64_t{box.max.y} - box.min.y + 1;
  if (box.empty())
    return input_error(fmt::format("{}: the world is empty; there are no heights to write", path.string()));
  if (width > kMostSide || height > kMostSide || levels > 65535)
    return input_error(
        fmt::format("{}: {} x {} columns, {} voxels high, don't fit; at most {} on a side and 65535 high",
                    path.string(), width, height, levels, kMostSide));
  HeightPicture picture;
  picture.width = static_cast<uint32_t>(width), picture.height = static_cast<uint32_t>(height);
  picture.samples.resize(static_cast<size_t>(width * height));
  StoreReader reader(world.store);
  for (const RegionPos r : world.store.regions()) {
    for (int i = 0; i < kLeavesPerRegion; ++i) {
      const LeafPos l = leaf_from_region(r) + leaf_offset_in_region(i);
      const LeafBlocks leaf = reader.leaf(l);
      if (!leaf.values && leaf.uniform == kAir) continue;
      for (int index = 0; index < kLeafVoxels; ++index) {
        if (leaf[index] == kAir) continue;
        const VoxelPos v = voxel_from_leaf(l) + offset_in_leaf(index);
        uint16_t& sample = picture.samples[static_cast<size_t>((v.z - box.min.z) * width + (v.x - box.min.x))];
        sample = std::max(sample, static_cast<uint16_t>(v.y - box.min.y + 1));
      }
    }
  }
  double size = 1;
  if (const auto known = world.metadata.find("voxel_size_m"); known != world.metadata.end()) {
    const double value = std::strtod(known->second.c_str(), nullptr);
    if (std::isfinite(value) && value > 1e-9 && value < 1e9) size = value;
  }
  picture.texts = {{kLevelKey, fmt::format("{}", size)},
                   {kZeroKey, fmt::format("{}", size * box.min.y)},
                   {kSpacingKey, fmt::format("{}", size)},
                   {kEmptyKey, "yes"}};
  TRY(const std::string bytes, write_height_png(picture, path.string()));
  std::ofstream out(path, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  return out ? Status() : Status(input_error(fmt::format("{}: cannot write all of it", path.string())));
}

namespace {

std::vector<std::string> height_losses(const World& world) {
  const size_t kinds = world.store.census().size();
  std::vector<std::string> lost = {
      fmt::format("of {} kinds of block and what lies below others only the height of each column is kept", kinds)};
  for (const auto& more : {lost_layers(world), lost_surroundings(world)})
    lost.insert(lost.end(), more.begin(), more.end());
  return lost;
}

}  // namespace

const Format& png_height_format() {
  static const Format format = {
      .name = "png_height",
      .extensions = {".png"},
      .what = "pictures of heights: 16 bits of grey, or Terrain-RGB; writes the height of each column",
      .recognizes =
          [](const std::vector<uint8_t>& head) {
            return head.size() >= 4 && head[0] == 0x89 && head[1] == 'P' && head[2] == 'N' && head[3] == 'G';
          },
      .read = [](const std::filesystem::path& path, const ImportOptions& options,
                 ImportReport& report) -> Result<World> {
        TRY(const std::vector<uint8_t> bytes, read_file(path, uint64_t{1} << 31));
        return world_from_height_png(bytes, path.string(), options, report);
      },
      .write = write_height_png_of,
      .losses = height_losses,
  };
  return format;
}

}  // namespace world
