#include "render/light_files.h"

#include <algorithm>
#include <filesystem>
#include <map>

#include <fmt/format.h>

#include "render/image/display.h"
#include "render/image/hdr.h"
#include "render/image/png_exr.h"
#include "world/meshes/mesh.h"

namespace render {

namespace {

using world::input_error;
using world::LightImage;
using world::Luminaire;
using world::Result;
using world::Status;

LightImage light_of(const Image& image) {
  return {image.width, image.height, {image.pixels.begin(), image.pixels.end()}};
}

LightImage light_from_png(const PngFile& file) {
  LightImage image{file.width, file.height, {}};
  const float most = file.bits == 16 ? 65535.0f : 255.0f;
  const auto channels = static_cast<size_t>(file.channels);
  std::vector<float> linear(file.bits == 16 ? 65536 : 256);
  for (size_t i = 0; i < linear.size(); ++i) linear[i] = linear_from_srgb(static_cast<float>(i) / most);
  for (size_t i = 0; i < file.samples.size(); i += channels) {
    const auto band = [&](size_t c) { return linear[file.samples[i + (channels >= 3 ? c : 0)]]; };
    image.pixels.push_back({band(0), band(1), band(2)});
  }
  return image;
}

Result<LightImage> read_light_image(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (extension == ".png") {
    TRY(const PngFile file, read_png(path));
    return light_from_png(file);
  }
  if (extension == ".exr") {
    TRY(const ExrFile file, read_exr(path));
    return light_of(file.image);
  }
  if (extension == ".hdr" || extension == ".pic") {
    TRY(const Image image, read_hdr(path));
    return light_of(image);
  }
  return input_error(fmt::format("{}: is no .png, .exr or .hdr", path.string()));
}

Status load_mesh(Luminaire& luminaire) {
  world::MeshReport report;
  TRY(const world::TriangleMesh mesh, world::read_mesh_file(luminaire.mesh_file, report));
  luminaire.triangles.clear();
  for (const glm::uvec3& triangle : mesh.triangles)
    for (int corner = 0; corner < 3; ++corner) luminaire.triangles.push_back(mesh.positions[triangle[corner]]);
  return {};
}

}  // namespace

Status load_light_files(world::World& world) {
  std::map<std::string, std::shared_ptr<const LightImage>> images;
  for (Luminaire& luminaire : world.luminaires) {
    const auto told = [&](const char* key, const world::Error& error) {
      return world::Error{error.kind, fmt::format("{}: '{}' of luminaire '{}': {}", luminaire.where, key,
                                                  luminaire.name, error.message)};
    };
    if (!luminaire.image.empty() && !luminaire.light_image) {
      std::shared_ptr<const LightImage>& image = images[luminaire.image];
      if (!image) {
        Result<LightImage> read = read_light_image(luminaire.image);
        if (!read.ok()) return told("image", read.error());
        image = std::make_shared<const LightImage>(std::move(*read));
      }
      luminaire.light_image = image;
      TRY([[maybe_unused]] const world::LuminaireSampler tried, world::LuminaireSampler::make(luminaire));
    }
    if (!luminaire.mesh_file.empty() && luminaire.triangles.empty()) {
      const Status read = load_mesh(luminaire);
      if (!read.ok()) return told("file", read.error());
      TRY([[maybe_unused]] const world::LuminaireSampler tried, world::LuminaireSampler::make(luminaire));
    }
  }
  return {};
}

}  // namespace render
