// Wavefront .obj -> world: the surface as a solid or a shell, with the colours of its vertices, or of its materials:
// the .mtl files and .png textures that it names, which must lie in its own folder or below. Writing surfaces is
// render/export's.
#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "world/base/file.h"
#include "world/formats/surfaces/geometry.h"
#include "world/formats/translation/translation.h"
#include "world/meshes/builder.h"

namespace world {
namespace {

constexpr uint64_t kMostLibraryBytes = uint64_t{1} << 26, kMostTextureBytes = uint64_t{1} << 28;

/// Of a name that a file holds: nothing outside of the file's own folder is opened.
std::optional<std::filesystem::path> inside(const std::filesystem::path& folder, std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');  // as Windows writes them
  const std::filesystem::path path(name);
  if (name.empty() || path.is_absolute()) return {};
  for (const auto& part : path)
    if (part == "..") return {};
  return folder / path;
}

/// Fills in the materials from the libraries, and returns their textures, an empty one where there is none. What is
/// missing is told and has the colour that is known of it; an error where it must not be.
Result<std::vector<ColourPicture>> read_materials(const std::filesystem::path& file, MeshColours& colours,
                                                  const ImportOptions& options, ImportReport& report) {
  std::vector<ColourPicture> textures(colours.materials.size());
  if (colours.materials.empty() || !colours.of_vertices.empty()) return textures;  // vertices' own colours win
  std::vector<std::string> missing;
  MtlReport of_library;
  const std::filesystem::path folder = file.parent_path();
  for (const std::string& library : colours.libraries) {
    const auto path = inside(folder, library);
    const auto bytes =
        path ? read_file(*path, kMostLibraryBytes) : Result<std::vector<uint8_t>>(input_error("outside"));
    if (!bytes.ok()) {
      missing.push_back(fmt::format("the materials {}", plain_name(library)));
      continue;
    }
    TRY_STATUS(read_mtl(*bytes, path->string(), colours, of_library));
  }
  std::map<std::string, size_t> known;
  size_t unknown = 0, textured = 0;
  for (size_t i = 0; i < colours.materials.size(); ++i) {
    const MeshColours::Material& material = colours.materials[i];
    unknown += !material.found;
    if (material.texture.empty()) continue;
    ++textured;
    const auto [first, added] = known.try_emplace(material.texture, i);
    if (!added) {
      textures[i] = textures[first->second];
      continue;
    }
    const auto path = inside(folder, material.texture);
    const auto bytes =
        path ? read_file(*path, kMostTextureBytes) : Result<std::vector<uint8_t>>(input_error("outside"));
    Result<ColourPicture> picture =
        bytes.ok() ? read_colour_png(*bytes, path->string()) : Result<ColourPicture>(input_error("is missing"));
    if (picture.ok())
      textures[i] = std::move(*picture);
    else
      missing.push_back(
          fmt::format("the texture {}{}", plain_name(material.texture), bytes.ok() ? " (only .png is read)" : ""));
  }
  report.fact("materials", textured ? fmt::format("{}, {} with textures", colours.materials.size(), textured)
                                    : std::to_string(colours.materials.size()));
  if (unknown) missing.push_back(fmt::format("{} of {} materials", unknown, colours.materials.size()));
  if (options.strict && !missing.empty())
    return input_error(fmt::format("{}: {} could not be read from its folder; leave --strict out to get plain colours",
                                   file.string(), missing.front()));
  for (const std::string& what : missing)
    report.warnings.push_back(what + " could not be read from the file's folder: plain colours stand in its place");
  if (of_library.clear)
    report.warnings.push_back(fmt::format("{} materials let light pass: they became opaque", of_library.clear));
  if (of_library.shining)
    report.warnings.push_back(fmt::format("{} materials shine: they became matte", of_library.shining));
  return textures;
}

}  // namespace

const Format& obj_format() {
  static const Format format = {
      .name = "obj",
      .extensions = {".obj"},
      .what = "triangle meshes, as solids",
      .recognizes = nullptr,
      .read = [](const std::filesystem::path& path, const ImportOptions& options,
                 ImportReport& report) -> Result<World> {
        TRY(const std::vector<uint8_t> bytes, read_file(path, uint64_t{1} << 31));
        MeshReport read;
        MeshFileFacts facts;
        MeshColours colours;
        TRY(const TriangleMesh mesh, read_obj(bytes, path.string(), read, &facts, &colours));
        TRY(const std::vector<ColourPicture> textures, read_materials(path, colours, options, report));
        return world_from_mesh(mesh, facts, read, colours, textures, path.string(), path.stem().string(), options,
                               report);
      },
      .write = nullptr,
  };
  return format;
}

}  // namespace world
