/// The window of play and what is done to it: keys, mouse, files dropped on it, its size. Over GLFW, the only file of
/// the program that talks to it but for what shows pictures.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tools/play/presenter.h"

namespace tools {

struct WindowEvents {
  std::function<void(int key, int modifiers, bool down)> key;  // buttons of the mouse from kMouseButton on
  std::function<void(double dx, double dy)> mouse_moved;       // while it is captured; pixels
  std::function<void(double steps, int modifiers)> wheel;
  std::function<void(const std::vector<std::filesystem::path>&)> dropped;
  std::function<void(bool focused)> focus;
};

/// The first gamepad whose layout is known (GLFW has SDL's table of them).
struct Gamepad {
  double left_x = 0, left_y = 0, right_x = 0, right_y = 0;  // [-1, 1], down and to the right; 0 within the dead zone
  double left_trigger = 0, right_trigger = 0;               // [0, 1]
  uint32_t buttons = 0;                                     // bit n: GLFW's button n
};

class PlayWindow {
 public:
  /// Vulkan where it can, else OpenGL; `why_not_vulkan` says why it isn't Vulkan. Fails with one sentence where there
  /// is no display, or nothing that draws.
  static world::Result<std::unique_ptr<PlayWindow>> make(int width, int height, bool vertical_sync, bool try_vulkan,
                                                         WindowEvents events);
  ~PlayWindow();
  PlayWindow(const PlayWindow&) = delete;
  PlayWindow& operator=(const PlayWindow&) = delete;

  Presenter& presenter() { return *presenter_; }
  const std::string& why_not_vulkan() const { return why_not_vulkan_; }
  /// Takes events in; waits at most so long for one.
  void poll(double wait_s);
  bool wants_close() const;
  void clear_close();
  void begin_frame();  // of the interface
  /// Ends it and shows it. A device that is lost is made anew; one that is lost again and again gives way to OpenGL.
  world::Status end_frame();

  std::optional<Gamepad> gamepad() const;

  bool focused() const { return focused_; }
  bool minimized() const;
  int width() const { return width_; }  // pixels
  int height() const { return height_; }
  /// The mouse is hidden and stays; only what moves it is told.
  void capture_mouse(bool on);
  bool mouse_captured() const { return captured_; }
  void set_full_screen(bool on);
  bool full_screen() const { return full_screen_; }
  void set_title(const std::string& title);
  int devices_lost() const { return losses_; }  // textures must be set again after each

 private:
  explicit PlayWindow(WindowEvents events) : events_(std::move(events)) {}
  world::Status open(int width, int height, bool vertical_sync, bool try_vulkan);
  world::Status make_window(bool vulkan, int width, int height);
  world::Status open_with(bool vulkan, int width, int height, bool vertical_sync);
  void listen();
  void navigate_by_gamepad();

  WindowEvents events_;
  GLFWwindow* window_ = nullptr;
  std::unique_ptr<Presenter> presenter_;
  std::string why_not_vulkan_;
  int width_ = 0, height_ = 0;
  bool focused_ = true, captured_ = false, full_screen_ = false, has_interface_ = false, vertical_sync_ = true;
  bool for_vulkan_ = false;  // what the window was made for
  int losses_ = 0, losses_in_a_row_ = 0;
  // A key that goes down and up within one frame must still be seen by the interface, which looks once a frame.
  std::vector<int> pressed_, released_, release_now_;
  double mouse_x_ = 0, mouse_y_ = 0;
  bool mouse_known_ = false;
  int window_x_ = 0, window_y_ = 0, window_width_ = 0, window_height_ = 0;
};

}  // namespace tools
