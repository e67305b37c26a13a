#include "render/raster/tree_pool.h"

#include <array>
#include <deque>
#include <utility>

#include "world/blocks/block.h"
#include "world/blocks/block_texture.h"

namespace render::raster {

namespace {

/// A chunk's records of one kind.
struct Part {
  std::vector<FaceRecord> records;
  std::array<uint32_t, kPoolDirections + 1> first{};
  CornerBox box;

  void add(const FaceRecord& record) {
    records.push_back(record);
    box.include(FacePool::box_of_face(record));
  }
  PoolSource source(const ExtractedChunk& chunk) const { return {chunk.origin, chunk.version, records, first, box}; }
};

}  // namespace

std::vector<bool> tree_blocks(const world::BlockPalette& palette) {
  std::vector<bool> is_tree(palette.size());
  for (size_t id = 0; id < is_tree.size(); ++id) {
    const std::string& name = palette[static_cast<world::BlockId>(id)].name;
    const world::BlockTexture* texture = world::block_texture(name);
    is_tree[id] = (texture && texture->kind == "leaves") || name.ends_with("_log");
  }
  return is_tree;
}

world::Result<uint64_t> TreePool::update(gpu::Device& device, std::span<const ExtractedChunk* const> chunks,
                                         const std::vector<bool>& is_tree, FacePool& others) {
  // A chunk that the pools hold is known by its version; of the others each part is made.
  std::deque<Part> parts;
  std::vector<PoolSource> trees, rest;
  std::unordered_map<world::VoxelPos, Records, world::PosHash> next;
  bool changed = chunks.size() != chunks_.size();
  const auto known_part = [&](const ExtractedChunk& chunk) {
    return PoolSource{chunk.origin, chunk.version, {}, {}, {}};
  };
  for (const ExtractedChunk* chunk : chunks) {
    const auto known = chunks_.find(chunk->origin);
    if (known != chunks_.end() && known->second.version == chunk->version) {
      const bool all = known->second.records.size() == chunk->records.size();
      if (!known->second.records.empty()) trees.push_back(known_part(*chunk));
      if (!all) rest.push_back(known_part(*chunk));
      next.emplace(chunk->origin, std::move(known->second));
      continue;
    }
    changed = true;
    Part &tree = parts.emplace_back(), &other = parts.emplace_back();
    for (int direction = 0; direction < world::kFaces; ++direction) {
      for (const FaceRecord& record : chunk->of_direction(direction))
        (is_tree[face_block(record.word1)] ? tree : other).add(record);
      for (Part* part : {&tree, &other})
        for (size_t d = static_cast<size_t>(direction) + 1; d < part->first.size(); ++d)
          part->first[d] = static_cast<uint32_t>(part->records.size());
    }
    if (!tree.records.empty()) trees.push_back(tree.source(*chunk));
    if (!other.records.empty()) rest.push_back(other.source(*chunk));
    next.emplace(chunk->origin, Records{chunk->version, tree.records});
  }
  chunks_ = std::move(next);
  if (changed) ++version_;
  TRY(const uint64_t of_others, others.update(device, rest));
  TRY(const uint64_t of_trees, pool_.update(device, trees));
  return of_others + of_trees;
}

void TreePool::clear() {
  pool_.clear();
  chunks_.clear();
  ++version_;
}

const TreePool::Records* TreePool::find(world::VoxelPos origin) const {
  const auto found = chunks_.find(origin);
  return found == chunks_.end() || found->second.records.empty() ? nullptr : &found->second;
}

}  // namespace render::raster
