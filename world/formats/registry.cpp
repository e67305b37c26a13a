// The one registry: each file world/formats/NAME.cpp is a format and exposes `const Format& NAME_format()`.
// CMake lists the folder; this file is the only one that is no format.
#include "world/formats/format.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "world/base/text.h"

namespace world {

#define FORMAT(name) const Format& name##_format();
#include "world_formats.list.h"
#undef FORMAT

namespace {

constexpr size_t kHeadBytes = 64;

bool ends_with_extension(const std::filesystem::path& path, const std::string& extension) {
  const std::string name = path.filename().string();
  if (name.size() <= extension.size()) return false;
  return std::equal(extension.rbegin(), extension.rend(), name.rbegin(),
                    [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); });
}

/// The format with the longest matching extension among those that `usable` accepts.
const Format* find_by_extension(const std::filesystem::path& path, bool (*usable)(const Format&)) {
  const Format* best = nullptr;
  size_t best_length = 0;
  for (const Format& format : formats()) {
    for (const std::string& extension : format.extensions) {
      if (usable(format) && extension.size() > best_length && ends_with_extension(path, extension)) {
        best = &format;
        best_length = extension.size();
      }
    }
  }
  return best;
}

bool readable(const Format& format) { return static_cast<bool>(format.read); }
bool writable(const Format& format) { return static_cast<bool>(format.write); }

std::vector<std::string> extensions_of(bool (*usable)(const Format&)) {
  std::vector<std::string> all;
  for (const Format& format : formats()) {
    if (usable(format)) all.insert(all.end(), format.extensions.begin(), format.extensions.end());
  }
  return all;
}

/// "; did you mean .vox?" where the extension looks like a known one.
std::string hint(const std::filesystem::path& path, const std::vector<std::string>& known) {
  const std::string near = nearest_text(path.extension().string(), known);
  return near.empty() ? "" : fmt::format("; did you mean {}?", near);
}

}  // namespace

void set_origin(World& world, std::string_view format, const std::filesystem::path& file, double voxel_size_m) {
  world.metadata["format"] = format;
  world.metadata["source"] = file.filename().string();
  world.metadata["voxel_size_m"] = fmt::format("{:.9g}", voxel_size_m);
}

std::vector<std::string> lost_surroundings(const World& world) {
  std::vector<std::string> lost;
  const auto count = [&](size_t n, const char* one, const char* several) {
    if (n > 0)
      lost.push_back(fmt::format("{} {} {} lost: .loam keeps them", n, n == 1 ? one : several, n == 1 ? "is" : "are"));
  };
  count(world.luminaires.size(), "luminaire", "luminaires");
  count(world.media.size(), "medium", "media");
  count(world.meshes.size(), "mesh", "meshes");
  count(world.cameras.size(), "camera", "cameras");
  count(world.knobs.size(), "knob of its pictures", "knobs of its pictures");
  if (!(world.environment == Environment{}))
    lost.push_back("its own sun and sky or temperature are lost: .loam keeps them");
  if (!(world.simulation == SimulationRequest{}))
    lost.push_back("what it asks of the simulation is lost: .loam keeps it");
  return lost;
}

std::vector<std::string> lost_layers(const World& world) {
  std::vector<std::string> lost;
  for (const LayerInfo& layer : world.store.layers())
    if (layer.name != layer_rows()[static_cast<size_t>(Layer::block)].name)
      lost.push_back(fmt::format("the layer {} of {} voxels is lost: .loam, .vdb and .nvdb keep it", layer.name,
                                 with_thousands(layer.active_voxels)));
  return lost;
}

const std::vector<Format>& formats() {
  static const std::vector<Format> all = {
#define FORMAT(name) name##_format(),
#include "world_formats.list.h"
#undef FORMAT
  };
  return all;
}

Result<const Format*> format_for_reading(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    for (const Format& format : formats())
      if (format.recognizes_folder && format.recognizes_folder(path)) return &format;
    return input_error(fmt::format("{}: is a folder that holds no world; expected a file", path.string()));
  }
  if (const Format* format = find_by_extension(path, readable)) return format;
  std::ifstream file(path, std::ios::binary);
  if (!file) return input_error(fmt::format("{}: cannot open: {}", path.string(), std::strerror(errno)));
  std::vector<uint8_t> head(kHeadBytes);
  file.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<size_t>(file.gcount()));
  for (const Format& format : formats()) {
    if (format.read && format.recognizes && format.recognizes(head)) return &format;
  }
  const std::vector<std::string> known = extensions_of(readable);
  return input_error(fmt::format("{}: unknown kind of file '{}'; readable are {}{}", path.string(),
                                 path.extension().string(), fmt::join(known, ", "), hint(path, known)));
}

Result<const Format*> format_for_writing(const std::filesystem::path& path) {
  if (const Format* format = find_by_extension(path, writable)) return format;
  const std::vector<std::string> known = extensions_of(writable);
  return usage_error(fmt::format("{}: unknown kind of file '{}'; writable are {}{}", path.string(),
                                 path.extension().string(), fmt::join(known, ", "), hint(path, known)));
}

Result<World> read_world(const std::filesystem::path& path, const ImportOptions& options, ImportReport& report) {
  TRY(const Format* format, format_for_reading(path));
  return format->read(path, options, report);
}

Status write_world(const World& world, const std::filesystem::path& path) {
  TRY(const Format* format, format_for_writing(path));
  return write_file_atomically(path, [&](const std::filesystem::path& temporary) -> Status {
    const Status status = format->write(world, temporary);
    if (status) return {};
    // The user knows the target, not the temporary name.
    std::string message = status.error().message;
    for (size_t at; (at = message.find(temporary.string())) != std::string::npos;) {
      message.replace(at, temporary.string().size(), path.string());
    }
    return Error{status.error().kind, message};
  });
}

}  // namespace world
