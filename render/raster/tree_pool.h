/// What of a world's faces belongs to trees, in a pool of its own, so that something else can be drawn in its place.
/// Its records are kept on the processor too. Nothing is split where nobody asks for it.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "render/extract/extractor.h"
#include "render/raster/face_pool.h"

namespace world {
class BlockPalette;
}

namespace render::raster {

/// By block: whether it is part of a tree, as leaves and logs are.
std::vector<bool> tree_blocks(const world::BlockPalette& palette);

class TreePool {
 public:
  struct Records {
    uint64_t version = 0;
    std::vector<FaceRecord> records;  // direction by direction
  };
  /// Follows the extractor's chunks and sends what is new. `others` gets all that is no part of a tree.
  world::Result<uint64_t> update(gpu::Device& device, std::span<const ExtractedChunk* const> chunks,
                                 const std::vector<bool>& is_tree, FacePool& others);
  void clear();

  FacePool& pool() { return pool_; }
  /// Null: no trees there.
  const Records* find(world::VoxelPos origin) const;
  /// Differs after each update that changed anything.
  uint64_t version() const { return version_; }

 private:
  FacePool pool_;
  std::unordered_map<world::VoxelPos, Records, world::PosHash> chunks_;  // without records where there is no tree
  uint64_t version_ = 0;
};

}  // namespace render::raster
