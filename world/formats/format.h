/// Files that other programs wrote, and ours. One file a format in world/formats/; chosen by extension and content.
///
/// Readers are bounded: memory follows from what the file really holds, never from what a header claims. An error is
/// one sentence: file, byte offset, what was expected, what to do.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "world/base/errors.h"
#include "world/base/file.h"
#include "world/world.h"

namespace world {

struct ImportOptions {
  bool strict = false;          // what has no match is an error
  bool visible_only = false;    // leave hidden parts out
  bool count_states = false;    // fill ImportReport::states; costs a pass over the voxels
  int frame = -1;               // of animated files; -1: as the file opens (world/formats/vox/vox_file.h)
  double metres_per_voxel = 0;  // elevation: 0 = the spacing of the posts; surfaces and points: 0 = a round number
  /// Elevation window in posts: columns from west, rows from north; width or height 0 = all.
  struct Window {
    int column = 0, row = 0, width = 0, height = 0;
  } window = {};
  double vertical_scale = 1;  // elevation exaggeration
  int depth_voxels = 8;       // elevation: thickness of the ground below the lowest height
  // Elevation pictures that don't say it themselves: metres between posts, and those of the least and greatest grey.
  double post_spacing_m = 0;  // 0 = what the file says
  std::optional<std::pair<double, double>> height_range_m = {};
  // Surfaces and points; what the numbers mean is in world/sources/sampler.h.
  int supersampling = 1;
  double coverage = 0.5;
  bool shell = false;
  double point_radius_m = 0;                           // 0: the voxel that each point lies in
  enum class Up { as_usual, y, z } up = Up::as_usual;  // usual: y of surfaces, z of points
  std::string grid = {};  // of files that hold several: its name; empty: as the format says
};

/// What the user is told about an import.
struct ImportReport {
  std::map<std::string, uint64_t> unmapped;                // name in the file -> voxels
  std::map<std::string, uint64_t> states;                  // block state in the file, air too -> voxels; if asked for
  std::vector<std::string> warnings;                       // a sentence each
  std::vector<std::pair<std::string, std::string>> facts;  // table rows: name, value
  void fact(std::string name, std::string value) { facts.emplace_back(std::move(name), std::move(value)); }
};

/// Says in the world's metadata where it came from: "format", "source" (the file's name) and "voxel_size_m".
void set_origin(World& world, std::string_view format, const std::filesystem::path& file, double voxel_size_m = 1);

struct Format {
  std::string name;                     // "vox"
  std::vector<std::string> extensions;  // ".vox"; compared without case
  std::string what;                     // one line for help
  /// True where the first bytes look like this format; null: by extension only.
  std::function<bool(const std::vector<uint8_t>& head)> recognizes;
  /// Null where the format cannot be read, or written.
  std::function<Result<World>(const std::filesystem::path&, const ImportOptions&, ImportReport&)> read;
  std::function<Status(const World&, const std::filesystem::path&)> write;
  /// For what is a folder of files; null where it is always one file.
  std::function<bool(const std::filesystem::path& folder)> recognizes_folder = nullptr;
  /// What a file of this format can't hold of this world, a sentence each; null where it holds everything.
  std::function<std::vector<std::string>(const World&)> losses = nullptr;
};

/// What only our own saves keep of a world, a sentence each: luminaires, media, meshes, cameras, sun and sky; and
/// layers.
std::vector<std::string> lost_surroundings(const World& world);
std::vector<std::string> lost_layers(const World& world);

/// All formats; the one registry.
const std::vector<Format>& formats();
/// By extension, then by content; a folder by what lies in it.
Result<const Format*> format_for_reading(const std::filesystem::path& path);
Result<const Format*> format_for_writing(const std::filesystem::path& path);

Result<World> read_world(const std::filesystem::path& path, const ImportOptions& options, ImportReport& report);
/// Writes beside the target, syncs, and renames over it: no partial output is ever left.
Status write_world(const World& world, const std::filesystem::path& path);

}  // namespace world
