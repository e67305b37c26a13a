#include "render/raster/face_pool.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>
#include <utility>

#include "world/base/jobs.h"

namespace render::raster {

namespace {

/// Cells of 16^3 voxels of a chunk along a Z curve, by x*16 + y*4 + z of the cell: neighbours in the order are
/// neighbours in space.
constexpr std::array<uint8_t, 64> kCellOrder = [] {
  std::array<uint8_t, 64> order{};
  for (uint32_t i = 0; i < 64; ++i)
    for (uint32_t bit = 0; bit < 2; ++bit)
      order[i] |= static_cast<uint8_t>((i >> (4 + bit) & 1) << (3 * bit) | (i >> (2 + bit) & 1) << (3 * bit + 1) |
                                       (i >> bit & 1) << (3 * bit + 2));
  return order;
}();

/// Of the record's first voxel.
uint32_t cell_of(const FaceRecord& record) {
  const uint32_t w = record.word0;
  return kCellOrder[(w >> 12 & 0x30) | (w >> 8 & 0xc) | (w >> 4 & 3)];
}

/// Writes a chunk's records ordered by direction and cell, and cuts them into clusters. `out` is not read: the memory
/// of a device may be slow to read.
void write_clusters(const PoolSource& source, FacePool::BoxOf box_of, PooledChunk& chunk,
                    std::vector<FaceRecord>& ordered, FaceRecord* out) {
  ordered.resize(source.records.size());
  uint32_t written = 0;
  for (size_t direction = 0; direction < kPoolDirections; ++direction) {
    const auto records =
        source.records.subspan(source.first[direction], source.first[direction + 1] - source.first[direction]);
    std::array<uint32_t, 65> start{};
    for (const FaceRecord& r : records) ++start[cell_of(r) + 1];
    for (size_t c = 0; c < 64; ++c) start[c + 1] += start[c];
    std::array<uint32_t, 64> next;
    std::copy(start.begin(), start.end() - 1, next.begin());
    FaceRecord* const first = ordered.data() + written;
    for (const FaceRecord& r : records) first[next[cell_of(r)]++] = r;

    // A cluster takes whole cells while they fit; a cell that is larger than a cluster is cut.
    const uint32_t count = static_cast<uint32_t>(records.size());
    for (uint32_t begin = 0; begin < count;) {
      uint32_t end = begin;
      for (size_t c = 0; c < 64 && start[c + 1] <= begin + kClusterRecords; ++c) end = std::max(end, start[c + 1]);
      if (end <= begin) end = std::min(begin + kClusterRecords, count);
      FaceCluster cluster{chunk.first + written + begin, end - begin, {}, static_cast<uint8_t>(direction), kNoRecords};
      for (uint32_t i = begin; i < end; ++i) cluster.box.include(box_of(first[i]));
      chunk.clusters.push_back(cluster);
      begin = end;
    }
    written += count;
  }
  std::memcpy(out, ordered.data(), ordered.size() * sizeof(FaceRecord));
}

}  // namespace

void fill_quad_indices(const gpu::Buffer& buffer, uint32_t records) {
  auto* index = reinterpret_cast<uint32_t*>(buffer.mapped());
  for (uint32_t r = 0; r < records; ++r)
    for (const uint32_t corner : kQuadCorners) *index++ = 4 * r + corner;
}

uint32_t FaceCluster::among(const RecordBits& bits) const {
  uint32_t set = 0;
  for (uint32_t begin = 0; begin < count; begin += 32)
    set += static_cast<uint32_t>(
        std::popcount(bits[begin / 32] & (count - begin < 32 ? (1u << (count - begin)) - 1 : ~0u)));
  return set;
}

CornerBox FacePool::box_of_face(const FaceRecord& record) {
  const glm::uvec3 low = face_corner(record.word0, record.word1, 0), high = face_corner(record.word0, record.word1, 2);
  CornerBox box;
  for (int a = 0; a < 3; ++a) {
    box.min[static_cast<size_t>(a)] = static_cast<uint8_t>(std::min(low[a], high[a]));
    box.max[static_cast<size_t>(a)] = static_cast<uint8_t>(std::max(low[a], high[a]));
  }
  // A liquid's top lies within its voxel.
  if (face_is_part(record.word0) && face_direction(record.word1) == world::kFacePosY) --box.min[1];
  return box;
}

CornerBox FacePool::box_of_voxel(const FaceRecord& record) {
  const glm::uvec3 low = face_voxel(record.word0);
  CornerBox box;
  for (int a = 0; a < 3; ++a) {
    box.min[static_cast<size_t>(a)] = static_cast<uint8_t>(low[a]);
    box.max[static_cast<size_t>(a)] = static_cast<uint8_t>(low[a] + 1);
  }
  return box;
}

std::vector<PoolSource> pool_sources(std::span<const ExtractedChunk* const> chunks) {
  std::vector<PoolSource> all(chunks.size());
  for (size_t i = 0; i < chunks.size(); ++i) {
    const ExtractedChunk& c = *chunks[i];
    all[i] = {c.origin, c.version, c.records, {}, c.all_bounds};
    std::copy(c.first.begin(), c.first.end(), all[i].first.begin());
    all[i].first[kPoolDirections] = all[i].first[world::kFaces];
  }
  return all;
}

std::vector<PoolSource> pool_sources(std::span<const ShapeChunk* const> chunks) {
  std::vector<PoolSource> all(chunks.size());
  for (size_t i = 0; i < chunks.size(); ++i)
    all[i] = {chunks[i]->origin, chunks[i]->version, chunks[i]->records, chunks[i]->first, chunks[i]->bounds};
  return all;
}

std::vector<PoolSource> instance_sources(std::span<const ShapeChunk* const> chunks) {
  std::vector<PoolSource> all(chunks.size());
  for (size_t i = 0; i < chunks.size(); ++i) {
    const ShapeChunk& c = *chunks[i];
    all[i] = {c.origin, c.version, c.instances, {}, c.bounds};
    all[i].first[kPoolDirections] = static_cast<uint32_t>(c.instances.size());  // seen from both sides
  }
  return all;
}

void FacePool::clear() {
  pages_.clear();
  chunks_.clear();
  largest_ = 0;
}

void FacePool::release(const PooledChunk& chunk) { pages_[chunk.page].free.give_back(chunk.first, chunk.count); }

world::Status FacePool::place(gpu::Device& device, uint32_t records, PooledChunk& chunk) {
  for (uint32_t p = 0;; ++p) {
    if (p == pages_.size()) {
      const uint32_t limit = std::min(device.limits().maxStorageBufferRange / static_cast<uint32_t>(sizeof(FaceRecord)),
                                      device.limits().maxTexelBufferElements);
      const uint32_t room = std::min(limit, std::max(page_records, records));
      Page page;
      TRY(page.buffer, gpu::make_texel_buffer(device, uint64_t{room} * sizeof(FaceRecord), VK_FORMAT_R32G32_UINT,
                                              VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                                              gpu::MemoryUse::device));
      page.free = FreeRanges(room);
      pages_.push_back(std::move(page));
    }
    const std::optional<uint32_t> first = pages_[p].free.take(records);
    if (!first) continue;
    chunk.page = p;
    chunk.first = *first;
    chunk.count = records;
    return {};
  }
}

world::Result<uint64_t> FacePool::update(gpu::Device& device, std::span<const PoolSource> chunks) {
  // Keep what is unchanged; free what changed or is gone. Both lists are sorted by position.
  std::vector<PooledChunk> next(chunks.size());
  std::vector<size_t> fresh;
  // What took the place of a chunk that was seen is drawn with what was seen, so that an edit costs no second pass.
  std::vector<bool> was_seen(chunks.size());
  uint64_t records = 0;
  size_t old = 0;
  for (size_t i = 0; i < chunks.size(); ++i) {
    while (old < chunks_.size() && chunks_[old].origin < chunks[i].origin) release(chunks_[old++]);
    if (old < chunks_.size() && chunks_[old].origin == chunks[i].origin) {
      if (chunks_[old].version == chunks[i].version) {
        next[i] = std::move(chunks_[old++]);
        continue;
      }
      was_seen[i] = std::any_of(chunks_[old].clusters.begin(), chunks_[old].clusters.end(),
                                [](const FaceCluster& c) { return c.visible(); });
      release(chunks_[old++]);
    }
    fresh.push_back(i);
    records += chunks[i].records.size();
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
      const PoolSource& source = chunks[i];
      PooledChunk& chunk = next[i];
      chunk.origin = source.origin;
      chunk.version = source.version;
      chunk.box = source.box;
      const uint32_t count = static_cast<uint32_t>(source.records.size());
      TRY_STATUS(place(device, count, chunk));
      largest_ = std::max(largest_, count);
      const uint64_t bytes = count * sizeof(FaceRecord);
      copies.push_back({chunk.page, {at, uint64_t{chunk.first} * sizeof(FaceRecord), bytes}});
      at += bytes;
    }
    world::parallel_ranges(fresh.size(), 1, [&](size_t begin, size_t end) {
      std::vector<FaceRecord> ordered;
      for (size_t n = begin; n < end; ++n) {
        PooledChunk& chunk = next[fresh[n]];
        write_clusters(chunks[fresh[n]], box_of_, chunk, ordered,
                       reinterpret_cast<FaceRecord*>(staging.mapped() + copies[n].region.srcOffset));
        if (was_seen[fresh[n]])
          for (FaceCluster& cluster : chunk.clusters) cluster.seen = kAllRecords;
      }
    });
    TRY_STATUS(device.run([&](VkCommandBuffer commands) {
      for (const Copy& copy : copies)
        vkCmdCopyBuffer(commands, staging.handle, pages_[copy.page].buffer.handle, 1, &copy.region);
    }));
  }
  chunks_ = std::move(next);
  return records * sizeof(FaceRecord);
}

}  // namespace render::raster
