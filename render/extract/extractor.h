/// Owns the visible faces of a world: a list of face records a chunk, kept up to date leaf by leaf.
///
/// All of a world, or of one that is too large for that the chunks near a place, which follow it: those that are new
/// cost some 50 us each, and what is far goes, so that a flight holds no more than a stay.
///
/// An edit re-extracts the dirty leaves and their six face neighbours and merges again only the chunks in which that
/// changed anything. Chunks are worked on in parallel; the result does not depend on threads or on history, but for
/// sealed cavities (see update()).
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "render/extract/greedy.h"
#include "render/extract/liquid_parts.h"
#include "render/see_through.h"
#include "world/world.h"

namespace render {

struct ExtractedChunk : ChunkRecords {
  ChunkPos pos;
  world::VoxelPos origin;  // voxel (0, 0, 0) of the chunk
  uint64_t version = 0;    // differs after each change, unique in an extractor
};

struct ExtractKnobs {
  bool merge_faces = true;      // off: one record for each voxel face
  bool sealed_cavities = true;  // off: faces into cavities that nothing outside can see are left out
  bool skirts = false;          // on: see add_skirts()
  bool see_through = false;     // on: see-through blocks (render/see_through.h) are drawn elsewhere, and hide nothing
  friend bool operator==(const ExtractKnobs&, const ExtractKnobs&) = default;
};

/// Chunks near a place. Distances are between the boxes of chunks, in voxels of the extracted store.
struct ChunkRange {
  ChunkPos centre;  // the chunk of the place
  double need = std::numeric_limits<double>::infinity();

  bool everything() const { return need == std::numeric_limits<double>::infinity(); }
  bool needs(ChunkPos c) const { return distance(c) <= need; }
  /// Farther ones go. Some are kept beyond what is needed, so that a place that moves to and fro costs nothing.
  bool keeps(ChunkPos c) const { return distance(c) <= need + 2 * kChunkSize; }
  double distance(ChunkPos c) const;
  friend bool operator==(const ChunkRange&, const ChunkRange&) = default;
};

struct ExtractReport {
  uint64_t leaves_extracted = 0;              // whose masks were made
  uint64_t chunks_merged = 0;                 // whose records were made
  uint64_t chunks = 0, faces = 0, quads = 0;  // of the whole world, afterwards
};

class ShapeExtractor;

class Extractor {
 public:
  Extractor();
  ~Extractor();

  /// What follows the same world first, and whose voxels are no cubes; null: all are. It must live as long.
  const ShapeExtractor* shapes = nullptr;
  /// The same of liquids that end within their voxels; null: all are full.
  const LiquidLevels* levels = nullptr;

  /// Extracts everything in the range. Finds all sealed cavities of the world where the knob asks for it.
  ExtractReport rebuild(const world::WorldView& view, const ExtractKnobs& knobs, const ChunkRange& range = {});
  /// Extracts what is new in the range, and drops what is far from it. Its chunks are then those of rebuild().
  ExtractReport follow(const world::WorldView& view, const ChunkRange& range);
  /// Follows edits: `dirty` holds the leaves that changed (Store::take_dirty). Equal to rebuild(), but for cavities
  /// that an edit has newly closed: their faces stay until the next rebuild(). An opened cavity is found at once.
  /// `moved`: leaves in which a level changed.
  ExtractReport update(const world::WorldView& view, std::span<const world::LeafPos> dirty,
                       std::span<const world::LeafPos> moved = {});

  /// Chunks that have faces, sorted by position: all that the range needs, and some that it keeps.
  const std::vector<const ExtractedChunk*>& chunks() const { return sorted_; }
  const ExtractKnobs& knobs() const { return knobs_; }
  /// Whether some faces are of liquids that end within their voxels.
  bool any_part() const { return parts_.any(); }
  /// True where the voxel lies in a cavity whose faces were left out: a camera there needs sealed_cavities on.
  bool in_sealed_cavity(world::VoxelPos v) const { return sealed_.test(v); }
  size_t bytes() const;

 private:
  struct Chunk;
  FaceSource source(const world::WorldView& view);
  const world::MaskVolume& cubes(const world::WorldView& view, world::MaskKind kind) const;
  std::vector<ChunkPos> missing(const world::MaskVolume& occupied) const;
  uint64_t extract(const world::WorldView& view, const FaceSource& from, std::span<const ChunkPos> positions);
  void make_records(const world::WorldView& view, Chunk& chunk) const;
  void sort_chunks();
  ExtractReport report(uint64_t leaves_extracted, uint64_t chunks_merged) const;

  ExtractKnobs knobs_;
  ChunkRange range_;
  std::unordered_set<ChunkPos, world::PosHash> held_;  // extracted, with faces or without; of a range alone
  world::MaskVolume sealed_;
  std::optional<SeeThroughKinds> kinds_;  // where knobs_.see_through
  LiquidParts parts_;
  std::unordered_map<ChunkPos, std::unique_ptr<Chunk>, world::PosHash> chunks_;
  std::vector<const ExtractedChunk*> sorted_;
  uint64_t next_version_ = 1, faces_ = 0, quads_ = 0;
};

}  // namespace render
