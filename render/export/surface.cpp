// Faces of all chunks as one surface, and the registry: each file render/export/NAME.cpp exposes
// `SurfaceFormat NAME_surface_format()`; this one and smooth.cpp are no formats.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <unordered_map>

#include <fmt/format.h>

#include "render/export/export.h"
#include "render/extract/extractor.h"
#include "render/image/display.h"
#include "world/formats/format.h"

namespace render {

#define SURFACE_FORMAT(name) SurfaceFormat name##_surface_format();
#include "render_export.list.h"
#undef SURFACE_FORMAT

const std::vector<SurfaceFormat>& surface_formats() {
  static const std::vector<SurfaceFormat> all = {
#define SURFACE_FORMAT(name) name##_surface_format(),
#include "render_export.list.h"
#undef SURFACE_FORMAT
  };
  return all;
}

const SurfaceFormat* surface_format_for(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const SurfaceFormat& format : surface_formats())
    if (format.extension == extension) return &format;
  return nullptr;
}

double voxel_size_of(const world::World& world) {
  const auto size = world.metadata.find("voxel_size_m");
  if (size == world.metadata.end()) return 1;
  const double value = std::strtod(size->second.c_str(), nullptr);
  return std::isfinite(value) && value > 1e-9 && value < 1e9 ? value : 1;
}

SurfaceMesh surface_of(const world::World& world, bool merged) {
  SurfaceMesh surface;
  surface.palette = world.palette.get();
  surface.voxel_size_m = voxel_size_of(world);
  const world::WorldView view(world);
  Extractor extractor;
  extractor.rebuild(view, {.merge_faces = merged, .sealed_cavities = true});
  std::map<world::BlockId, BlockSurface> blocks;
  std::map<world::BlockId, std::unordered_map<world::VoxelPos, uint32_t, world::PosHash>> corners;
  for (const ExtractedChunk* chunk : extractor.chunks()) {
    for (const FaceRecord& record : chunk->records) {
      const auto block = static_cast<world::BlockId>(face_block(record.word1));
      BlockSurface& part = blocks[block];
      part.block = block;
      auto& known = corners[block];
      std::array<uint32_t, 4> quad{};
      for (uint32_t corner = 0; corner < 4; ++corner) {
        const glm::uvec3 local = face_corner(record.word0, record.word1, corner);
        const world::VoxelPos at =
            chunk->origin + world::VoxelPos{static_cast<int32_t>(local.x), static_cast<int32_t>(local.y),
                                            static_cast<int32_t>(local.z)};
        const auto [it, added] = known.try_emplace(at, static_cast<uint32_t>(surface.vertices.size()));
        if (added) surface.vertices.push_back(at);
        quad[corner] = it->second;
      }
      part.quads.push_back(quad);
      part.faces.push_back(static_cast<uint8_t>(face_direction(record.word1)));
    }
  }
  for (auto& [id, block] : blocks) surface.blocks.push_back(std::move(block));
  return surface;
}

std::vector<std::string> surface_losses(const world::World& world, const SurfaceFormat& format) {
  std::vector<std::string> lost;
  size_t shining = 0, clear = 0, shaped = 0;
  for (const auto& [id, count] : world.store.census()) {
    const world::Block& block = (*world.palette)[id];
    shining += block.emission.max() > 0;
    clear += !block.opaque;
    shaped += !block.proxy.empty();
  }
  if (shining > 0)
    lost.push_back(fmt::format("{} kinds of block shine: {}", shining,
                               format.materials ? "the colour of their light is kept, its watts are lost"
                                                : "their colour is kept, their light is lost"));
  if (clear > 0 && !format.materials)
    lost.push_back(fmt::format("{} kinds of block let light pass: they become opaque", clear));
  if (shaped > 0) lost.push_back(fmt::format("{} kinds of block have shapes of their own: they become cubes", shaped));
  for (const auto& more : {world::lost_layers(world), world::lost_surroundings(world)})
    lost.insert(lost.end(), more.begin(), more.end());
  return lost;
}

world::Status write_surface(const world::World& world, const SurfaceFormat& format, const std::filesystem::path& path) {
  const SurfaceMesh surface = surface_of(world);
  if (surface.blocks.empty())
    return world::input_error(fmt::format("{}: the world is empty; there are no faces to write", path.string()));
  TRY(const std::string bytes, format.encode(surface));
  return world::write_bytes_atomically(path, bytes);
}

std::array<uint8_t, 3> display_colour(const world::Block& block) {
  std::array<float, 3> linear{block.albedo.r, block.albedo.g, block.albedo.b};
  const std::array<float, 3> emitted{block.emission.r, block.emission.g, block.emission.b};
  const float brightest = std::max({emitted[0], emitted[1], emitted[2]});
  std::array<uint8_t, 3> colour{};
  for (size_t band = 0; band < 3; ++band) {
    if (brightest > 0) linear[band] = emitted[band] / brightest;
    colour[band] = static_cast<uint8_t>(std::lround(255 * std::clamp(srgb_from_linear(linear[band]), 0.0f, 1.0f)));
  }
  return colour;
}

}  // namespace render
