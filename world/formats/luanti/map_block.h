/// Luanti's map blocks: 16^3 nodes as they lie in the database of a world.
///
///   version 25 to 28: flags, light state (27 on), widths 2 and 2, zlib(nodes), zlib(node metadata), static objects,
///                     time, names, timers; 29: all of it in one zstd frame, names before the nodes
///   nodes: content ids [4096] of 16 bits, param1 [4096], param2 [4096]; index z*256 + y*16 + x
///   names: content id -> "default:stone", for this block alone
/// Of param1, the lower nibble is daylight and the higher one lamps; param2 is a direction, a level or a colour.
/// source  Luanti, doc/world_format.md
#pragma once

#include <array>
#include <filesystem>
#include <memory>

#include "world/base/function_ref.h"
#include "world/formats/cubes/cubes.h"

namespace world::luanti {

/// One worker's hands. Not for two threads at once.
class BlockReader {
 public:
  explicit BlockReader(StateTable& states, MemoryBudget& budget);
  ~BlockReader();

  /// Appends the cube of a block at (x, y, z), in block coordinates of Luanti; what is wrong, or nothing.
  std::string read(std::span<const uint8_t> blob, std::array<int, 3> pos, std::vector<Cube>& cubes);
  /// param1 of the block read last: [4096] in Luanti's order; empty where it failed.
  std::span<const uint8_t> light() const;
  int version() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The row of a block in the database.
struct StoredBlock {
  std::array<int, 3> pos{};  // in blocks of 16 nodes
  std::vector<uint8_t> bytes;
};
/// Reads all rows of a map.sqlite, sorted by position. Positions are one column "pos" or three, x, y and z.
Result<std::vector<StoredBlock>> read_rows(const std::filesystem::path& path, MemoryBudget& budget);

/// Calls visit(block position, param1 [4096]) for each block: the light that Luanti computed. One thread.
Status read_map_light(const std::filesystem::path& path,
                      FunctionRef<void(std::array<int, 3>, std::span<const uint8_t>)> visit);

/// "stairs:stair_wood" with param2 -> "stairs:stair_wood[facing=north,half=bottom]"; other names as they are.
std::string node_state(std::string_view name, uint8_t param2);

}  // namespace world::luanti
