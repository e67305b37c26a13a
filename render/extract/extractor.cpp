#include "render/extract/extractor.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/extract/cavities.h"
#include "render/extract/proxies.h"
#include "world/base/jobs.h"
#include "world/store/leaf_copy.h"

namespace render {

using namespace world;

double ChunkRange::distance(ChunkPos c) const {
  double squared = 0;
  for (int a = 0; a < 3; ++a) {
    const double between = std::max<double>(std::abs(double(c[a]) - centre[a]) - 1, 0) * kChunkSize;
    squared += between * between;
  }
  return std::sqrt(squared);
}

struct Extractor::Chunk : ExtractedChunk {
  ChunkFaces by_leaf;
  bool has_parts = false;  // some records are of liquids that end within their voxels
};

Extractor::Extractor() = default;
Extractor::~Extractor() = default;

/// The masks without shapes.
const MaskVolume& Extractor::cubes(const WorldView& view, MaskKind kind) const {
  if (!shapes) return view.masks(kind);
  return kind == MaskKind::occupied ? shapes->cubes_occupied(view) : shapes->cubes_opaque(view);
}

FaceSource Extractor::source(const WorldView& view) {
  const MaskVolume& occupied = parts_.any() ? parts_.occupied() : cubes(view, MaskKind::occupied);
  const MaskVolume& opaque = parts_.any() ? parts_.opaque() : cubes(view, MaskKind::opaque);
  kinds_.reset();
  if (knobs_.see_through) kinds_.emplace(view.palette());
  return {&view.store(), &occupied, &opaque, knobs_.sealed_cavities ? nullptr : &sealed_,
          kinds_ ? kinds_->flags() : std::span<const uint8_t>()};
}

void Extractor::make_records(const WorldView& view, Chunk& chunk) const {
  thread_local std::vector<LeafBlocks> blocks;
  thread_local std::vector<std::array<BlockId, kLeafVoxels>> room;
  blocks.resize(chunk.by_leaf.leaf.size());
  if (room.size() < blocks.size()) room.resize(blocks.size());
  LeafCopies leaves(view.store());
  for (size_t i = 0; i < blocks.size(); ++i)
    blocks[i] = leaves.leaf(leaf_in_chunk(chunk.pos, chunk.by_leaf.leaf[i]), room[i]);
  if (knobs_.merge_faces) {
    render::merge_faces(chunk.by_leaf, blocks, chunk);
  } else {
    list_faces(chunk.by_leaf, blocks, chunk);
  }
  chunk.has_parts = parts_.any() && parts_.in_chunk(view, chunk.pos);
  if (chunk.has_parts) parts_.add_faces(view, chunk.pos, knobs_.merge_faces, chunk);
}

void Extractor::sort_chunks() {
  sorted_.clear();
  for (const auto& [pos, chunk] : chunks_) sorted_.push_back(chunk.get());
  std::sort(sorted_.begin(), sorted_.end(), [](auto* a, auto* b) { return a->pos < b->pos; });
}

ExtractReport Extractor::report(uint64_t leaves_extracted, uint64_t chunks_merged) const {
  return {leaves_extracted, chunks_merged, chunks_.size(), faces_, quads_};
}

/// Occupied chunks that the range needs and that aren't held, sorted.
std::vector<ChunkPos> Extractor::missing(const MaskVolume& occupied) const {
  std::vector<ChunkPos> all = occupied_chunks(occupied);
  if (range_.everything()) return all;
  std::erase_if(all, [&](ChunkPos c) { return !range_.needs(c) || held_.contains(c); });
  return all;
}

/// Returns how many leaves it looked at one by one.
uint64_t Extractor::extract(const WorldView& view, const FaceSource& from, std::span<const ChunkPos> positions) {
  std::vector<std::unique_ptr<Chunk>> made(positions.size());
  std::vector<uint64_t> leaves(positions.size());
  parallel_ranges(positions.size(), 8, [&](size_t begin, size_t end) {
    StoreReader reader(view.store());
    ChunkFaces faces;
    for (size_t i = begin; i < end; ++i) {
      leaves[i] = extract_chunk_faces(from, &reader, positions[i], faces);
      if (faces.empty() && !parts_.in_chunk(view, positions[i])) continue;
      if (knobs_.skirts)
        for (size_t l = 0; l < faces.leaf.size(); ++l)
          add_skirts(*from.opaque, leaf_in_chunk(positions[i], faces.leaf[l]), faces.faces[l]);
      made[i] = std::make_unique<Chunk>();
      made[i]->pos = positions[i];
      made[i]->origin = voxel_from_chunk(positions[i]);
      ChunkFaces& kept = made[i]->by_leaf;
      kept.slot = faces.slot, kept.leaf = faces.leaf;
      kept.faces.assign(faces.faces.begin(), faces.faces.begin() + static_cast<std::ptrdiff_t>(faces.leaf.size()));
      make_records(view, *made[i]);
    }
  });
  uint64_t leaves_extracted = 0;
  for (size_t i = 0; i < made.size(); ++i) {
    leaves_extracted += leaves[i];
    if (!range_.everything()) held_.insert(positions[i]);
    if (!made[i]) continue;
    made[i]->version = next_version_++;
    faces_ += made[i]->faces, quads_ += made[i]->records.size();
    chunks_.emplace(positions[i], std::move(made[i]));
  }
  return leaves_extracted;
}

ExtractReport Extractor::rebuild(const WorldView& view, const ExtractKnobs& knobs, const ChunkRange& range) {
  knobs_ = knobs;
  range_ = range;
  kinds_.reset();
  if (knobs.see_through) kinds_.emplace(view.palette());
  parts_.rebuild(view, levels, kinds_ ? &*kinds_ : nullptr, cubes(view, MaskKind::occupied),
                 cubes(view, MaskKind::opaque));
  sealed_ = knobs.sealed_cavities ? MaskVolume() : find_sealed_cavities(*source(view).opaque);
  const FaceSource from = source(view);
  chunks_.clear();
  held_.clear();
  faces_ = quads_ = 0;
  const uint64_t leaves_extracted = extract(view, from, missing(cubes(view, MaskKind::occupied)));
  sort_chunks();
  return report(leaves_extracted, chunks_.size());
}

ExtractReport Extractor::follow(const WorldView& view, const ChunkRange& range) {
  if (range == range_) return report(0, 0);
  if (range.everything() || range_.everything()) {
    // What is held isn't noted where that is everything.
    held_.clear();
    if (range.everything()) chunks_.clear(), faces_ = quads_ = 0;
    for (const auto& [pos, chunk] : chunks_) held_.insert(pos);
  }
  range_ = range;
  const size_t before = chunks_.size();
  std::erase_if(held_, [&](ChunkPos c) { return !range_.keeps(c); });
  std::erase_if(chunks_, [&](const auto& entry) {
    if (range_.keeps(entry.first)) return false;
    faces_ -= entry.second->faces, quads_ -= entry.second->records.size();
    return true;
  });
  const size_t kept = chunks_.size();
  const FaceSource from = source(view);
  const uint64_t leaves_extracted = extract(view, from, missing(cubes(view, MaskKind::occupied)));
  if (kept != before || chunks_.size() != kept) sort_chunks();
  return report(leaves_extracted, chunks_.size() - kept);
}

ExtractReport Extractor::update(const WorldView& view, std::span<const LeafPos> changed_blocks,
                                std::span<const LeafPos> moved) {
  std::vector<LeafPos> dirty(changed_blocks.begin(), changed_blocks.end());
  if (!moved.empty()) {
    const std::vector<LeafPos> more = parts_.concerned(view, moved);
    dirty.insert(dirty.end(), more.begin(), more.end());
    std::sort(dirty.begin(), dirty.end());
    dirty.erase(std::unique(dirty.begin(), dirty.end()), dirty.end());
  }
  if (dirty.empty()) return report(0, 0);
  if (!parts_.update(view, dirty, cubes(view, MaskKind::occupied), cubes(view, MaskKind::opaque)))
    return rebuild(view, knobs_, range_);
  const FaceSource from = source(view);
  // Leaves whose faces may have changed, chunk by chunk: the changed ones and their face neighbours. The flag says that
  // the blocks themselves may have changed.
  struct Task {
    ChunkPos chunk;
    LeafPos leaf;
    bool blocks_changed;
  };
  std::vector<Task> tasks;
  const auto add = [&](LeafPos l, bool blocks_changed) {
    tasks.push_back({chunk_from_leaf(l), l, blocks_changed});
    for (int f = 0; f < kFaces; ++f) {
      const VoxelPos s = face_step(f);
      const LeafPos n{l.x + s.x, l.y + s.y, l.z + s.z};
      tasks.push_back({chunk_from_leaf(n), n, false});
    }
  };
  // Others are extracted as they are once the range needs them. One that it needs and that isn't held was air.
  const auto is_held = [&](ChunkPos c) {
    if (range_.everything() || held_.contains(c)) return true;
    if (range_.needs(c)) held_.insert(c);
    return range_.needs(c);
  };
  for (const LeafPos l : dirty) add(l, true);
  if (!knobs_.sealed_cavities)
    for (const LeafPos l : reopen_cavities(sealed_, *from.opaque, dirty)) add(l, false);
  std::erase_if(tasks, [&](const Task& task) { return !is_held(task.chunk); });
  std::sort(tasks.begin(), tasks.end(), [](const Task& a, const Task& b) {
    return std::tie(a.chunk, a.leaf, b.blocks_changed) < std::tie(b.chunk, b.leaf, a.blocks_changed);
  });
  tasks.erase(std::unique(tasks.begin(), tasks.end(), [](const Task& a, const Task& b) { return a.leaf == b.leaf; }),
              tasks.end());
  std::vector<size_t> begins;
  std::vector<Chunk*> chunks;
  for (size_t i = 0; i < tasks.size(); ++i) {
    if (i > 0 && tasks[i].chunk == tasks[i - 1].chunk) continue;
    begins.push_back(i);
    std::unique_ptr<Chunk>& chunk = chunks_[tasks[i].chunk];
    if (!chunk) {
      chunk = std::make_unique<Chunk>();
      chunk->pos = tasks[i].chunk;
      chunk->origin = voxel_from_chunk(chunk->pos);
    }
    faces_ -= chunk->faces, quads_ -= chunk->records.size();
    chunks.push_back(chunk.get());
  }
  begins.push_back(tasks.size());

  std::vector<uint8_t> merged(chunks.size());
  parallel_for(chunks.size(), [&](size_t c) {
    StoreReader reader(view.store());
    Chunk& chunk = *chunks[c];
    bool changed = false;
    for (size_t i = begins[c]; i < begins[c + 1]; ++i) {
      const int index = index_in_chunk(tasks[i].leaf);
      LeafFaces faces = extract_leaf_faces(from, &reader, tasks[i].leaf);
      if (knobs_.skirts) add_skirts(*from.opaque, tasks[i].leaf, faces);
      changed |= chunk.by_leaf.set(index, faces);
      changed |= tasks[i].blocks_changed && chunk.by_leaf.find(index);
    }
    // A part's sides depend on what stands beside it.
    changed |= parts_.any() && (chunk.has_parts || parts_.in_chunk(view, chunk.pos));
    if (!changed) return;
    merged[c] = 1;
    make_records(view, chunk);
  });

  uint64_t chunks_merged = 0;
  bool set_changed = false;
  for (size_t c = 0; c < chunks.size(); ++c) {
    Chunk& chunk = *chunks[c];
    faces_ += chunk.faces, quads_ += chunk.records.size();
    if (merged[c]) {
      ++chunks_merged;
      set_changed |= chunk.version == 0;
      chunk.version = next_version_++;
    }
    if (chunk.records.empty()) {
      set_changed |= chunk.version != 0;
      chunks_.erase(chunk.pos);
    }
  }
  if (set_changed) sort_chunks();
  return report(tasks.size(), chunks_merged);
}

size_t Extractor::bytes() const {
  size_t total = sealed_.bytes() + parts_.bytes() + sorted_.capacity() * sizeof(sorted_[0]);
  for (const auto& [pos, chunk] : chunks_)
    total += sizeof(Chunk) + chunk->records.capacity() * sizeof(FaceRecord) +
             chunk->by_leaf.leaf.capacity() * sizeof(uint16_t) + chunk->by_leaf.faces.capacity() * sizeof(LeafFaces);
  return total;
}

}  // namespace render
