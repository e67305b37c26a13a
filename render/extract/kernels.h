/// The inner loops of extraction, compiled for each SIMD level and chosen at run time. Bits in, bits out: the same on
/// every level. Only render/extract calls them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "render/extract/faces.h"
#include "world/store/leaf_mask.h"

namespace render {

/// Words from one x to the next in planes of bits; 8 more than 64, so that a walk along x does not keep hitting the
/// same few sets of the cache (stride 512 bytes: 8 of 64 sets).
constexpr size_t kRowPitch = 72;

/// Set bits in `count` LeafFaces.
uint64_t count_faces(const LeafFaces* faces, size_t count);

/// Where an id equals that of the neighbour towards +x, +y, +z: bit i of out[axis] compares voxel i with its neighbour.
/// ids and next[axis]: 512 ids of the leaf and of the leaf beyond it (null: no voxel there is equal).
void equal_neighbours(const world::BlockId* ids, const world::BlockId* const next[3], world::LeafMask out[3]);

/// Lays eight leaves that follow each other along z side by side: rows[x*kRowPitch + y] gets the bits z of all eight.
/// Returns bit x*8 + y where that row is not zero; writes nothing where no row is.
uint64_t rows_from_leaves(const world::LeafMask* const leaves[8], uint64_t* rows);

/// Swaps y and z in a leaf: bit y*8 + z becomes bit z*8 + y.
void swap_yz(const world::LeafMask& in, world::LeafMask& out);

/// Grows `reached` within `open` through faces until nothing changes; `entry` holds bits that neighbours bring in.
/// `reached` is empty or what an earlier call left. True where it changed.
bool flood_leaf(const world::LeafMask& open, const world::LeafMask& entry, world::LeafMask& reached);

/// 8x8 bits: bit a*8 + b becomes bit b*8 + a.
constexpr uint64_t transpose_8x8(uint64_t w) {
  uint64_t t = (w ^ (w >> 7)) & 0x00aa00aa00aa00aaull;
  w ^= t ^ (t << 7);
  t = (w ^ (w >> 14)) & 0x0000cccc0000ccccull;
  w ^= t ^ (t << 14);
  t = (w ^ (w >> 28)) & 0x00000000f0f0f0f0ull;
  return w ^ t ^ (t << 28);
}

}  // namespace render
