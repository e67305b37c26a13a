/// Draws see-through blocks over the shaded picture: follows their faces, culls them, and hands them to the order that
/// the knob `transparency` asks for. A picture of a world without such a block has none of this.
#pragma once

#include <optional>

#include "render/extract/see_through_faces.h"
#include "render/raster/block_grid.h"
#include "render/raster/pass.h"
#include "render/raster/transparency.shared.h"
#include "render/see_through.h"

namespace render::raster {

/// What to draw of the see-through faces: runs of records, chunks front to back.
struct LayerDraws {
  struct Run {
    uint32_t page, first, count, chunk;
  };
  std::vector<Run> runs;
  std::vector<ivec4> chunks;                     // corners, relative to the camera's voxel
  std::vector<const ExtractedChunk*> extracted;  // of each
  FacePool* pool = nullptr;
  const gpu::Buffer* indices = nullptr;
  uint64_t faces = 0;
  bool matte = false;        // the world holds sheets or partial coverage, which are lit
  bool emits = false;        // or see-through blocks that emit
  bool shape_codes = false;  // the grid of blocks says where shapes stand
  bool eye_in_air = false;   // known so; where pictures of mirrors take turns with it, it isn't

  /// Within begin_rendering().
  void record(VkCommandBuffer commands, PassContext& context, const Pipeline& pipeline) const;
};

/// One way to bring layers into the picture.
class LayerOrder {
 public:
  virtual ~LayerOrder() = default;
  virtual world::Status fit(PassContext& context) = 0;
  /// May change `constants`, which are bound afterwards.
  virtual world::Status prepare(PassContext& context, const Drawing& drawing, const LayerDraws& draws,
                                LayerConstants& constants) = 0;
  virtual void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing,
                      const LayerDraws& draws) = 0;
  virtual world::Status finish(PassContext&, FrameReport&) { return {}; }
  virtual bool again() const { return false; }
  /// Whether its shaders trace rays.
  virtual bool needs_block_grid(const Drawing&) const { return false; }
};
std::unique_ptr<LayerOrder> make_list_order();
std::unique_ptr<LayerOrder> make_sorted_order();
std::unique_ptr<LayerOrder> make_weighted_order();

/// Specialisation constants of shaders that shade matte surfaces, and `more`.
std::vector<Constant> layer_constants(const Drawing& drawing, const LayerDraws& draws,
                                      std::initializer_list<Constant> more = {});

/// begin_rendering() into cleared colours, with the depth that is there.
void begin_clearing_colour(VkCommandBuffer commands, const Targets& targets, std::span<const VkImageView> colour,
                           VkImageView depth);

class TransparencyPass : public Pass {
 public:
  TransparencyPass() { pool_.page_records = 1u << 16; }  // 512 KiB: there are few
  static PassKind kind();
  world::Status fit(PassContext& context) override;
  world::Status prepare(PassContext& context, const Drawing& drawing, FrameReport& report) override;
  void record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) override;
  world::Status finish(PassContext& context, FrameReport& report) override;
  bool again() const override { return any_ && order_->again(); }
  void rest() override;

 private:
  /// Returns the leaves that changed since the last picture.
  std::vector<world::LeafPos> follow(const Drawing& drawing);
  world::Status follow_blocks(PassContext& context, const Drawing& drawing, std::span<const world::LeafPos> dirty,
                              LayerConstants& constants);
  world::Status fit_indices(PassContext& context);
  void cull(const Drawing& drawing);

  std::optional<SeeThroughKinds> kinds_;
  SeeThroughFaces faces_;
  FacePool pool_;
  LayerDraws draws_;
  std::unique_ptr<LayerOrder> order_;
  Transparency ordered_by_ = Transparency::opaque;
  bool fits_ = false, merged_ = true;
  bool any_ = false;    // something in view changes pixels
  uint64_t store_ = 0;  // identity of the world that was extracted; 0: none
  int subscriber_ = 0;
  LiquidLevels levels_;
  BlockGrid grid_;
  bool grid_has_levels_ = false;
  uint64_t grid_store_ = 0;   // identity of the world that it holds; 0: none, or behind
  uint64_t grid_shapes_ = 0;  // ShapeExtractor::rebuilds() of the shapes that it names; 0: none
  gpu::Buffer indices_, chunks_, blocks_, constants_, block_kinds_;
  uint32_t indexed_records_ = 0;
};

}  // namespace render::raster
