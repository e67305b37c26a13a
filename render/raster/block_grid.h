/// The blocks of a world on the device, for rays that bend or are mirrored: a hash table of regions; for each its 4096
/// leaves, of one block or a place in a list of mixed ones; and 1 KiB a mixed leaf. Made where a picture traces rays.
///
///   regions  ivec4[]   position and place + 1; 0: free
///   leaves   uint[]    kLeafWords a region: which of its 64 groups of 4^3 leaves hold anything (2 words), then a word
///   a
///                      leaf: kBlockUniform | block, or the place of its ids
///   ids      uint[]    256 a mixed leaf, two ids a word
/// A leaf that opaque ones surround counts as one of its first voxel's block: no ray gets there.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <unordered_map>
#include <vector>

#include "render/gpu/owned.h"
#include "render/raster/transparency.shared.h"
#include "world/world.h"

namespace render::raster {

class BlockGrid {
 public:
  static constexpr uint32_t kLeafWords = 4096 + 2, kIdWords = 256;

  /// Brings the device up to date: `dirty` since the last call, of the same world; `whole` sends all of it. Returns the
  /// bytes sent. Fails where a buffer of the device can't hold the world.
  /// `code`: what is kept of a leaf in place of its blocks' ids; null: these.
  using LeafCodes = std::array<uint16_t, world::kLeafVoxels>;
  using CodeLeaf = std::function<void(world::StoreReader&, world::LeafPos, const world::LeafBlocks&, LeafCodes&)>;
  world::Result<uint64_t> follow(gpu::Device& device, const world::WorldView& view,
                                 std::span<const world::LeafPos> dirty, bool whole, const CodeLeaf& code = {});
  void clear() { *this = {}; }

  const gpu::Buffer& regions() const { return regions_; }
  const gpu::Buffer& leaves() const { return leaves_; }
  const gpu::Buffer& ids() const { return ids_; }
  world::RegionPos min_region() const { return min_; }
  world::RegionPos max_region() const { return max_; }
  uint32_t table_size() const { return table_size_; }
  bool empty() const { return !regions_.handle; }

 private:
  world::Result<uint64_t> rebuild(gpu::Device& device, const world::WorldView& view, const CodeLeaf& code);

  gpu::Buffer regions_, leaves_, ids_;
  std::unordered_map<world::RegionPos, uint32_t, world::PosHash> places_;
  std::unordered_map<world::LeafPos, uint32_t, world::PosHash> mixed_;  // place in `ids_`
  uint32_t used_ = 0, room_ = 0;                                        // mixed leaves
  world::RegionPos min_{0, 0, 0}, max_{-1, -1, -1};
  uint32_t table_size_ = 1;
};

}  // namespace render::raster
