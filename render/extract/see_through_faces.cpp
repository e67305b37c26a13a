#include "render/extract/see_through_faces.h"

#include <algorithm>
#include <array>

#include "render/extract/kernels.h"
#include "world/base/jobs.h"

namespace render {

using namespace world;

namespace {

/// One unit face, by its voxel in the chunk. key: kind of the block, and of what lies beyond in the upper half.
struct Unit {
  uint32_t key;
  uint8_t face, plane, row, bit;
};

constexpr int kStep[3] = {64, 8, 1};

LeafPos beside(LeafPos l, int face) {
  const VoxelPos s = face_step(face);
  return {l.x + s.x, l.y + s.y, l.z + s.z};
}

/// Collects the unit faces of a chunk.
class Collector {
 public:
  Collector(const WorldView& view, const SeeThroughKinds& kinds)
      : occupied_(view.masks(MaskKind::occupied)),
        opaque_(view.masks(MaskKind::opaque)),
        palette_(view.palette()),
        kinds_(kinds),
        reader_(view.store()) {}

  void collect(ChunkPos chunk, std::vector<Unit>& out) {
    for (int index = 0; index < kLeavesPerChunk; ++index) {
      const LeafPos leaf = leaf_in_chunk(chunk, index);
      const LeafMask& occupied = occupied_.leaf(leaf);
      if (occupied.is_none() || opaque_.leaf(leaf) == occupied) continue;
      collect_leaf(leaf, offset_in_leaf(index), out);
    }
  }

 private:
  void collect_leaf(LeafPos leaf, VoxelPos leaf_offset, std::vector<Unit>& out) {
    const LeafBlocks self = reader_.leaf(leaf);
    LeafMask see = kNoneMask;
    if (!self.values) {
      if (!kinds_.contains(self.uniform)) return;
      see = kAllMask;
    } else {
      for (int i = 0; i < kLeafVoxels; ++i)
        if (kinds_.contains(self.values[i])) see.set(i);
      if (see.is_none()) return;
    }
    LeafBlocks next[kFaces];
    for (int f = 0; f < kFaces; ++f) next[f] = reader_.leaf(beside(leaf, f));
    // Most voxels touch their own kind: those are left out many at a time.
    LeafMask equal[3] = {};
    if (self.values) {
      const BlockId* const ids[3] = {next[1].values, next[3].values, next[5].values};
      equal_neighbours(self.values, ids, equal);
    }
    for (int f = 0; f < kFaces; ++f) {
      if (!self.values && !next[f].values && self.uniform == next[f].uniform) continue;
      const int axis = face_axis(f), step = kStep[axis] * face_sign(f), border = face_sign(f) > 0 ? 7 : 0;
      for (int x = 0; x < 8; ++x) {
        if (!self.values && axis == 0 && x != border) continue;
        uint64_t bits = see.word[x];
        if (self.values && face_sign(f) > 0) bits &= ~equal[axis].word[x];
        for (; bits != 0; bits &= bits - 1) {
          const int i = x << 6 | __builtin_ctzll(bits);
          const VoxelPos v = offset_in_leaf(i);
          const bool leaves = v[axis] == border;
          if (!self.values && !leaves) continue;
          const BlockId own = self[i], other = leaves ? next[f][i + step - 8 * step] : self[i + step];
          if (own == other) continue;
          uint32_t beyond = 0;
          if (other != kAir) {
            beyond = kinds_.kind(other);
            if (beyond ? own < other : palette_[other].opaque || palette_[other].proxy.empty()) continue;
          }
          const PlaneAxes& axes = kPlaneAxes[axis];
          const auto at = [&](int a) { return static_cast<uint8_t>(leaf_offset[a] * 8 + v[a]); };
          out.push_back(
              {kinds_.kind(own) | beyond << 16, static_cast<uint8_t>(f), at(axes.plane), at(axes.row), at(axes.bit)});
        }
      }
    }
  }

  const MaskVolume &occupied_, &opaque_;
  const BlockPalette& palette_;
  const SeeThroughKinds& kinds_;
  StoreReader reader_;
};

/// Merges the faces of one plane to rectangles: runs along the bits, each followed down the rows while all of it goes
/// on.
class PlaneMerger {
 public:
  void merge(std::span<const Unit> units, bool merge_faces, ChunkRecords& out) {
    const int face = units[0].face;
    const PlaneAxes& axes = kPlaneAxes[face_axis(face)];
    for (const Unit& u : units) grid_[u.row][u.bit] = u.key;
    for (const Unit& u : units) {
      const uint32_t key = grid_[u.row][u.bit];
      if (!key) continue;
      uint32_t width = 1, height = 1;
      if (merge_faces) {
        while (u.bit + width < kChunkSize && grid_[u.row][u.bit + width] == key) ++width;
        const auto goes_on = [&](uint32_t row) {
          for (uint32_t b = 0; b < width; ++b)
            if (grid_[row][u.bit + b] != key) return false;
          return true;
        };
        while (u.row + height < kChunkSize && goes_on(u.row + height)) ++height;
      }
      for (uint32_t r = 0; r < height; ++r)
        for (uint32_t b = 0; b < width; ++b) grid_[u.row + r][u.bit + b] = 0;
      uint32_t low[3], high[3];
      low[axes.plane] = u.plane, low[axes.row] = u.row, low[axes.bit] = u.bit;
      high[axes.plane] = u.plane, high[axes.row] = u.row + height, high[axes.bit] = u.bit + width;
      FaceRecord record =
          make_face_record(low[0], low[1], low[2], width, height, static_cast<uint32_t>(face), key & 0xffff);
      record.word1 |= (key >> 16) << 19;
      out.records.push_back(record);
      CornerBox& box = out.bounds[static_cast<size_t>(face)];
      for (size_t a = 0; a < 3; ++a) {
        const bool own = static_cast<int>(a) == axes.plane;
        const uint32_t out_of = own ? static_cast<uint32_t>(face & 1) : 0;
        box.min[a] = static_cast<uint8_t>(std::min<uint32_t>(box.min[a], low[a] + out_of));
        box.max[a] = static_cast<uint8_t>(std::max<uint32_t>(box.max[a], high[a] + out_of));
      }
    }
  }

