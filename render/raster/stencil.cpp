#include "render/raster/stencil.h"

namespace render::raster {

namespace {

/// The first that the device can draw with. One of the last two is on every device.
VkFormat stencil_format(const gpu::Device& device) {
  for (const VkFormat format : {VK_FORMAT_S8_UINT, VK_FORMAT_D24_UNORM_S8_UINT})
    if (device.has_format(format, VK_FORMAT_FEATURE_DEPTH_STENCIL_ATTACHMENT_BIT)) return format;
  return VK_FORMAT_D32_SFLOAT_S8_UINT;
}

VkImageAspectFlags aspects(VkFormat format) {
  return format == VK_FORMAT_S8_UINT ? VK_IMAGE_ASPECT_STENCIL_BIT
                                     : VK_IMAGE_ASPECT_STENCIL_BIT | VK_IMAGE_ASPECT_DEPTH_BIT;
}

}  // namespace

world::Status fit_stencil(PassContext& context) {
  gpu::DeviceImage& stencil = context.targets.stencil;
  if (stencil.handle) return {};
  const VkFormat format = stencil_format(context.device);
  TRY(stencil, gpu::make_image(context.device, context.targets.extent(), format,
                               VK_IMAGE_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT, aspects(format)));
  return {};
}

void discard_stencil(VkCommandBuffer commands, const Targets& targets) {
  image_discard(commands, targets.stencil.handle, aspects(targets.stencil.format), kDepthReadWrite, kDepthReadWrite);
}

void stencil_barrier(VkCommandBuffer commands, const Targets& targets) {
  image_barrier(commands, targets.stencil.handle, aspects(targets.stencil.format), kDepthReadWrite, kDepthReadWrite);
}

void begin_with_stencil(VkCommandBuffer commands, const Targets& targets, std::span<const VkImageView> colour,
                        bool clear_stencil, bool clear_colour) {
  auto attachment = gpu::vk_info<VkRenderingAttachmentInfo>(VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO);
  attachment.imageLayout = VK_IMAGE_LAYOUT_GENERAL;
  attachment.loadOp = clear_colour ? VK_ATTACHMENT_LOAD_OP_CLEAR : VK_ATTACHMENT_LOAD_OP_LOAD;
  attachment.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
  std::vector<VkRenderingAttachmentInfo> colours(colour.size(), attachment);
  for (size_t i = 0; i < colour.size(); ++i) colours[i].imageView = colour[i];
  attachment.loadOp = clear_stencil ? VK_ATTACHMENT_LOAD_OP_CLEAR : VK_ATTACHMENT_LOAD_OP_LOAD;
  attachment.imageView = targets.stencil.view;
  auto rendering = gpu::vk_info<VkRenderingInfo>(VK_STRUCTURE_TYPE_RENDERING_INFO);
  rendering.renderArea = {{0, 0}, targets.extent()};
  rendering.layerCount = 1;
  rendering.colorAttachmentCount = static_cast<uint32_t>(colours.size());
  rendering.pColorAttachments = colours.data();
  rendering.pStencilAttachment = &attachment;
  vkCmdBeginRendering(commands, &rendering);
  const VkViewport viewport{0, 0, static_cast<float>(targets.width), static_cast<float>(targets.height), 0, 1};
  vkCmdSetViewport(commands, 0, 1, &viewport);
  vkCmdSetScissor(commands, 0, 1, &rendering.renderArea);
}

GraphicsState into_stencil(const Targets& targets) {
  GraphicsState state{
      .stencil = targets.stencil.format, .depth_test = false, .depth_write = false, .stencil_test = true};
  state.stencil_op = {
      VK_STENCIL_OP_KEEP, VK_STENCIL_OP_REPLACE, VK_STENCIL_OP_KEEP, VK_COMPARE_OP_ALWAYS, 0xff, 0xff, 1};
  return state;
}

GraphicsState where_stencil(const Targets& targets, uint32_t value) {
  GraphicsState state = into_stencil(targets);
  state.stencil_op = {VK_STENCIL_OP_KEEP, VK_STENCIL_OP_KEEP, VK_STENCIL_OP_KEEP, VK_COMPARE_OP_EQUAL, 0xff, 0, value};
  return state;
}

}  // namespace render::raster
