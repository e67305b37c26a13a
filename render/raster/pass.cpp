#include "render/raster/pass.h"

#include <algorithm>
#include <cstring>

namespace render::raster {

void set_view(PictureConstants& p, const Camera& camera, const PixelRays& rays, double near, int width, int height) {
  p.corner = to_vec4(rays.corner);
  p.step_x = to_vec4(rays.step_x);
  p.step_y = to_vec4(rays.step_y);
  p.clip_x = to_vec4(rays.window_right / rays.window_half_x);
  p.clip_y = to_vec4(-rays.window_up / rays.window_half_y);  // Vulkan's y points down
  p.clip_w = to_vec4(rays.forward);
  p.fraction = to_vec4(camera.position.fraction, near);
  p.fraction_rest = to_vec4(camera.position.fraction - Vec3d(glm::vec3(camera.position.fraction)));
  const double metres_per_pixel = 2 * rays.window_half_y / height;
  p.screen = vec4(width, height, static_cast<float>(metres_per_pixel / kVertexSteps), 0);
}

world::Status Timestamps::open(gpu::Device& device) {
  device_ = &device;
  auto queries = gpu::vk_info<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
  queries.queryType = VK_QUERY_TYPE_TIMESTAMP;
  queries.queryCount = kMost;
  VkQueryPool pool = VK_NULL_HANDLE;
  VK_CHECK(vkCreateQueryPool(device.handle(), &queries, nullptr, &pool));
  pool_ = gpu::Owned<VkQueryPool>(device, pool);
  return {};
}

void Timestamps::begin(VkCommandBuffer commands) {
  names_.clear();
  slices_.begin_picture();
  vkCmdResetQueryPool(commands, pool_, 0, kMost);
}

void Timestamps::mark(VkCommandBuffer commands, const char* name) {
  CHECK_LT(names_.size(), size_t{kMost - 1});
  vkCmdWriteTimestamp2(commands, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, pool_, static_cast<uint32_t>(names_.size()));
  names_.push_back(name);
  slices_.begin_row();
}

void Timestamps::end(VkCommandBuffer commands) {
  vkCmdWriteTimestamp2(commands, VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, pool_, static_cast<uint32_t>(names_.size()));
}

world::Status Timestamps::report(FrameReport& report) const {
  uint64_t ticks[kMost] = {};
  const uint32_t count = static_cast<uint32_t>(names_.size()) + 1;
  VK_CHECK(vkGetQueryPoolResults(device_->handle(), pool_, 0, count, count * sizeof ticks[0], ticks, sizeof ticks[0],
                                 VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT));
  const double tick_ms = device_->limits().timestampPeriod * 1e-6;
  std::vector<double> ms;
  for (size_t i = 0; i < names_.size(); ++i) {
    ms.push_back(static_cast<double>(ticks[i + 1] - ticks[i]) * tick_ms);
    report.passes.push_back({names_[i], ms[i], 0, 0});
  }
  slices_.end_picture(ms);
  return {};
}

PassReport& row_of(FrameReport& report, std::string_view name) {
  const auto row = std::find_if(report.passes.begin(), report.passes.end(), [&](auto& p) { return p.name == name; });
  CHECK(row != report.passes.end());
  return *row;
}

void dispatch_pixels(VkCommandBuffer commands, VkExtent2D pixels) {
  vkCmdDispatch(commands, (pixels.width + kShadeGroup - 1) / kShadeGroup,
                (pixels.height + kShadeGroup - 1) / kShadeGroup, 1);
}

void begin_rendering(VkCommandBuffer commands, const Targets& targets, std::span<const VkImageView> colour,
                     VkImageView depth, bool clear) {
  auto attachment = gpu::vk_info<VkRenderingAttachmentInfo>(VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO);
  attachment.imageLayout = VK_IMAGE_LAYOUT_GENERAL;
  attachment.loadOp = clear ? VK_ATTACHMENT_LOAD_OP_CLEAR : VK_ATTACHMENT_LOAD_OP_LOAD;
  attachment.storeOp = VK_ATTACHMENT_STORE_OP_STORE;  // depth is reversed: 0 is infinitely far
  std::vector<VkRenderingAttachmentInfo> colours(colour.size(), attachment);
  for (size_t i = 0; i < colour.size(); ++i) colours[i].imageView = colour[i];
  VkRenderingAttachmentInfo depths = attachment;
  depths.imageView = depth;
  auto rendering = gpu::vk_info<VkRenderingInfo>(VK_STRUCTURE_TYPE_RENDERING_INFO);
  rendering.renderArea = {{0, 0}, targets.extent()};
  rendering.layerCount = 1;
  rendering.colorAttachmentCount = static_cast<uint32_t>(colours.size());
  rendering.pColorAttachments = colours.data();
  rendering.pDepthAttachment = depth ? &depths : nullptr;
  vkCmdBeginRendering(commands, &rendering);
  const VkViewport viewport{0, 0, static_cast<float>(targets.width), static_cast<float>(targets.height), 0, 1};
  vkCmdSetViewport(commands, 0, 1, &viewport);
  vkCmdSetScissor(commands, 0, 1, &rendering.renderArea);
}

}  // namespace render::raster
