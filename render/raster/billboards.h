/// Billboard clouds of trees that are far: made from the records of TreePool, shared by trees of the same shape, drawn
/// in place of the trees' faces. As impostors they show blocks and places, not colours, but from any direction. A part
/// of FacesPass.
///
///   texels: [front, back of plane 0][front, back of plane 1] ...  of all clouds, laid out anew where one comes or goes
///
/// A chunk's trees are drawn as clouds of the largest error that the knob allows at its distance. In a picture few are
/// made; until then their faces are drawn. An edit of a chunk makes its trees' clouds anew; one that no tree has goes.
///
/// error  at most billboard_error_px, of where points of faces are: cloud_error(). Shadows and light are those of the
///        point that a pixel is given.
#pragma once

#include <array>
#include <map>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "render/extract/billboard_cloud.h"
#include "render/raster/billboards.shared.h"
#include "render/raster/culling.h"
#include "render/raster/pass.h"
#include "render/raster/tree_pool.h"

namespace render::raster {

class Billboards {
 public:
  static bool called_for(const Drawing& drawing) {
    return drawing.knobs.billboard_error_px > 0 && !drawing.bare && !drawing.behind;
  }
  /// Marks the chunks of trees that clouds draw, and makes some of them.
  void choose(PassContext& context, const Drawing& drawing, std::span<SeenChunk> seen);
  /// Once the list is made. blends: some chunk is drawn in part.
  world::Status prepare(PassContext& context, bool blends);
  /// Row "billboards" of the report. Draws beside what faces have drawn. indices: of `rectangles`.
  void record(VkCommandBuffer commands, PassContext& context, const gpu::Buffer& indices, uint32_t rectangles);
  void finish(FrameReport& report);
  /// Gives all memory back.
  void rest();

  bool any() const { return !drawn_.empty(); }
  /// Records of the faces that clouds stand for in the picture.
  uint64_t faces() const { return faces_; }
  /// Bytes on the device.
  uint64_t bytes() const;

 private:
  using Key = std::array<uint64_t, 3>;  // hash of the tree's faces, in two parts; place of its error
  struct Cloud {
    BillboardCloud cloud;
    uint32_t trees = 0;        // that have it
    uint32_t first_plane = 0;  // once laid out
  };
  struct Tree {
    glm::ivec3 low;
    Key cloud;
  };
  struct Chunk {
    uint64_t version = 0;
    size_t error = 0;
    std::vector<Tree> trees;
  };
  struct Drawn {
    const Chunk* chunk;
    ivec4 corner;  // relative to the camera; see kChunkLevel
  };
  void drop(Chunk& chunk);
  void drop_gone(const TreePool& trees);
  bool make(Chunk& chunk, const TreePool::Records& records, size_t error, size_t most_texels);
  world::Status lay_out(PassContext& context);

  std::map<Key, Cloud> clouds_;
  std::unordered_map<world::VoxelPos, Chunk, world::PosHash> chunks_;
  uint64_t trees_version_ = 0;
  size_t texels_held_ = 0;  // of all clouds

  // Of the picture at hand.
  std::vector<Drawn> drawn_;
  std::vector<BillboardDraw> draws_;
  uint64_t faces_ = 0, trees_ = 0, made_ = 0;

  bool stale_ = true;                   // clouds came or went since they were laid out
  bool full_ = false;                   // no more of them, until trees change
  std::map<bool, Pipeline> pipelines_;  // by whether chunks blend
  const Pipeline* by_ = nullptr;
  gpu::Buffer plane_buffer_, texel_buffer_, draw_buffer_;
};

}  // namespace render::raster
