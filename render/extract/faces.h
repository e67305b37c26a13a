/// Visible faces of voxels, as masks: for each leaf and each of the six directions 512 bits.
///
/// The face of voxel A towards its neighbour B is visible where A is not air, B is not opaque, and
///   A is opaque, or B is air, or both are transparent and A's id is larger: so glass on glass has no face, and glass
///   on water exactly one.
/// Blocks that are left out (FaceSource) count as air.
/// Pure mask operations on the opaque voxels; ids are read only where two transparent voxels touch.
///
/// A chunk is 64^3 voxels = 8^3 leaves, aligned to 64: the unit that is merged and drawn. Eight to a region.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "world/space/coords.h"
#include "world/store/mask_volume.h"
#include "world/store/store.h"

namespace render {

using ChunkPos = world::IntPos<struct ChunkSpace>;
constexpr int kChunkLog2 = 6, kChunkSize = 64, kChunkLeaves = 8, kLeavesPerChunk = 512;

constexpr ChunkPos chunk_from_voxel(world::VoxelPos v) {
  return {v.x >> kChunkLog2, v.y >> kChunkLog2, v.z >> kChunkLog2};
}
constexpr ChunkPos chunk_from_leaf(world::LeafPos l) { return {l.x >> 3, l.y >> 3, l.z >> 3}; }
constexpr world::VoxelPos voxel_from_chunk(ChunkPos c) {
  return {c.x * kChunkSize, c.y * kChunkSize, c.z * kChunkSize};
}
/// 0..511, x*64 + y*8 + z, as voxels in a leaf.
constexpr int index_in_chunk(world::LeafPos l) { return (l.x & 7) << 6 | (l.y & 7) << 3 | (l.z & 7); }
constexpr world::LeafPos leaf_in_chunk(ChunkPos c, int index) {
  return {c.x * 8 + (index >> 6), c.y * 8 + (index >> 3 & 7), c.z * 8 + (index & 7)};
}

/// Visible faces of one leaf, by direction.
struct LeafFaces {
  world::LeafMask face[world::kFaces];
  bool is_none() const;
  int count() const;
  friend bool operator==(const LeafFaces&, const LeafFaces&) = default;
};
static_assert(sizeof(LeafFaces) == 384);

/// A leaf's opaque voxels and those of its six neighbours, in order of Face. Never null.
struct LeafNeighbourhood {
  const world::LeafMask* self;
  const world::LeafMask* neighbour[world::kFaces];
};

/// faces[i] = visible faces of the opaque voxels of leaves[i], for at most 64 leaves. Returns bit i where there are
/// any. cost   7 masks read, 6 written; about 10 ns a leaf with AVX-512
uint64_t opaque_faces(const LeafNeighbourhood* leaves, size_t count, LeafFaces* faces);

/// What extraction reads. `transparent` says whether any block that is neither air nor opaque may occur: where not,
/// `occupied` equals `opaque` and no id is read. `sealed` (or null) holds voxels that nothing can see, see cavities.h.
struct FaceSource {
  const world::Store* store = nullptr;  // ids; may be null where occupied equals opaque
  const world::MaskVolume* occupied = nullptr;
  const world::MaskVolume* opaque = nullptr;
  const world::MaskVolume* sealed = nullptr;
  std::span<const uint8_t> left_out = {};  // by block: 1 where it has no faces here and hides none; empty: none is
};

/// The leaves of a chunk that have visible faces, and those faces. Reused: allocates only to grow.
struct ChunkFaces {
  static constexpr uint16_t kNone = 0xffff;
  std::array<uint16_t, kLeavesPerChunk> slot;  // by index_in_chunk: place in `faces`, or kNone
  std::vector<uint16_t> leaf;                  // by slot: index_in_chunk
  std::vector<LeafFaces> faces;                // by slot; may be longer than `leaf`, so that it seldom grows

  ChunkFaces() { clear(); }
  void clear();
  bool empty() const { return leaf.empty(); }
  const LeafFaces* find(int index) const { return slot[index] == kNone ? nullptr : &faces[slot[index]]; }
  /// Replaces the faces of a leaf; none removes it. True where anything changed.
  bool set(int index, const LeafFaces& value);
  uint64_t count() const;
};

/// Fills `out` with the visible faces of a chunk; skips leaves that are empty or wholly inside opaque leaves, 64 at a
/// time. Returns how many leaves it looked at one by one.
uint64_t extract_chunk_faces(const FaceSource& source, world::StoreReader* reader, ChunkPos chunk, ChunkFaces& out);

/// The visible faces of one leaf.
LeafFaces extract_leaf_faces(const FaceSource& source, world::StoreReader* reader, world::LeafPos leaf);

/// Adds to a leaf in the border of its chunk the opaque faces towards the next chunk that are hidden, of voxels at most
/// two from one that shows a face: where the next chunk is drawn at another level, its surface may lie lower there.
void add_skirts(const world::MaskVolume& opaque, world::LeafPos leaf, LeafFaces& faces);

/// Chunks that hold any occupied voxel, sorted by position.
std::vector<ChunkPos> occupied_chunks(const world::MaskVolume& occupied);

struct FaceTotals {
  uint64_t faces = 0;         // visible unit faces
  uint64_t leaves = 0;        // looked at one by one
  uint64_t voxels_dense = 0;  // of the chunks walked, empty space included
};
/// The masks of a whole world, made and counted, kept nowhere: what a benchmark times.
FaceTotals count_visible_faces(const FaceSource& source);

}  // namespace render
