/// Owns what is drawn of blocks that have a shape of their own (world/proxies): for each voxel of them the faces of its
/// shape, as records of 8 bytes in chunks like those of cubes, kept up to date leaf by leaf; and the masks of the world
/// without them, from which the faces of cubes are extracted. A world without such blocks costs a look at its census.
///
///   record   word 0  bits 0..17  place in the chunk, as in face_record.shared.h      word 1  quad of the table
/// A chunk's records lie direction by direction: faces that look along -X +X -Y +Y -Z +Z, then sheets that are seen
/// from both sides. Beside them a record a voxel, which names the first face of its shape.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "render/extract/greedy.h"
#include "render/knobs.h"
#include "world/proxies/proxy.h"
#include "world/world.h"

namespace render {

constexpr int kBothSides = world::kFaces;  // the direction of a sheet
constexpr int kShapeDirections = world::kFaces + 1;

/// A face of a shape, relative to its voxel's corner: corner + a u + b v, 0 <= a, b <= 1.
struct ShapeQuad {
  world::Vec3f corner, u, v;
  world::Vec3f normal;  // unit, u x v; out of a box
  world::BlockId block;
  int direction;       // a Face, or kBothSides
  float emission;      // of the block's radiance as a cube, so that all of the shape sends out the block's power
  uint32_t faces = 0;  // of the first of a shape: how many it has
};

struct ShapeChunk {
  ChunkPos pos;
  world::VoxelPos origin;
  uint64_t version = 0;
  std::vector<FaceRecord> records;
  std::array<uint32_t, kShapeDirections + 1> first{};  // records of direction f: [first[f], first[f + 1])
  CornerBox bounds;                                    // of the voxels
  std::vector<FaceRecord> instances;                   // a voxel each
};

class ShapeExtractor {
 public:
  ShapeExtractor();
  ~ShapeExtractor();

  /// Extracts everything. Fails where a block names a shape that there is none of.
  world::Status rebuild(const world::WorldView& view, ProxyShapes kind);
  /// Follows edits: `dirty` holds the leaves that changed. Equal to rebuild().
  world::Status update(const world::WorldView& view, std::span<const world::LeafPos> dirty);

  ProxyShapes kind() const { return kind_; }
  /// Whether any voxel has a shape that is drawn.
  bool any() const { return !chunks_.empty(); }
  /// Chunks with shapes, sorted by position.
  const std::vector<const ShapeChunk*>& chunks() const { return sorted_; }
  const std::vector<ShapeQuad>& quads() const { return quads_; }
  uint64_t instances() const { return instances_; }
  /// Of a block with these joins; UINT32_MAX: no voxel has had it.
  uint32_t first_quad(world::BlockId block, uint8_t joins) const {
    const auto found = kinds_.find({block, joins});
    return found == kinds_.end() ? UINT32_MAX : found->second.first;
  }
  /// The same of a voxel of that block; UINT32_MAX also where that has no shape.
  uint32_t first_quad_at(world::StoreReader& reader, world::VoxelPos voxel, world::BlockId block) const;
  /// The shapes of blocks, and how often all numbers of quads have changed.
  const world::BlockShapes& shapes() const { return shapes_; }
  uint64_t rebuilds() const { return rebuilds_; }

  /// The masks without shapes. The view's own where there are none.
  const world::MaskVolume& cubes_occupied(const world::WorldView& view) const {
    return any() ? occupied_ : view.masks(world::MaskKind::occupied);
  }
  const world::MaskVolume& cubes_opaque(const world::WorldView& view) const {
    return any() && any_opaque_ ? opaque_ : view.masks(world::MaskKind::opaque);
  }
  bool has_shape(world::VoxelPos v) const;

 private:
  struct Instance {
    uint16_t voxel;  // index_in_leaf
    world::BlockId block;
    uint8_t joins, hidden;  // hidden: bit f: what lies in the voxel's side f is covered by the cube beyond
  };
  using LeafShapes = std::vector<Instance>;
  struct Chunk;
  struct Kind {
    uint32_t first = 0, count = 0;  // quads
  };
  world::LeafMask scan(const world::LeafBlocks& blocks) const;
  LeafShapes shapes_of(world::StoreReader& reader, world::LeafPos leaf) const;
  Kind kind_of(const Instance& instance);
  void set_masks(const world::WorldView& view, world::LeafPos leaf, const world::LeafMask& shapes);
  void make_records(Chunk& chunk);
  void sort_chunks();

  ProxyShapes kind_ = ProxyShapes::cube;
  world::BlockShapes shapes_;
  bool any_opaque_ = false;  // some block with a shape is opaque
  world::MaskVolume occupied_, opaque_;
  std::unordered_map<ChunkPos, std::unique_ptr<Chunk>, world::PosHash> chunks_;
  std::vector<const ShapeChunk*> sorted_;
  std::vector<ShapeQuad> quads_;
  std::map<std::pair<world::BlockId, uint8_t>, Kind> kinds_;
  uint64_t next_version_ = 1, instances_ = 0, rebuilds_ = 0;
};

}  // namespace render
