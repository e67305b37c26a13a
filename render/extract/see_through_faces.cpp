#include "render/extract/see_through_faces.h"

#include <algorithm>
#include <array>

#include "render/extract/kernels.h"
#include "render/extract/unit_faces.h"
#include "world/base/jobs.h"

namespace render {

using namespace world;

namespace {

constexpr int kStep[3] = {64, 8, 1};

LeafPos beside(LeafPos l, int face) {
  const VoxelPos s = face_step(face);
  return {l.x + s.x, l.y + s.y, l.z + s.z};
}

/// Collects the unit faces of a chunk.
class Collector {
 public:
  Collector(const WorldView& view, const SeeThroughKinds& kinds, const LiquidLevels* levels)
      : levels_(levels && levels->any() ? levels : nullptr),
        occupied_(view.masks(MaskKind::occupied)),
        opaque_(view.masks(MaskKind::opaque)),
        palette_(view.palette()),
        kinds_(kinds),
        reader_(view.store()) {}

  void collect(ChunkPos chunk, std::vector<UnitFace>& out) {
    for (int index = 0; index < kLeavesPerChunk; ++index) {
      const LeafPos leaf = leaf_in_chunk(chunk, index);
      const LeafMask& occupied = occupied_.leaf(leaf);
      if (occupied.is_none() || opaque_.leaf(leaf) == occupied) continue;
      collect_leaf(leaf, offset_in_leaf(index), out);
    }
  }

 private:
  void collect_leaf(LeafPos leaf, VoxelPos leaf_offset, std::vector<UnitFace>& out) {
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
    if (levels_ && near_levels(leaf)) return collect_parts(leaf, leaf_offset, self, see, next, out);
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

  bool near_levels(LeafPos leaf) const {
    bool any = levels_->leaf(leaf) != nullptr;
    for (int f = 0; f < kFaces; ++f) any |= levels_->leaf(beside(leaf, f)) != nullptr;
    return any;
  }

  /// The same where a liquid of the leaf, or of one beside it, ends within its voxel: above it is air.
  void collect_parts(LeafPos leaf, VoxelPos leaf_offset, const LeafBlocks& self, const LeafMask& see,
                     const LeafBlocks (&next)[kFaces], std::vector<UnitFace>& out) {
    const LiquidLevels::Leaf* const own_levels = levels_->leaf(leaf);
    const LiquidLevels::Leaf* next_levels[kFaces];
    for (int f = 0; f < kFaces; ++f) next_levels[f] = levels_->leaf(beside(leaf, f));
    const auto level_at = [](const LiquidLevels::Leaf* levels, int i) {
      return levels ? (*levels)[static_cast<size_t>(i)] : static_cast<uint8_t>(kFullLevel);
    };
    for (int x = 0; x < 8; ++x)
      for (uint64_t bits = see.word[x]; bits != 0; bits &= bits - 1) {
        const int i = x << 6 | __builtin_ctzll(bits);
        const VoxelPos v = offset_in_leaf(i);
        const BlockId own = self[i];
        const uint8_t level = level_at(own_levels, i);
        for (int f = 0; f < kFaces; ++f) {
          const int axis = face_axis(f), step = kStep[axis] * face_sign(f), border = face_sign(f) > 0 ? 7 : 0;
          const bool leaves = v[axis] == border;
          const int there = leaves ? i + step - 8 * step : i + step;
          const BlockId other = leaves ? next[f][there] : self[there];
          uint8_t other_level = level_at(leaves ? next_levels[f] : own_levels, there);
          const PlaneAxes& axes = kPlaneAxes[axis];
          const auto at = [&](int a) { return static_cast<uint8_t>(leaf_offset[a] * 8 + v[a]); };
          UnitFace unit{kinds_.kind(own), static_cast<uint8_t>(f), at(axes.plane), at(axes.row), at(axes.bit)};
          const bool open =
              other == kAir || (!kinds_.contains(other) && !palette_[other].opaque && !palette_[other].proxy.empty());
          if (open || (f == kFacePosY && level < kFullLevel) || (f == kFaceNegY && other_level < kFullLevel))
            other_level = 0;
          unit.top = level;
          if (axis == 1) {
            if (f == kFaceNegY) unit.top = kFullLevel;  // a bottom lies on the grid
            if (other_level == 0) {
              out.push_back(unit);
              continue;
            }
            other_level = kFullLevel;
          }
          // Up to where both are there, and then what stands above the other.
          const uint32_t beyond = other_level > 0 ? kinds_.kind(other) : 0;
          if (beyond && own > other) {
            UnitFace both = unit;
            both.key |= beyond << 16;
            both.top = std::min(unit.top, other_level);
            out.push_back(both);
          }
          if (axis != 1 && level > other_level) {
            unit.bottom = other_level;
            unit.again = other_level > 0;
            out.push_back(unit);
          }
        }
      }
  }

  const LiquidLevels* levels_;  // null: all liquids are full
  const MaskVolume &occupied_, &opaque_;
  const BlockPalette& palette_;
  const SeeThroughKinds& kinds_;
  StoreReader reader_;
};

void make_records(std::vector<UnitFace>& units, bool merge_faces, ChunkRecords& out) {
  const auto name = [](uint32_t key, uint32_t upper) { return (key & 0xffff) | upper << 12 | (key >> 16) << 19; };
  merge_units(units, merge_faces, name, out);
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

void SeeThroughFaces::rebuild(const WorldView& view, const SeeThroughKinds& kinds, bool merge_faces,
                              const LiquidLevels* levels) {
  merge_ = merge_faces;
  const std::vector<ChunkPos> positions = occupied_chunks(view.masks(MaskKind::occupied));
  view.masks(MaskKind::opaque);  // made before threads ask
  std::vector<std::unique_ptr<ExtractedChunk>> made(positions.size());
  parallel_ranges(positions.size(), 8, [&](size_t begin, size_t end) {
    Collector collector(view, kinds, levels);
    std::vector<UnitFace> units;
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

void SeeThroughFaces::update(const WorldView& view, const SeeThroughKinds& kinds, std::span<const LeafPos> dirty,
                             const LiquidLevels* levels) {
  if (dirty.empty()) return;
  std::vector<ChunkPos> positions;
  for (const LeafPos leaf : dirty) {
    positions.push_back(chunk_from_leaf(leaf));
    for (int f = 0; f < kFaces; ++f) positions.push_back(chunk_from_leaf(beside(leaf, f)));
  }
  std::sort(positions.begin(), positions.end());
  positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
  view.masks(MaskKind::occupied), view.masks(MaskKind::opaque);
  std::vector<std::vector<UnitFace>> units(positions.size());
  parallel_for(positions.size(), [&](size_t i) { Collector(view, kinds, levels).collect(positions[i], units[i]); });
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
