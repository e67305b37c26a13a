/// Cubes of 16^3 voxels with a palette each: what Minecraft calls sections and Luanti map blocks. A file is read into
/// cubes by many threads, then its states are turned into blocks, then the cubes fill the store region by region.
///
/// Indices lie in the order of the store: leaf (x >> 3, y >> 3, z >> 3), x slowest, then x*64 + y*8 + z in the leaf.
/// So a region is filled without a look at single coordinates; 16 x 16 bytes are transposed at a time on the way in.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "world/formats/archive/budget.h"
#include "world/formats/cubes/states.h"
#include "world/space/coords.h"
#include "world/store/store.h"

namespace world {

constexpr int kCubeLog2 = 4, kCubeSize = 16, kCubeVoxels = 4096;
using CubePos = IntPos<struct CubeSpace>;  // voxel >> 4

struct Cube {
  CubePos pos;
  std::vector<StateNumber> states;    // what an index means; never empty
  std::unique_ptr<uint8_t[]> narrow;  // [4096] indices, or null
  std::unique_ptr<uint16_t[]> wide;   // [4096] indices where 256 states do not suffice; both null: all index 0
};

/// One list of them all, in order.
std::vector<Cube> join_cubes(std::vector<std::vector<Cube>> parts);

/// How indices lie in a file: the axis that varies slowest first.
enum class CubeOrder {
  yzx,           // Minecraft: y*256 + z*16 + x
  zyx_mirrored,  // Luanti: z*256 + y*16 + x, its z running against ours
};

/// From the order of the file to that of the store. Each of in and out holds kCubeVoxels.
void order_cube(CubeOrder order, const uint8_t* in, uint8_t* out);
void order_cube(CubeOrder order, const uint16_t* in, uint16_t* out);

/// Unpacks kCubeVoxels indices of `bits` bits (1 to 16) from big-endian 64-bit words, lowest bits first. `spanning`:
/// an index may lie across two words. `words` must hold packed_words(bits, spanning) words of 8 bytes.
size_t packed_words(int bits, bool spanning);
void unpack_indices(const uint8_t* words, int bits, bool spanning, uint16_t* out);
/// For bits == 4.
void unpack_nibbles(const uint8_t* words, uint8_t* out);

/// Puts the cubes into the store, which must hold nothing where they lie. A later cube at the same place wins. Frees
/// the cubes on the way, and gives back the bytes of their indices, which who made them took. False where the budget
/// doesn't last.
bool fill_from_cubes(std::vector<Cube> cubes, std::span<const BlockId> block_of_state, MemoryBudget& budget,
                     Store& store);

/// Voxels of each state, by number.
std::vector<uint64_t> count_states(const std::vector<Cube>& cubes, size_t states);

}  // namespace world
