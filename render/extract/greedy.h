/// From the face masks of a chunk to face records: one for each unit face, or rectangles of equal block and direction.
///
/// Greedy: runs along one axis (z for the faces of x and y, y for those of z), then as many equal runs in the following
/// rows as there are. Works on planes of 64 rows of 64 bits; ids are compared 32 at a time into masks beforehand, so
/// the merging itself reads an id only once a rectangle. error  none: the rectangles cover exactly the unit faces, with
/// the same blocks (tests/render/extract/greedy_test.cpp)
#pragma once

#include <array>
#include <span>
#include <vector>

#include "render/extract/face_record.shared.h"
#include "render/extract/faces.h"

namespace render {

/// Inclusive bounds in voxel corners of the chunk (0..64); empty where max < min.
struct CornerBox {
  std::array<uint8_t, 3> min{255, 255, 255}, max{0, 0, 0};
  bool empty() const { return max[0] < min[0]; }
  void include(const CornerBox& other);
  friend bool operator==(const CornerBox&, const CornerBox&) = default;
};

struct ChunkRecords {
  std::vector<FaceRecord> records;                  // direction by direction
  std::array<uint32_t, world::kFaces + 1> first{};  // records of direction f: [first[f], first[f + 1])
  std::array<CornerBox, world::kFaces> bounds;      // exact, of the faces of each direction
  CornerBox all_bounds;                             // exact, of all faces
  uint64_t faces = 0;                               // unit faces that the records cover

  std::span<const FaceRecord> of_direction(int face) const {
    return {records.data() + first[face], records.data() + first[face + 1]};
  }
};

/// Blocks of the chunk's leaves by slot of `faces`, valid until the next edit.
using ChunkBlocks = std::span<const world::LeafBlocks>;

/// Rectangles. Allocates nothing once its scratch (0.5 MB a thread) and `out` have grown.
void merge_faces(const ChunkFaces& faces, ChunkBlocks blocks, ChunkRecords& out);
/// One record for each unit face.
void list_faces(const ChunkFaces& faces, ChunkBlocks blocks, ChunkRecords& out);

}  // namespace render
