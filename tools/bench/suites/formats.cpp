/// Formats: how fast files of other programs become worlds, beside what their compression alone takes.
#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>
#include <zlib.h>

#include "tools/bench/benchmark.h"
#include "tools/bench/format_files.h"
#include "world/base/file.h"
#include "world/formats/format.h"
#include "world/formats/mca/anvil.h"

namespace tools {

namespace {

namespace fs = std::filesystem;
using world::World;

/// A region of 512 x 512 columns of the valley as Minecraft would keep it, and its chunks inflated by zlib alone.
struct RegionInput {
  fs::path path;
  std::vector<std::vector<uint8_t>> packed;
  uint64_t blocks = 0, inflated = 0;

  /// One buffer that is used again, no parsing: what any importer has to wait for.
  uint64_t inflate_all() const {
    std::vector<uint8_t> out(16 << 20);
    uint64_t bytes = 0;
    for (const std::vector<uint8_t>& chunk : packed) {
      uLongf size = out.size();
      if (uncompress(out.data(), &size, chunk.data(), chunk.size()) != Z_OK) return 0;
      bytes += size;
      keep(out[0]);
    }
    return bytes;
  }
};

Result<std::shared_ptr<RegionInput>> region_input(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  TRY(const fs::path scratch, context.scratch());
  Status made;
  const auto input = context.shared<RegionInput>("formats/region", [&] {
    auto region = std::make_shared<RegionInput>();
    region->path = scratch / "r.0.0.mca";
    made = world::mca::write_region(*valley, 0, 0, scratch);
    if (!made) return region;
    const auto file = world::mca::open_region(region->path);
    if (!file) return region;
    world::MemoryBudget budget(uint64_t{1} << 32);
    world::StateTable states(budget);
    world::mca::ChunkReader reader(states, budget);
    std::vector<world::Cube> cubes;
    for (const world::mca::PackedChunk& chunk : file->chunks) {
      region->packed.emplace_back(chunk.bytes.begin(), chunk.bytes.end());
      reader.read(chunk, "chunk", cubes);
    }
    region->blocks = cubes.size() * world::kCubeVoxels;
    region->inflated = region->inflate_all();
    return region;
  });
  TRY_STATUS(made);
  return input;
}

double import_blocks(const fs::path& path, uint64_t blocks) {
  world::ImportReport report;
  const auto imported = world::read_world(path, {}, report);
  return imported && report.warnings.empty() ? static_cast<double>(blocks) : std::nan("");
}

Result<Prepared> prepare_region(BenchContext& context) {
  TRY(const std::shared_ptr<RegionInput> input, region_input(context));
  return Prepared{.ours = {"import", [=] { return import_blocks(input->path, input->blocks); }},
                  .rivals = {{"zlib's inflate alone",
                              [=] {
                                keep(input->inflate_all());
                                return static_cast<double>(input->blocks);
                              }}},
                  .counters =
                      [=] {
                        return std::map<std::string, double>{{"blocks", static_cast<double>(input->blocks)},
                                                             {"inflated bytes", static_cast<double>(input->inflated)}};
                      },
                  .check = [=]() -> Status {
                    world::ImportReport report;
                    TRY(const World imported, world::read_world(input->path, {}, report));
                    if (imported.store.voxel_count() > 0 && report.warnings.empty()) return {};
                    return world::input_error("the region was not imported as a whole");
                  }};
}

/// Chunks that are inflated already: what parsing and decoding cost beyond zlib.
Result<Prepared> prepare_decoding(BenchContext& context) {
  TRY(const std::shared_ptr<RegionInput> input, region_input(context));
  TRY(const fs::path scratch, context.scratch());
  const fs::path folder = scratch / "inflated";
  std::error_code error;
  fs::create_directory(folder, error);
  const fs::path path = folder / "r.0.0.mca";
  TRY(std::vector<uint8_t> bytes, world::read_file(input->path));
  // The same region, its chunks stored without compression.
  std::string header(8192, '\0'), chunks;
  std::vector<uint8_t> out(16 << 20);
  for (size_t i = 0; i < input->packed.size(); ++i) {
    uLongf size = out.size();
    if (uncompress(out.data(), &size, input->packed[i].data(), input->packed[i].size()) != Z_OK)
      return world::input_error("a chunk could not be inflated");
    const size_t sector = 2 + chunks.size() / 4096;
    for (int shift = 24; shift >= 0; shift -= 8) chunks += static_cast<char>((size + 1) >> shift & 0xff);
    chunks += '\3';
    chunks.append(reinterpret_cast<const char*>(out.data()), size);
    chunks.resize((chunks.size() + 4095) / 4096 * 4096);
    for (size_t b = 0; b < 3; ++b) header[i * 4 + b] = static_cast<char>(sector >> (16 - 8 * b) & 0xff);
    header[i * 4 + 3] = '\1';
  }
  TRY_STATUS(world::write_bytes_atomically(path, header + chunks));
  return Prepared{.ours = {"import", [=] { return import_blocks(path, input->blocks); }}};
}

Result<Prepared> prepare_export(BenchContext& context, const char* extension, bool reading) {
  TRY(const World* valley, context.world(context.quick() ? "cornell" : "valley"));
  TRY(const fs::path scratch, context.scratch());
  const fs::path path = scratch / (std::string("world") + extension);
  TRY_STATUS(world::write_world(*valley, path));
  const auto voxels = static_cast<double>(valley->store.voxel_count());
  if (reading)
    return Prepared{.ours = {"read", [=] { return import_blocks(path, valley->store.voxel_count()); }},
                    .rivals = {{"reading the bytes", [=] {
                                  const auto bytes = world::read_file(path);
                                  keep(bytes);
                                  return bytes.ok() ? voxels : std::nan("");
                                }}}};
  return Prepared{.ours = {"write", [=] { return world::write_world(*valley, path) ? voxels : std::nan(""); }}};
}

/// A file that `make` gives the bytes of, beside its decompressor alone, or where it is not packed beside reading it.
Result<Prepared> prepare_file(BenchContext& context, const std::string& name,
                              Result<FormatFile> (*make)(BenchContext&, const fs::path&)) {
  TRY(const fs::path scratch, context.scratch());
  const fs::path path = scratch / name;
  Status made;
  const auto file = context.shared<FormatFile>("formats/" + name, [&]() -> std::shared_ptr<FormatFile> {
    Result<FormatFile> result = make(context, path);
    if (!result.ok()) {
      made = result.error();
      return std::make_shared<FormatFile>();
    }
    if (!result->bytes.empty()) made = world::write_bytes_atomically(path, result->bytes);
    return std::make_shared<FormatFile>(std::move(*result));
  });
  TRY_STATUS(made);
  const Contender alone =
      file->packed.empty()
          ? Contender{"reading the bytes",
                      [=] {
                        const auto bytes = world::read_file(path);
                        keep(bytes);
                        return bytes.ok() ? file->work : std::nan("");
                      }}
          : Contender{"its decompressor alone", [=] { return unpack_alone(*file) ? file->work : std::nan(""); }};
  return Prepared{.ours = {"import",
                           [=] {
                             world::ImportReport report;
                             const auto imported = world::read_world(path, {}, report);
                             return imported.ok() && imported->store.voxel_count() > 0 ? file->work : std::nan("");
                           }},
                  .rivals = {alone}};
}

/// A part of the valley, from its lowest voxel on.
Result<std::pair<const World*, world::VoxelBox>> valley_part(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  const int side = context.quick() ? 64 : 256;
  return std::pair{valley, world::VoxelBox{{0, 0, 0}, {side - 1, context.quick() ? 63 : 127, side - 1}}};
}

struct FileRow {
  const char *file, *what, *unit;
  Result<FormatFile> (*make)(BenchContext&, const fs::path&);
};

constexpr int kPoints = 1'000'000;

const FileRow kFileRows[] = {
    {"part.litematic", "256 x 128 x 256 of the valley from a .litematic, air too", "M voxels/s",
     [](BenchContext& c, const fs::path&) -> Result<FormatFile> {
       TRY(const auto part, valley_part(c));
       return litematic_file(part.first->store, part.second);
     }},
    {"part.mts", "the same from a .mts", "M voxels/s",
     [](BenchContext& c, const fs::path&) -> Result<FormatFile> {
       TRY(const auto part, valley_part(c));
       return mts_file(part.first->store, part.second);
     }},
    {"map.sqlite", "the same from Luanti's map.sqlite", "M voxels/s",
     [](BenchContext& c, const fs::path& path) -> Result<FormatFile> {
       TRY(const auto part, valley_part(c));
       return write_luanti_map(part.first->store, part.second, path);
     }},
    {"N42E001.hgt", "1201 x 1201 heights from a .hgt", "M posts/s",
     [](BenchContext&, const fs::path&) -> Result<FormatFile> { return hgt_file(1201); }},
    {"wave.obj", "a surface of 512 x 512 m from an .obj, as voxels of 1 m", "M triangles/s",
     [](BenchContext&, const fs::path&) -> Result<FormatFile> { return obj_file(513); }},
    {"wave.ply", "the same from a binary .ply", "M triangles/s",
     [](BenchContext&, const fs::path&) -> Result<FormatFile> { return ply_mesh_file(513); }},
    {"points.ply", "10^6 points in 256^3 m from a binary .ply", "M points/s",
     [](BenchContext&, const fs::path&) -> Result<FormatFile> { return ply_points_file(kPoints); }},
    {"points.pcd", "the same from a binary .pcd", "M points/s",
     [](BenchContext&, const fs::path&) -> Result<FormatFile> { return pcd_file(kPoints); }},
};

}  // namespace

void add_suite_formats(Registry& registry) {
  registry.add(
      {.name = "mca_import",
       .what = "a full .mca region (512 x 512 columns of the valley): file to world, beside zlib's inflate alone",
       .unit = "M blocks/s",
       .scale = 1e6,
       .threads = 1,
       .clock = Clock::wall,
       .reach = Reach{0.5, "the aim: never slower than 2x zlib's inflate alone", true},
       .prepare = prepare_region});
  registry.add({.name = "mca_decode",
                .what = "the same region with its chunks inflated already: what comes beyond inflate's own time",
                .unit = "M blocks/s",
                .scale = 1e6,
                .threads = 1,
                .clock = Clock::wall,
                .reach = Reach{100, "the aim: 100 M blocks/s beyond inflate's own time"},
                .prepare = prepare_decoding});
  registry.add({.name = "mca_import_all_cores",
                .what = "the region of mca_import, all cores",
                .unit = "M blocks/s",
                .scale = 1e6,
                .prepare = prepare_region});
  for (const auto& [name, extension] :
       {std::pair{"vox", ".vox"}, std::pair{"schem", ".schem"}, std::pair{"vdb", ".vdb"}, std::pair{"nvdb", ".nvdb"}})
    for (const bool reading : {true, false})
      registry.add(
          {.name = fmt::format("{}_{}", name, reading ? "read" : "write"),
           .what = fmt::format("the valley {} a {}, voxels that are not air", reading ? "from" : "to", extension),
           .unit = "M voxels/s",
           .scale = 1e6,
           .prepare = [extension = extension, reading](BenchContext& context) {
             return prepare_export(context, extension, reading);
           }});
  for (const FileRow& row : kFileRows) {
    std::string name = row.file;
    std::replace(name.begin(), name.end(), '.', '_');
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
    registry.add({.name = name + "_read",
                  .what = row.what,
                  .unit = row.unit,
                  .scale = 1e6,
                  .repetitions = 5,
                  .prepare = [&row](BenchContext& context) { return prepare_file(context, row.file, row.make); }});
  }
}

}  // namespace tools
