/// Textured triangles over a window: pictures, text and panels, as an immediate-mode interface gives them. Blended in
/// the display's encoding, as such interfaces expect.
#pragma once

#include <cstdint>
#include <map>
#include <span>

#include "render/gpu/owned.h"

namespace render::gpu {

using TextureId = uint32_t;  // 0: none

struct OverlayVertex {
  float x, y, u, v;  // pixels of the window; [0, 1] of the texture
  uint32_t rgba;     // 8 bits each, red lowest
};
static_assert(sizeof(OverlayVertex) == 20);

struct OverlayDraw {
  float x0, y0, x1, y1;  // drawn inside of these pixels only
  TextureId texture;
  uint32_t first_index, indices;
  int32_t first_vertex;
};

/// All triangles of one frame; the spans are read during draw() only.
struct OverlayList {
  std::span<const OverlayVertex> vertices;
  std::span<const uint16_t> indices;
  std::span<const OverlayDraw> draws;
};

class Overlay {
 public:
  world::Status open(Device& device, VkFormat target);

  /// rgba: 4 bytes a pixel, rows from the top. Given again, replaces it, of any size.
  world::Status set_texture(TextureId id, int width, int height, std::span<const uint8_t> rgba, bool smooth);
  void drop_texture(TextureId id);

  /// Copies to the device what the frame needs; before record() and while the device is idle.
  world::Status prepare(const OverlayList& list);
  /// Sends new textures; outside of a rendering.
  void record_uploads(VkCommandBuffer commands);
  /// Inside of a rendering whose target has this size.
  void record(VkCommandBuffer commands, const OverlayList& list, VkExtent2D extent);

 private:
  struct Texture {
    DeviceImage image;
    Buffer staging;
    VkDescriptorSet set = VK_NULL_HANDLE;
    gpu::Owned<VkDescriptorPool> pool;
    bool fresh = false, changed = false, smooth = true;
  };
  world::Status make_pipeline(VkFormat target);
  world::Status make_set(Texture& texture);

  Device* device_ = nullptr;
  Owned<VkSampler> smooth_, sharp_;
  Owned<VkDescriptorSetLayout> set_layout_;
  Owned<VkPipelineLayout> layout_;
  Owned<VkPipeline> pipeline_;
  std::map<TextureId, Texture> textures_;
  Buffer vertices_, indices_;
};

}  // namespace render::gpu
