/// The inner loops of extraction, compiled for each SIMD level and chosen at run time. Bits in, bits out: the same on
/// every level. Only render/extract calls them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "render/extract/face_record.shared.h"
#include "render/extract/faces.h"
#include "world/store/leaf_mask.h"

namespace render {

/// Of the transparent voxels of a leaf (occupied, not opaque): adds those faces that look at air to `faces`, and sets
/// `touching` to those that look at another transparent voxel. False where none does.
bool transparent_faces(const LeafNeighbourhood& occupied, const LeafNeighbourhood& opaque, LeafFaces& faces,
                       LeafFaces& touching);

/// Takes away the faces that look at a voxel of the volume around.
void remove_faces_towards(const LeafNeighbourhood& around, LeafFaces& faces);

/// Set bits in `count` LeafFaces.
uint64_t count_faces(const LeafFaces* faces, size_t count);

/// Where an id equals that of the neighbour towards +x, +y, +z: bit i of out[axis] compares voxel i with its neighbour.
/// ids and next[axis]: 512 ids of the leaf and of the leaf beyond it (null: no voxel there is equal).
void equal_neighbours(const world::BlockId* ids, const world::BlockId* const next[3], world::LeafMask out[3]);

/// Words from one x to the next in planes of bits; 8 more than 64, so that a walk along x does not keep hitting the
/// same few sets of the cache (stride 512 bytes: 8 of 64 sets).
constexpr size_t kRowPitch = 72;
constexpr size_t kPlanesWords = (kChunkSize + 1) * kRowPitch;  // with the row beyond the last, which stays zero

/// A chunk as planes of 64 rows of 64 bits, 0.4 MB. Faces of x and y share rows of z bits at [x][y]; faces of z have
/// rows of y bits at [x][z].
///
///   direction  plane  row  bit      row r of plane p lies at
///   x          x      y    z        p*kRowPitch + r
///   y          y      x    z        p + r*kRowPitch
///   z          z      x    y        p + r*kRowPitch
struct ChunkPlanes {
  alignas(64) uint64_t faces[world::kFaces][kPlanesWords] = {};  // zero between chunks: merging clears what it takes
  alignas(64) uint64_t along_bit[3][kPlanesWords] = {};          // id equals that of the next bit; y uses x's
  alignas(64) uint64_t along_row[3][kPlanesWords] = {};          // id equals that of the same bit in the next row
  alignas(64) uint64_t rows[world::kFaces][kChunkSize] = {};     // by plane, bit r: row r has faces; zero as above
};

/// Leaves of a chunk laid side by side. equal: by slot, three masks each, as equal_neighbours makes them.
void gather_planes(const ChunkFaces& faces, const world::LeafMask (*equal)[3], ChunkPlanes& planes);

struct DirectionExtent {
  uint64_t planes = 0, rows = 0, bits = 0;  // which of the 64 hold any face
};
/// Merges the faces of a direction to rectangles: runs along the bits, each followed down the rows while all of it goes
/// on. `out` has room for one record a face and kMergeSlack more. Leaves block ids 0 and clears the faces it takes.
/// Returns the end of the records.
constexpr size_t kMergeSlack = 2;
FaceRecord* merge_direction(ChunkPlanes& planes, int face, FaceRecord* out, DirectionExtent& extent);

/// Adds the block id of each record's first voxel. ids: by index_in_chunk of the leaf, then by index_in_leaf.
void add_blocks(FaceRecord* begin, FaceRecord* end, const world::BlockId* const ids[kLeavesPerChunk]);

/// Grows `reached` within `open` through faces until nothing changes; `entry` holds bits that neighbours bring in.
/// `reached` is empty or what an earlier call left. True where it changed.
bool flood_leaf(const world::LeafMask& open, const world::LeafMask& entry, world::LeafMask& reached);

/// Where planes, rows and bits of a direction lie.
struct PlaneAxes {
  int plane, row, bit;
  size_t plane_step, row_step;  // words
};
constexpr PlaneAxes kPlaneAxes[3] = {{0, 1, 2, kRowPitch, 1}, {1, 0, 2, 1, kRowPitch}, {2, 0, 1, 1, kRowPitch}};

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
