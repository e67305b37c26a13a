/// A window's pictures: a swapchain that follows its size, and the overlay drawn into it. Knows no window library: the
/// surface comes from DeviceOptions::make_surface.
///
/// Each frame is drawn and finished before it is presented, so that nothing of one frame meets the next.
#pragma once

#include <memory>

#include "render/gpu/overlay.h"

namespace render::gpu {

class Window {
 public:
  /// vertical_sync: pictures wait for the display; without it they are shown as they come where the driver can.
  static world::Result<std::unique_ptr<Window>> make(const DeviceOptions& options, bool vertical_sync);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  Device& device() { return *device_; }
  Overlay& overlay() { return overlay_; }
  void set_vertical_sync(bool on);

  /// Draws and presents. `extent` is the window's size in pixels; where it is empty, as of a minimized window, nothing
  /// happens. False where no picture was shown this time: the window has no area, or is being resized.
  world::Result<bool> show(VkExtent2D extent, const OverlayList& list);

  /// What was shown last, as it was sent to the display: 4 bytes a pixel, rows from the top.
  struct Shown {
    int width = 0, height = 0;
    std::vector<uint8_t> rgba;
  };
  /// The next show() keeps a copy; taken once.
  void keep_next() { keep_ = true; }
  Shown take_kept() { return std::move(kept_); }

  uint64_t swapchains_made() const { return swapchains_made_; }

 private:
  Window() = default;
  world::Status open(const DeviceOptions& options);
  world::Status load_functions();
  world::Status make_swapchain(VkExtent2D wanted);
  void drop_swapchain();
  world::Status draw(uint32_t image, const OverlayList& list);
  world::Status copy_out();

  std::unique_ptr<Device> device_;
  VkFence acquired_ = VK_NULL_HANDLE;
  Overlay overlay_;
  VkSwapchainKHR swapchain_ = VK_NULL_HANDLE;
  VkSurfaceFormatKHR format_{};
  VkExtent2D extent_{}, wanted_{};
  std::vector<VkImage> images_;
  std::vector<VkImageView> views_;
  bool stale_ = true, vertical_sync_ = true, keep_ = false, can_copy_ = false;
  Buffer copy_;
  Shown kept_;
  uint64_t swapchains_made_ = 0;

  // Of this instance and device: the program may have others, whose loader fills the global names.
  PFN_vkGetPhysicalDeviceSurfaceCapabilitiesKHR capabilities_ = nullptr;
  PFN_vkGetPhysicalDeviceSurfaceFormatsKHR formats_ = nullptr;
  PFN_vkGetPhysicalDeviceSurfacePresentModesKHR present_modes_ = nullptr;
  PFN_vkCreateSwapchainKHR create_swapchain_ = nullptr;
  PFN_vkDestroySwapchainKHR destroy_swapchain_ = nullptr;
  PFN_vkGetSwapchainImagesKHR swapchain_images_ = nullptr;
  PFN_vkAcquireNextImageKHR acquire_ = nullptr;
  PFN_vkQueuePresentKHR present_ = nullptr;
};

}  // namespace render::gpu
