#include "render/raster/face_pool.h"

#include <algorithm>
#include <cstring>

namespace render::raster {

void FacePool::clear() {
  pages_.clear();
  chunks_.clear();
  largest_ = 0;
}

void FacePool::release(const PooledChunk& chunk) {
  auto& free = pages_[chunk.page].free;
  uint32_t first = chunk.first[0], count = chunk.first[world::kFaces] - first;
  const auto after = free.find(first + count);
  if (after != free.end()) {
    count += after->second;
    free.erase(after);
  }
  const auto next = free.lower_bound(first);
  if (next != free.begin()) {
    const auto before = std::prev(next);
    if (before->first + before->second == first) {
      before->second += count;
      return;
    }
  }
  free[first] = count;
}

world::Status FacePool::place(gpu::Device& device, uint32_t records, PooledChunk& chunk) {
  for (uint32_t p = 0;; ++p) {
    if (p == pages_.size()) {
      const uint32_t limit = device.limits().maxStorageBufferRange / static_cast<uint32_t>(sizeof(FaceRecord));
      const uint32_t room = std::min(limit, std::max(page_records, records));
      Page page;
      TRY(page.buffer, gpu::make_buffer(device, uint64_t{room} * sizeof(FaceRecord),
                                        VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                        gpu::MemoryUse::device));
      page.free[0] = room;
      pages_.push_back(std::move(page));
    }
    auto& free = pages_[p].free;
    for (auto it = free.begin(); it != free.end(); ++it) {
      const auto [first, count] = *it;
      if (count < records) continue;
      free.erase(it);
      if (count > records) free[first + records] = count - records;
      chunk.page = p;
      chunk.first[0] = first;
      return {};
    }
  }
}

world::Result<uint64_t> FacePool::update(gpu::Device& device, std::span<const ExtractedChunk* const> chunks) {
  // Keep what is unchanged; free what changed or is gone. Both lists are sorted by position.
  std::vector<PooledChunk> next(chunks.size());
  std::vector<size_t> fresh;
  uint64_t records = 0;
  size_t old = 0;
  for (size_t i = 0; i < chunks.size(); ++i) {
    while (old < chunks_.size() && chunks_[old].origin < chunks[i]->origin) release(chunks_[old++]);
    if (old < chunks_.size() && chunks_[old].origin == chunks[i]->origin) {
      if (chunks_[old].version == chunks[i]->version) {
        next[i] = chunks_[old++];
        continue;
      }
      release(chunks_[old++]);
    }
    fresh.push_back(i);
    records += chunks[i]->records.size();
  }
  while (old < chunks_.size()) release(chunks_[old++]);
  chunks_.clear();  // until all is in place, nothing is

  // Place the new ones and send them through one staging buffer.
  if (records) {
    struct Copy {
      uint32_t page;
      VkBufferCopy region;
    };
    std::vector<Copy> copies;
    TRY(const gpu::Buffer staging, gpu::make_buffer(device, records * sizeof(FaceRecord),
                                                    VK_BUFFER_USAGE_TRANSFER_SRC_BIT, gpu::MemoryUse::upload));
    uint64_t at = 0;
    for (const size_t i : fresh) {
      const ExtractedChunk& source = *chunks[i];
      PooledChunk& chunk = next[i];
      chunk.origin = source.origin;
      chunk.version = source.version;
      chunk.bounds = source.bounds;
      const uint32_t count = static_cast<uint32_t>(source.records.size());
      TRY_STATUS(place(device, count, chunk));
      for (size_t f = 0; f <= world::kFaces; ++f) chunk.first[f] = chunk.first[0] + source.first[f];
      largest_ = std::max(largest_, count);
      const uint64_t bytes = count * sizeof(FaceRecord);
      std::memcpy(staging.mapped() + at, source.records.data(), bytes);
      copies.push_back({chunk.page, {at, uint64_t{chunk.first[0]} * sizeof(FaceRecord), bytes}});
      at += bytes;
    }
    TRY_STATUS(device.run([&](VkCommandBuffer commands) {
      for (const Copy& copy : copies)
        vkCmdCopyBuffer(commands, staging.handle, pages_[copy.page].buffer.handle, 1, &copy.region);
    }));
  }
  chunks_ = std::move(next);
  return records * sizeof(FaceRecord);
}

}  // namespace render::raster
