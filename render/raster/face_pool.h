/// The faces of a world on the device: each chunk's records lie together, direction by direction, in a page of
/// a storage buffer.
///
///   page 0: [chunk a: -X | +X | -Y | +Y | -Z | +Z][chunk b: ...]...     pages of at most maxStorageBufferRange
#pragma once

#include <array>
#include <map>
#include <span>
#include <vector>

#include "render/extract/extractor.h"
#include "render/gpu/owned.h"

namespace render::raster {

struct PooledChunk {
  world::VoxelPos origin;
  uint64_t version = 0;  // of the extracted chunk
  uint32_t page = 0;
  std::array<uint32_t, world::kFaces + 1> first{};  // record of each direction in the page
  std::array<CornerBox, world::kFaces> bounds;
};

class FacePool {
 public:
  /// Follows the extractor's chunks: sends those whose version is new, drops those that are gone. Returns the bytes
  /// sent.
  world::Result<uint64_t> update(gpu::Device& device, std::span<const ExtractedChunk* const> chunks);
  void clear();

  const std::vector<PooledChunk>& chunks() const { return chunks_; }  // sorted by position
  size_t pages() const { return pages_.size(); }
  const gpu::Buffer& page(size_t index) const { return pages_[index].buffer; }
  /// No chunk has more records than this.
  uint32_t largest_chunk() const { return largest_; }
  /// Records in a page; tests lower it.
  uint32_t page_records = 4u << 20;

 private:
  struct Page {
    gpu::Buffer buffer;
    std::map<uint32_t, uint32_t> free;  // first record -> count
  };
  world::Status place(gpu::Device& device, uint32_t count, PooledChunk& chunk);
  void release(const PooledChunk& chunk);

  std::vector<Page> pages_;
  std::vector<PooledChunk> chunks_;
  uint32_t largest_ = 0;
};

}  // namespace render::raster
