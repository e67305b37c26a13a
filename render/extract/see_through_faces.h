/// Faces of see-through blocks, apart from the opaque ones: a list of records a chunk, kept up to date chunk by chunk.
///
/// An interface is where a see-through block A meets air (or a voxel that a proxy shape stands in), or a see-through
/// block B of a smaller id: one face, A's, which tells what lies on its other side. Between two voxels of one block
/// there is none, nor towards an opaque block, which shows its own face.
///
/// Where a liquid ends within its voxel (LiquidLevels), above it is air: its top lies there, its sides reach up to
/// there, and of a neighbour's side that part shows as one to air which stands higher.
///
/// A record is that of render/extract/face_record.shared.h, with A's kind (render/see_through.h) where the block's id
/// is and the kind of what lies beyond in bits 19..30 of word 1. Rectangles of equal kinds and direction; merge_faces
/// off: one for each unit face.
#pragma once

#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "render/extract/extractor.h"
#include "render/liquid_levels.h"
#include "render/see_through.h"
#include "world/world.h"

namespace render {

class SeeThroughFaces {
 public:
  /// levels: null: all liquids are full.
  void rebuild(const world::WorldView& view, const SeeThroughKinds& kinds, bool merge_faces,
               const LiquidLevels* levels = nullptr);
  /// Follows edits, and changes of levels: chunks of the changed leaves and of their six neighbours are made anew.
  /// Equal to rebuild().
  void update(const world::WorldView& view, const SeeThroughKinds& kinds, std::span<const world::LeafPos> dirty,
              const LiquidLevels* levels = nullptr);
  void clear();

  /// Chunks that have faces, sorted by position.
  const std::vector<const ExtractedChunk*>& chunks() const { return sorted_; }
  uint64_t faces() const { return faces_; }
  uint64_t quads() const { return quads_; }
  size_t bytes() const;

 private:
  void sort_chunks();

  bool merge_ = true;
  std::unordered_map<ChunkPos, std::unique_ptr<ExtractedChunk>, world::PosHash> chunks_;
  std::vector<const ExtractedChunk*> sorted_;
  uint64_t next_version_ = 1, faces_ = 0, quads_ = 0;
};

}  // namespace render
