/// Formats: how fast files of other programs become worlds, beside what their compression alone takes.
#include <cmath>

#include <fmt/format.h>
#include <zlib.h>

#include "tools/bench/benchmark.h"
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
  if (reading) return Prepared{.ours = {"read", [=] { return import_blocks(path, valley->store.voxel_count()); }}};
  return Prepared{.ours = {"write", [=] { return world::write_world(*valley, path) ? voxels : std::nan(""); }}};
}

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
}

}  // namespace tools
