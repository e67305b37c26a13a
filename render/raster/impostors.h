/// Impostors: pictures of chunks of faces, kept from picture to picture and drawn in place of the faces while the
/// camera is near where they were taken (impostor_view.h). They show blocks and places, not colours: shading reads of
/// them what it reads of faces. A part of FacesPass.
///
///   page 0: [texels of impostor a, row by row][free][impostor b] ...      uvec2 each, see impostors.shared.h
///
/// A chunk gets one where its faces cost more than its pixels, where it stays as it is, and where the camera, if it
/// goes on as fast as now, can use it for some pictures. In a picture few are made, in place of faces that it would
/// draw; so no picture takes much longer than without any. Those that were drawn longest ago give way where there is no
/// room.
///
/// error  at most impostor_error_px, of which a quarter is the texels': see ImpostorView::error
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "render/raster/culling.h"
#include "render/raster/free_ranges.h"
#include "render/raster/impostor_view.h"
#include "render/raster/impostors.shared.h"
#include "render/raster/pass.h"

namespace render::raster {

class Impostors {
 public:
  static constexpr uint32_t kPageTexels = 2u << 20;  // impostors share pages

  static bool called_for(const Drawing& drawing) {
    return drawing.knobs.impostor_error_px > 0 && !drawing.bare && !drawing.behind;
  }
  /// Whether a page of texels can be read on the device as it is.
  static bool fit(const gpu::Device& device) { return device.limits().maxTexelBufferElements >= kPageTexels; }
  /// Marks the chunks that impostors draw, and notes which of them are to be made.
  world::Status choose(PassContext& context, const Drawing& drawing, std::span<SeenChunk> seen);
  /// Once the list is made. blends: some chunk is drawn in part.
  world::Status prepare(PassContext& context, const Drawing& drawing, bool blends);
  /// Rows "impostors_made" and "impostors" of the report. Draws beside what faces have drawn. `faces`: the pipeline of
  /// faces without a blend; indices: of at least as many rectangles as there are impostors.
  void record(VkCommandBuffer commands, PassContext& context, const Pipeline& faces, const gpu::Buffer& indices);
  void finish(FrameReport& report);
  /// Gives all memory back.
  void rest();

  bool any() const { return !drawn_.empty(); }
  /// Bytes on the device.
  uint64_t bytes() const;

 private:
  struct Strip {  // of kStripTexels columns: rows that show something
    uint32_t first, last;
  };
  struct Impostor {
    ImpostorView view;
    size_t page;
    uint32_t first, texels;
    uint64_t drawn = 0;           // the last picture that it was drawn in
    std::vector<Strip> strips{};  // empty until they are known
  };
  struct Drawn {
    uint64_t id;
    ivec4 chunk;
  };
  struct Made {
    uint64_t id;
    const gpu::Buffer* faces;
    ivec4 corner;
    int x, y;                                         // in the images
    uint32_t strips;                                  // place in rows_
    std::vector<std::pair<uint32_t, uint32_t>> runs;  // of records: first, how many
  };
  struct Candidate;

  double metres_a_picture(const Camera& camera);
  std::optional<std::pair<int, int>> place_in_images(int width, int height);
  world::Result<uint64_t> make_room(PassContext& context, const ImpostorView& view, uint64_t most_bytes);
  void record_making(VkCommandBuffer commands, PassContext& context, const Pipeline& faces, const gpu::Buffer& indices);

  struct Page {
    gpu::Buffer texels;
    FreeRanges free;
  };
  std::vector<Page> pages_;
  std::unordered_map<uint64_t, Impostor> impostors_;
  uint64_t next_id_ = 1, pictures_ = 0;
  std::deque<world::WorldPoint> eyes_;  // of the last pictures

  // Of the picture at hand.
  std::vector<Drawn> drawn_;
  std::vector<Made> made_;
  int shelf_x_ = 0, shelf_y_ = 0, shelf_height_ = 0;

  Pipeline pack_;
  std::map<bool, Pipeline> pipelines_;  // by whether chunks blend
  const Pipeline* by_ = nullptr;
  gpu::DeviceImage seen_, depth_;  // of what is made
  gpu::Buffer views_, chunks_, draws_, rows_;
  std::vector<uint32_t> page_end_;  // of each page, in draws_
};

}  // namespace render::raster
