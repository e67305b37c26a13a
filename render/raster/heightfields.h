/// Land that is far away as grids of heights: chunks whose faces are a surface of heights (HeightSurface) are drawn as
/// grids of triangles in place of the faces, at the largest step whose error is small enough on the screen. The grids
/// say where there is land; each pixel then finds the face that its ray meets among the columns near by, so that what
/// they show are the faces themselves, but for outlines. A part of FacesPass.
///
///   words: [surface a][surface b][free] ...  kHeightWords each, see HeightSurface
///
/// Chunks that stand on each other make one surface, of any level; what is none (caves, trunks, overhangs) stays faces.
/// A surface follows the chunks' versions, so an edit makes those anew that it touches. In a picture few are made;
/// until then faces are drawn.
///
/// error  at most heightfield_error_px, beside what the level itself has (lod_error_px). A step that takes another's
///        place is within that of the faces, as the other was; between levels grids blend as faces do.
/// cost   22 KiB a surface
#pragma once

#include <map>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "render/extract/height_surface.h"
#include "render/raster/culling.h"
#include "render/raster/heightfields.shared.h"
#include "render/raster/pass.h"

namespace render::raster {

class Heightfields {
 public:
  static bool called_for(const Drawing& drawing) {
    return drawing.knobs.heightfield_error_px > 0 && !drawing.bare && !drawing.behind;
  }
  /// Marks the chunks that grids draw, and makes some of their surfaces.
  world::Status choose(PassContext& context, const Drawing& drawing, std::span<SeenChunk> seen);
  /// Once the list is made. blends: some chunk is drawn in part.
  world::Status prepare(PassContext& context, bool blends);
  /// Row "heightfields" of the report. Draws beside what faces have drawn.
  void record(VkCommandBuffer commands, PassContext& context);
  void finish(FrameReport& report);
  /// Gives all memory back.
  void rest();

  bool any() const { return !drawn_.empty(); }
  /// Records of the faces that grids stand for in the picture.
  uint64_t faces() const { return faces_; }
  /// Bytes on the device.
  uint64_t bytes() const;

 private:
  struct Surface {
    uint64_t version = 0;  // of all its chunks
    bool is_one = false;   // else its chunks are no surface of heights
    uint32_t slot = 0;
    int32_t base = 0, floor = 0;
    std::array<float, HeightSurface::kSteps> error{};
    uint64_t asked = 0;  // the last picture that could have shown it
  };
  /// Seen chunks that stand on each other.
  struct Stack {
    world::VoxelPos key;             // x and z of its chunks, y: the level
    std::vector<SeenChunk*> chunks;  // nearest first
  };
  struct Drawn {
    int number;  // of the step
    bool straddles;
    HeightDraw draw;
  };
  struct Call {
    int number;
    uint32_t first, count;  // instances
  };
  struct Fresh;

  world::Status keep(PassContext& context, std::span<Fresh> made);
  void drop(const Surface& surface);
  void drop_old();
  bool draw_stack(const Drawing& drawing, Stack& stack, const Surface& surface);
  world::Status fit_indices(PassContext& context);

  std::unordered_map<world::VoxelPos, Surface, world::PosHash> surfaces_;  // by Stack::key
  std::vector<uint32_t> free_slots_;
  uint32_t slots_ = 0;
  uint64_t pictures_ = 0;

  // Of the picture at hand.
  std::vector<Drawn> drawn_;
  std::vector<Call> calls_;
  uint64_t faces_ = 0, triangles_ = 0, made_ = 0;

  std::map<bool, Pipeline> pipelines_;  // by whether chunks blend
  const Pipeline* by_ = nullptr;
  gpu::Buffer words_, draws_, indices_;
};

}  // namespace render::raster
