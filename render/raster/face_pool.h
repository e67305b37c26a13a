/// The faces of a world on the device. A chunk's records lie together in a page of a storage buffer, direction by
/// direction, and in each by place, so that a run of some hundred is a cluster with a small box: the unit of culling.
///
///   page 0: [chunk a: -X clusters | +X clusters | ... | +Z clusters][chunk b: ...]
/// A page is at most maxStorageBufferRange.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "render/extract/extractor.h"
#include "render/extract/proxies.h"
#include "render/gpu/owned.h"
#include "render/raster/free_ranges.h"

namespace render::raster {

constexpr uint32_t kClusterRecords = 128;  // at most; a few thousand triangles cost as much as some draws

constexpr int kPoolDirections = kShapeDirections;  // of faces, and of sheets that are seen from both sides

/// What a pool keeps of a chunk: records by direction.
struct PoolSource {
  world::VoxelPos origin;
  uint64_t version = 0;
  std::span<const FaceRecord> records;
  std::array<uint32_t, kPoolDirections + 1> first{};  // of direction f: [first[f], first[f + 1])
  CornerBox box;                                      // of all
};
std::vector<PoolSource> pool_sources(std::span<const ExtractedChunk* const> chunks);
std::vector<PoolSource> pool_sources(std::span<const ShapeChunk* const> chunks);
/// A record a voxel in place of one a face.
std::vector<PoolSource> instance_sources(std::span<const ShapeChunk* const> chunks);

/// Of a rectangle's four vertices, those of its two triangles.
constexpr std::array<uint32_t, 6> kQuadCorners{0, 1, 2, 2, 1, 3};
/// Indices for that many records, from the first on.
void fill_quad_indices(const gpu::Buffer& buffer, uint32_t records);

/// A bit a record of a cluster.
using RecordBits = std::array<uint32_t, kClusterRecords / 32>;
constexpr RecordBits kNoRecords{}, kAllRecords{~0u, ~0u, ~0u, ~0u};

struct FaceCluster {
  uint32_t first = 0, count = 0;  // records of its page
  CornerBox box;                  // relative to the chunk
  uint8_t direction = 0;
  RecordBits
      seen{};  // which may have been seen in the last picture that looked at it; those behind `count` mean nothing

  /// Of records, how many bits are set.
  uint32_t among(const RecordBits& bits) const;
  bool visible() const { return among(seen) != 0; }
};

struct PooledChunk {
  world::VoxelPos origin;
  uint64_t version = 0;  // of the extracted chunk
  uint32_t page = 0;
  uint32_t first = 0, count = 0;  // all records
  CornerBox box;
  std::vector<FaceCluster> clusters;  // by direction, then place; they fill [first, first + count) in order
  uint64_t impostor = 0;              // its picture, see impostors.h; 0: none
  uint32_t looks = 0;                 // pictures so far that could have shown it
};

class FacePool {
 public:
  /// The box of a record in voxel corners of its chunk.
  using BoxOf = CornerBox (*)(const FaceRecord&);
  static CornerBox box_of_face(const FaceRecord& record);
  static CornerBox box_of_voxel(const FaceRecord& record);
  explicit FacePool(BoxOf box_of = box_of_face) : box_of_(box_of) {}

  /// Whether these chunks, sorted by position, are what it holds already.
  template <class Chunk>
  bool holds(std::span<const Chunk* const> chunks) const {
    return std::equal(chunks.begin(), chunks.end(), chunks_.begin(), chunks_.end(),
                      [](const Chunk* chunk, const PooledChunk& held) {
                        return chunk->origin == held.origin && chunk->version == held.version;
                      });
  }
  /// Follows the extractor's chunks: sends those whose version is new, drops those that are gone. Returns the bytes
  /// sent.
  world::Result<uint64_t> update(gpu::Device& device, std::span<const PoolSource> chunks);
  void clear();

  /// Sorted by position. Culling may set `visible` of clusters.
  std::vector<PooledChunk>& chunks() { return chunks_; }
  const std::vector<PooledChunk>& chunks() const { return chunks_; }
  size_t pages() const { return pages_.size(); }
  const gpu::Buffer& page(size_t index) const { return pages_[index].buffer; }
  /// No chunk has more records than this.
  uint32_t largest_chunk() const { return largest_; }
  /// Records in a page; tests lower it.
  uint32_t page_records = 4u << 20;

 private:
  struct Page {
    gpu::Buffer buffer;
    FreeRanges free;
  };
  world::Status place(gpu::Device& device, uint32_t count, PooledChunk& chunk);
  void release(const PooledChunk& chunk);

  BoxOf box_of_;
  std::vector<Page> pages_;
  std::vector<PooledChunk> chunks_;
  uint32_t largest_ = 0;
};

}  // namespace render::raster