 private:
  uint32_t grid_[kChunkSize][kChunkSize] = {};  // zero between planes
};

void make_records(std::vector<Unit>& units, bool merge_faces, ChunkRecords& out) {
  std::sort(units.begin(), units.end(), [](const Unit& a, const Unit& b) {
    return std::tie(a.face, a.plane, a.row, a.bit) < std::tie(b.face, b.plane, b.row, b.bit);
  });
  out.records.clear();
  out.bounds = {};
  out.all_bounds = {};
  out.faces = units.size();
  thread_local PlaneMerger merger;
  size_t begin = 0;
  for (size_t f = 0; f < kFaces; ++f) {
    out.first[f] = static_cast<uint32_t>(out.records.size());
    while (begin < units.size() && units[begin].face == f) {
      size_t end = begin;
      while (end < units.size() && units[end].face == f && units[end].plane == units[begin].plane) ++end;
      merger.merge({units.data() + begin, end - begin}, merge_faces, out);
      begin = end;
    }
    if (!out.bounds[f].empty()) out.all_bounds.include(out.bounds[f]);
  }
  out.first[kFaces] = static_cast<uint32_t>(out.records.size());
}

}  // namespace

void SeeThroughFaces::sort_chunks() {
  sorted_.clear();
  faces_ = quads_ = 0;
  for (const auto& [pos, chunk] : chunks_) {
    sorted_.push_back(chunk.get());
    faces_ += chunk->faces, quads_ += chunk->records.size();
  }
  std::sort(sorted_.begin(), sorted_.end(), [](auto* a, auto* b) { return a->pos < b->pos; });
}

void SeeThroughFaces::clear() {
  chunks_.clear();
  sort_chunks();
}

void SeeThroughFaces::rebuild(const WorldView& view, const SeeThroughKinds& kinds, bool merge_faces) {
  merge_ = merge_faces;
  const std::vector<ChunkPos> positions = occupied_chunks(view.masks(MaskKind::occupied));
  view.masks(MaskKind::opaque);  // made before threads ask
  std::vector<std::unique_ptr<ExtractedChunk>> made(positions.size());
  parallel_ranges(positions.size(), 8, [&](size_t begin, size_t end) {
    Collector collector(view, kinds);
    std::vector<Unit> units;
    for (size_t i = begin; i < end; ++i) {
      units.clear();
      collector.collect(positions[i], units);
      if (units.empty()) continue;
      made[i] = std::make_unique<ExtractedChunk>();
      made[i]->pos = positions[i];
      made[i]->origin = voxel_from_chunk(positions[i]);
      make_records(units, merge_, *made[i]);
    }
  });
  chunks_.clear();
  for (size_t i = 0; i < made.size(); ++i) {
    if (!made[i]) continue;
    made[i]->version = next_version_++;
    chunks_.emplace(positions[i], std::move(made[i]));
  }
  sort_chunks();
}

void SeeThroughFaces::update(const WorldView& view, const SeeThroughKinds& kinds, std::span<const LeafPos> dirty) {
  if (dirty.empty()) return;
  std::vector<ChunkPos> positions;
  for (const LeafPos leaf : dirty) {
    positions.push_back(chunk_from_leaf(leaf));
    for (int f = 0; f < kFaces; ++f) positions.push_back(chunk_from_leaf(beside(leaf, f)));
  }
  std::sort(positions.begin(), positions.end());
  positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
  view.masks(MaskKind::occupied), view.masks(MaskKind::opaque);
  std::vector<std::vector<Unit>> units(positions.size());
  parallel_for(positions.size(), [&](size_t i) { Collector(view, kinds).collect(positions[i], units[i]); });
  for (size_t i = 0; i < positions.size(); ++i) {
    const auto found = chunks_.find(positions[i]);
    if (units[i].empty()) {
      if (found != chunks_.end()) chunks_.erase(found);
      continue;
    }
    ChunkRecords records;
    make_records(units[i], merge_, records);
    if (found != chunks_.end() && found->second->records == records.records) continue;
    auto chunk = std::make_unique<ExtractedChunk>();
    static_cast<ChunkRecords&>(*chunk) = std::move(records);
    chunk->pos = positions[i];
    chunk->origin = voxel_from_chunk(positions[i]);
    chunk->version = next_version_++;
    chunks_[positions[i]] = std::move(chunk);
  }
  sort_chunks();
}

size_t SeeThroughFaces::bytes() const {
  size_t total = sorted_.capacity() * sizeof(sorted_[0]);
  for (const ExtractedChunk* chunk : sorted_)
    total += sizeof(ExtractedChunk) + chunk->records.capacity() * sizeof(FaceRecord);
  return total;
}

}  // namespace render
