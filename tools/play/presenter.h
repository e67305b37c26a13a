/// What shows the interface and the picture in the window: Vulkan, or OpenGL where Vulkan can't.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "world/base/errors.h"

struct GLFWwindow;
struct ImDrawData;

namespace tools {

constexpr uint32_t kFontTexture = 1, kPictureTexture = 2, kFirstThumbnail = 16;

struct Screenshot {
  int width = 0, height = 0;
  std::vector<uint8_t> rgba;  // rows from the top; empty: none was taken
};

class Presenter {
 public:
  virtual ~Presenter() = default;
  virtual std::string name() const = 0;  // of what shows it
  virtual world::Status set_texture(uint32_t id, int width, int height, std::span<const uint8_t> rgba, bool smooth) = 0;
  /// For ImGui.
  virtual void* texture(uint32_t id) = 0;
  virtual void begin_frame() {}
  /// False where nothing could be shown this time.
  virtual world::Result<bool> show(ImDrawData* data) = 0;
  virtual void set_vertical_sync(bool on) = 0;
  /// The next show() keeps what it shows, for take_kept().
  virtual void keep_next() = 0;
  virtual Screenshot take_kept() = 0;
  virtual std::vector<std::string> messages() const { return {}; }  // of a validation layer
};

/// The window was made for no API. Fails where there is no Vulkan device that can present to it.
world::Result<std::unique_ptr<Presenter>> make_vulkan_presenter(GLFWwindow* window, bool vertical_sync);
/// The window has an OpenGL context, which is current.
world::Result<std::unique_ptr<Presenter>> make_opengl_presenter(GLFWwindow* window, bool vertical_sync);

}  // namespace tools
