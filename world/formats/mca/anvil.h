/// Minecraft Java's region files, r.X.Z.mca: 32 x 32 chunks of 16 x 16 columns, each a compressed NBT tree.
///
///   4 KiB  locations   1024 x (3 bytes first sector, 1 byte sectors), chunk (x & 31) + 32 * (z & 31); 0 = absent
///   4 KiB  times       not read
///   chunk  4 bytes length (the compression byte included), 1 byte compression: 1 gzip, 2 zlib, 3 none; + 128: the
///          data lies in c.X.Z.mcc beside the region file
///
/// A chunk is a stack of sections of 16^3 blocks. How they say their blocks depends on the version:
///   before 1.13            Blocks [4096] ids, Data [2048] nibbles, Add [2048] higher bits of ids
///   1.13 (1451) to 1.15    Palette of states, BlockStates: indices packed across 64-bit words
///   1.16 (2529) to 1.17    the same, but no index spans two words
///   1.18 (2844) on         block_states.palette and .data, none where the palette has one entry; from y = -64
/// Bits of an index: max(4, ceil(log2 of the palette)). Index y*256 + z*16 + x.
/// source  minecraft.wiki, Region file format and Chunk format
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "world/base/function_ref.h"
#include "world/formats/archive/budget.h"
#include "world/formats/cubes/cubes.h"
#include "world/formats/nbt/nbt.h"
#include "world/world.h"

namespace world::mca {

/// Where one chunk's packed bytes lie, or why they can't be read.
struct PackedChunk {
  int32_t x = 0, z = 0;  // chunk coordinates, by place in the file
  uint8_t compression = 0;
  std::span<const uint8_t> bytes;  // in the region file; of an external chunk in `external`
  std::vector<uint8_t> external;
  std::string problem;  // a sentence without the chunk's name; empty where there is none
};

struct RegionFile {
  std::filesystem::path path;
  int32_t x = 0, z = 0;  // of the region: its chunks begin at 32 x
  std::vector<uint8_t> bytes;
  std::vector<PackedChunk> chunks;  // those that are there
};
/// Reads a file and finds its chunks. Its name must say where it lies: r.X.Z.mca.
Result<RegionFile> open_region(const std::filesystem::path& path);
/// The region files of a folder: its own, or those of its folder `region`; sorted by name.
std::vector<std::filesystem::path> region_files(const std::filesystem::path& folder);

struct ChunkInfo {
  int32_t x = 0, z = 0;
  int data_version = 0;  // 0: older than 1.9, which didn't say
  std::string status;
  bool light_populated = false;  // before 1.13: the game has finished the chunk's light
  int sections = 0, sections_with_blocks = 0;
  int min_section_y = 0, max_section_y = 0;  // where sections > 0
  int entities = 0, block_entities = 0;
  std::string problem;  // of the chunk or of one of its sections; empty where there is none
};

/// The stored light of a section: two levels, 0 to 15, a byte, the lower nibble first, index y*256 + z*16 + x; empty
/// where the file holds none.
struct SectionLight {
  CubePos pos;
  std::span<const uint8_t> sky, block;  // [2048] each
};

/// One worker's hands: inflates chunks and turns their sections into cubes. Not for two threads at once.
class ChunkReader {
 public:
  ChunkReader(StateTable& states, MemoryBudget& budget);
  ~ChunkReader();

  /// Appends the cubes of a chunk; what is wrong is said in its problem, and what could be read stands.
  ChunkInfo read(const PackedChunk& chunk, const std::string& file, std::vector<Cube>& cubes);
  /// The light of its sections.
  ChunkInfo read_light(const PackedChunk& chunk, const std::string& file, FunctionRef<void(const SectionLight&)> visit);
  /// The inflated tree, valid until the next call.
  Result<std::span<const uint8_t>> inflate(const PackedChunk& chunk);

 private:
  /// Parses the chunk; false where it can't be inflated, which its info says.
  bool open(const PackedChunk& chunk, const std::string& file);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Calls visit for each section of a region file, or of all in a folder, that holds light: what Minecraft computed, to
/// compare another light with. One thread. The problems of chunks that could not be read are returned.
Result<std::vector<std::string>> read_mca_light(const std::filesystem::path& path,
                                                FunctionRef<void(const SectionLight&)> visit);

/// Writes the 32 x 32 chunks of one region of a world into folder/r.X.Z.mca, as version 1.20 would: for tests and
/// benchmarks, and for who wants a world there. Blocks that Minecraft doesn't know are named "loam:NAME".
Status write_region(const World& world, int32_t region_x, int32_t region_z, const std::filesystem::path& folder);

}  // namespace world::mca
