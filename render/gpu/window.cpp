#include "render/gpu/window.h"

#include <algorithm>
#include <cstring>

#include "render/gpu/barrier.h"

namespace render::gpu {

namespace {

constexpr uint64_t kAcquireWaitNs = 500'000'000;  // a window that nobody sees may give no image for long

}  // namespace

world::Result<std::unique_ptr<Window>> Window::make(const DeviceOptions& options, bool vertical_sync) {
  std::unique_ptr<Window> window(new Window);
  window->vertical_sync_ = vertical_sync;
  TRY_STATUS(window->open(options));
  return window;
}

Window::~Window() {
  if (!device_ || !device_->handle()) return;
  drop_swapchain();
  if (acquired_) vkDestroyFence(device_->handle(), acquired_, nullptr);
}

world::Status Window::open(const DeviceOptions& options) {
  TRY(device_, Device::make(options));
  TRY_STATUS(load_functions());
  auto fence = vk_info<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
  VK_CHECK(vkCreateFence(device_->handle(), &fence, nullptr, &acquired_));
  // Pictures come encoded for the display, so that no format may encode them again.
  uint32_t count = 0;
  VK_CHECK(formats_(device_->physical(), device_->surface(), &count, nullptr));
  std::vector<VkSurfaceFormatKHR> all(count);
  VK_CHECK(formats_(device_->physical(), device_->surface(), &count, all.data()));
  for (const VkSurfaceFormatKHR& candidate : all)
    if (candidate.colorSpace == VK_COLOR_SPACE_SRGB_NONLINEAR_KHR &&
        (candidate.format == VK_FORMAT_B8G8R8A8_UNORM || candidate.format == VK_FORMAT_R8G8B8A8_UNORM)) {
      format_ = candidate;
      break;
    }
  if (format_.format == VK_FORMAT_UNDEFINED)
    return world::Error{world::ErrorKind::no_device, "cannot draw with Vulkan: the window takes no 8-bit sRGB colours"};
  return overlay_.open(*device_, format_.format);
}

world::Status Window::load_functions() {
  bool all = true;
  const auto of_instance = [&](auto& function, const char* name) {
    function =
        reinterpret_cast<std::remove_reference_t<decltype(function)>>(vkGetInstanceProcAddr(device_->instance(), name));
    all &= function != nullptr;
  };
  const auto of_device = [&](auto& function, const char* name) {
    function =
        reinterpret_cast<std::remove_reference_t<decltype(function)>>(vkGetDeviceProcAddr(device_->handle(), name));
    all &= function != nullptr;
  };
  of_instance(capabilities_, "vkGetPhysicalDeviceSurfaceCapabilitiesKHR");
  of_instance(formats_, "vkGetPhysicalDeviceSurfaceFormatsKHR");
  of_instance(present_modes_, "vkGetPhysicalDeviceSurfacePresentModesKHR");
  of_device(create_swapchain_, "vkCreateSwapchainKHR");
  of_device(destroy_swapchain_, "vkDestroySwapchainKHR");
  of_device(swapchain_images_, "vkGetSwapchainImagesKHR");
  of_device(acquire_, "vkAcquireNextImageKHR");
  of_device(present_, "vkQueuePresentKHR");
  if (!all) return world::Error{world::ErrorKind::no_device, "cannot draw with Vulkan: it has no swapchains"};
  return {};
}

void Window::set_vertical_sync(bool on) {
  stale_ |= on != vertical_sync_;
  vertical_sync_ = on;
}

void Window::drop_swapchain() {
  vkDeviceWaitIdle(device_->handle());
  for (const VkImageView view : views_) vkDestroyImageView(device_->handle(), view, nullptr);
  views_.clear();
  images_.clear();
  if (swapchain_) destroy_swapchain_(device_->handle(), swapchain_, nullptr);
  swapchain_ = VK_NULL_HANDLE;
}

/// Leaves stale_ set where the window has no area now.
world::Status Window::make_swapchain(VkExtent2D wanted) {
  VkSurfaceCapabilitiesKHR can{};
  VK_CHECK(capabilities_(device_->physical(), device_->surface(), &can));
  VkExtent2D extent = can.currentExtent;
  if (extent.width == UINT32_MAX) {
    extent.width = std::clamp(wanted.width, can.minImageExtent.width, can.maxImageExtent.width);
    extent.height = std::clamp(wanted.height, can.minImageExtent.height, can.maxImageExtent.height);
  }
  if (extent.width == 0 || extent.height == 0 || can.maxImageExtent.width == 0) return {};
  VkPresentModeKHR mode = VK_PRESENT_MODE_FIFO_KHR;
  if (!vertical_sync_) {
    uint32_t count = 0;
    VK_CHECK(present_modes_(device_->physical(), device_->surface(), &count, nullptr));
    std::vector<VkPresentModeKHR> modes(count);
    VK_CHECK(present_modes_(device_->physical(), device_->surface(), &count, modes.data()));
    for (const VkPresentModeKHR better : {VK_PRESENT_MODE_IMMEDIATE_KHR, VK_PRESENT_MODE_MAILBOX_KHR})
      if (std::find(modes.begin(), modes.end(), better) != modes.end()) mode = better;
  }
  drop_swapchain();
  can_copy_ = (can.supportedUsageFlags & VK_IMAGE_USAGE_TRANSFER_SRC_BIT) != 0;
  auto info = vk_info<VkSwapchainCreateInfoKHR>(VK_STRUCTURE_TYPE_SWAPCHAIN_CREATE_INFO_KHR);
  info.surface = device_->surface();
  info.minImageCount = can.minImageCount + 1;
  if (can.maxImageCount > 0) info.minImageCount = std::min(info.minImageCount, can.maxImageCount);
  info.imageFormat = format_.format;
  info.imageColorSpace = format_.colorSpace;
  info.imageExtent = extent;
  info.imageArrayLayers = 1;
  info.imageUsage = VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT;
  if (can_copy_) info.imageUsage |= VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
  info.imageSharingMode = VK_SHARING_MODE_EXCLUSIVE;
  info.preTransform = can.currentTransform;
  info.compositeAlpha = VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR;
  if (!(can.supportedCompositeAlpha & VK_COMPOSITE_ALPHA_OPAQUE_BIT_KHR))
    info.compositeAlpha = VK_COMPOSITE_ALPHA_INHERIT_BIT_KHR;
  info.presentMode = mode;
  info.clipped = VK_TRUE;
  VK_CHECK(create_swapchain_(device_->handle(), &info, nullptr, &swapchain_));
  ++swapchains_made_;
  uint32_t count = 0;
  VK_CHECK(swapchain_images_(device_->handle(), swapchain_, &count, nullptr));
  images_.resize(count);
  VK_CHECK(swapchain_images_(device_->handle(), swapchain_, &count, images_.data()));
  for (const VkImage image : images_) {
    auto view = vk_info<VkImageViewCreateInfo>(VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO);
    view.image = image;
    view.viewType = VK_IMAGE_VIEW_TYPE_2D;
    view.format = format_.format;
    view.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    VkImageView handle = VK_NULL_HANDLE;
    VK_CHECK(vkCreateImageView(device_->handle(), &view, nullptr, &handle));
    views_.push_back(handle);
  }
  extent_ = extent, wanted_ = wanted;
  stale_ = false;
  return {};
}

world::Result<bool> Window::show(VkExtent2D extent, const OverlayList& list) {
  if (extent.width == 0 || extent.height == 0) return false;
  if (stale_ || extent.width != wanted_.width || extent.height != wanted_.height) {
    stale_ = true;
    TRY_STATUS(make_swapchain(extent));
    if (stale_) return false;
  }
  uint32_t image = 0;
  VkResult result = acquire_(device_->handle(), swapchain_, kAcquireWaitNs, VK_NULL_HANDLE, acquired_, &image);
  if (result == VK_TIMEOUT || result == VK_NOT_READY) return false;
  if (result == VK_ERROR_OUT_OF_DATE_KHR) {
    stale_ = true;
    return false;
  }
  if (result != VK_SUCCESS && result != VK_SUBOPTIMAL_KHR) return vulkan_error("vkAcquireNextImageKHR", result);
  stale_ |= result == VK_SUBOPTIMAL_KHR;
  VK_CHECK(vkWaitForFences(device_->handle(), 1, &acquired_, VK_TRUE, UINT64_MAX));
  VK_CHECK(vkResetFences(device_->handle(), 1, &acquired_));
  TRY_STATUS(draw(image, list));
  auto present = vk_info<VkPresentInfoKHR>(VK_STRUCTURE_TYPE_PRESENT_INFO_KHR);
  present.swapchainCount = 1;
  present.pSwapchains = &swapchain_;
  present.pImageIndices = &image;
  result = present_(device_->queue(), &present);
  if (result == VK_ERROR_OUT_OF_DATE_KHR || result == VK_SUBOPTIMAL_KHR) {
    stale_ = true;
    return result == VK_SUBOPTIMAL_KHR;
  }
  if (result != VK_SUCCESS) return vulkan_error("vkQueuePresentKHR", result);
  return true;
}

world::Status Window::draw(uint32_t image, const OverlayList& list) {
  TRY_STATUS(overlay_.prepare(list));
  const bool copies = keep_ && can_copy_;
  if (copies) {
    TRY(copy_, make_buffer(*device_, VkDeviceSize{4} * extent_.width * extent_.height, VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                           MemoryUse::readback));
  }
  TRY_STATUS(device_->run([&](VkCommandBuffer commands) {
    overlay_.record_uploads(commands);
    constexpr VkPipelineStageFlags2 kDraws = VK_PIPELINE_STAGE_2_COLOR_ATTACHMENT_OUTPUT_BIT;
    const auto barrier = [&](VkImageLayout from_layout, Access from, VkImageLayout to_layout, Access to) {
      layout_barrier(commands, images_[image], VK_IMAGE_ASPECT_COLOR_BIT, from_layout, from, to_layout, to);
    };
    barrier(VK_IMAGE_LAYOUT_UNDEFINED, {kDraws, 0}, VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL,
            {kDraws, VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT | VK_ACCESS_2_COLOR_ATTACHMENT_READ_BIT});
    auto target = vk_info<VkRenderingAttachmentInfo>(VK_STRUCTURE_TYPE_RENDERING_ATTACHMENT_INFO);
    target.imageView = views_[image];
    target.imageLayout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
    target.loadOp = VK_ATTACHMENT_LOAD_OP_CLEAR;
    target.storeOp = VK_ATTACHMENT_STORE_OP_STORE;
    target.clearValue.color = {{0.05f, 0.06f, 0.08f, 1.0f}};
    auto rendering = vk_info<VkRenderingInfo>(VK_STRUCTURE_TYPE_RENDERING_INFO);
    rendering.renderArea.extent = extent_;
    rendering.layerCount = 1;
    rendering.colorAttachmentCount = 1;
    rendering.pColorAttachments = &target;
    vkCmdBeginRendering(commands, &rendering);
    overlay_.record(commands, list, extent_);
    vkCmdEndRendering(commands);
    VkImageLayout layout = VK_IMAGE_LAYOUT_COLOR_ATTACHMENT_OPTIMAL;
    Access done{kDraws, VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT};
    if (copies) {
      barrier(layout, done, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL,
              {VK_PIPELINE_STAGE_2_COPY_BIT, VK_ACCESS_2_TRANSFER_READ_BIT});
      VkBufferImageCopy copy{};
      copy.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
      copy.imageExtent = {extent_.width, extent_.height, 1};
      vkCmdCopyImageToBuffer(commands, images_[image], VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, copy_.handle, 1, &copy);
      layout = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, done = {VK_PIPELINE_STAGE_2_COPY_BIT, 0};
    }
    barrier(layout, done, VK_IMAGE_LAYOUT_PRESENT_SRC_KHR, {VK_PIPELINE_STAGE_2_ALL_COMMANDS_BIT, 0});
  }));
  if (copies) TRY_STATUS(copy_out());
  return {};
}

world::Status Window::copy_out() {
  keep_ = false;
  kept_.width = static_cast<int>(extent_.width), kept_.height = static_cast<int>(extent_.height);
  kept_.rgba.resize(size_t{4} * extent_.width * extent_.height);
  std::memcpy(kept_.rgba.data(), copy_.mapped(), kept_.rgba.size());
  const bool swapped = format_.format == VK_FORMAT_B8G8R8A8_UNORM;
  for (size_t i = 0; i < kept_.rgba.size(); i += 4) {
    if (swapped) std::swap(kept_.rgba[i], kept_.rgba[i + 2]);
    kept_.rgba[i + 3] = 255;
  }
  copy_ = {};
  return {};
}

}  // namespace render::gpu
