#include "tools/play/window.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <imgui.h>

#include "tools/play/controls.h"

namespace tools {

namespace {

std::string glfw_failure() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text ? text : "it doesn't say why";
}

constexpr int kMostLosses = 3;  // of Vulkan's device, with no picture between them, before OpenGL takes its place

PlayWindow* self(GLFWwindow* window) { return static_cast<PlayWindow*>(glfwGetWindowUserPointer(window)); }

}  // namespace

world::Result<std::unique_ptr<PlayWindow>> PlayWindow::make(int width, int height, bool vertical_sync, bool try_vulkan,
                                                            WindowEvents events) {
  std::unique_ptr<PlayWindow> made(new PlayWindow(std::move(events)));
  TRY_STATUS(made->open(width, height, vertical_sync, try_vulkan));
  return made;
}

world::Status PlayWindow::open(int width, int height, bool vertical_sync, bool try_vulkan) {
  const char *x11 = std::getenv("DISPLAY"), *wayland = std::getenv("WAYLAND_DISPLAY");
  if ((!x11 || !*x11) && (!wayland || !*wayland))
    return world::Error{world::ErrorKind::no_device,
                        "there is no display to open a window on; `loam render` makes pictures without one"};
  if (!glfwInit())
    return world::Error{world::ErrorKind::no_device,
                        "no window can be opened: " + glfw_failure() + "; `loam render` makes pictures without one"};
  vertical_sync_ = vertical_sync;
  if (try_vulkan) {
    const world::Status vulkan = open_with(true, width, height, vertical_sync);
    if (vulkan.ok()) return {};
    why_not_vulkan_ = vulkan.error().message;
  } else {
    why_not_vulkan_ = "Vulkan was left aside";
  }
  const world::Status opengl = open_with(false, width, height, vertical_sync);
  if (opengl.ok()) return {};
  return world::Error{world::ErrorKind::no_device, why_not_vulkan_ + "; and " + opengl.error().message};
}

world::Status PlayWindow::make_window(bool vulkan, int width, int height) {
  if (window_) glfwDestroyWindow(window_);
  glfwDefaultWindowHints();
  glfwWindowHint(GLFW_CLIENT_API, vulkan ? GLFW_NO_API : GLFW_OPENGL_API);
  glfwWindowHintString(GLFW_X11_CLASS_NAME, "loam");
  glfwWindowHintString(GLFW_X11_INSTANCE_NAME, "loam");
  if (!vulkan) {
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 0);
  }
  window_ = glfwCreateWindow(width, height, "Loam", nullptr, nullptr);
  if (!window_) return world::Error{world::ErrorKind::no_device, "no window can be opened: " + glfw_failure()};
  for_vulkan_ = vulkan;
  // What was asked of the one before.
  if (std::exchange(captured_, false)) capture_mouse(true);
  if (std::exchange(full_screen_, false)) set_full_screen(true);
  return {};
}

world::Status PlayWindow::open_with(bool vulkan, int width, int height, bool vertical_sync) {
  presenter_.reset();
  if (has_interface_) {
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
    has_interface_ = false;
  }
  // The same window, with where it stands, the keyboard and the mouse, unless it must be of another kind.
  if (!window_ || vulkan != for_vulkan_) TRY_STATUS(make_window(vulkan, width, height));
  if (!vulkan) glfwMakeContextCurrent(window_);
  glfwGetFramebufferSize(window_, &width_, &height_);
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;
  ImGui::GetIO().ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
  has_interface_ = true;
  if (vulkan) {
    ImGui_ImplGlfw_InitForVulkan(window_, false);
    TRY(presenter_, make_vulkan_presenter(window_, vertical_sync));
  } else {
    ImGui_ImplGlfw_InitForOpenGL(window_, false);
    TRY(presenter_, make_opengl_presenter(window_, vertical_sync));
  }
  listen();
  return {};
}

void PlayWindow::listen() {
  glfwSetWindowUserPointer(window_, this);
  glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int scan_code, int action, int modifiers) {
    PlayWindow& window = *self(w);
    if (action == GLFW_PRESS) window.pressed_.push_back(key);
    if (action == GLFW_RELEASE && std::count(window.pressed_.begin(), window.pressed_.end(), key) > 0)
      window.released_.push_back(key);
    else
      ImGui_ImplGlfw_KeyCallback(w, key, scan_code, action, modifiers);
    if (action != GLFW_REPEAT && key != GLFW_KEY_UNKNOWN) self(w)->events_.key(key, modifiers, action == GLFW_PRESS);
  });
  glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int button, int action, int modifiers) {
    ImGui_ImplGlfw_MouseButtonCallback(w, button, action, modifiers);
    self(w)->events_.key(kMouseButton + button, modifiers, action == GLFW_PRESS);
  });
  glfwSetCharCallback(window_, [](GLFWwindow* w, unsigned letter) { ImGui_ImplGlfw_CharCallback(w, letter); });
  glfwSetCursorEnterCallback(window_, [](GLFWwindow* w, int in) { ImGui_ImplGlfw_CursorEnterCallback(w, in); });
  glfwSetScrollCallback(window_, [](GLFWwindow* w, double aside, double steps) {
    ImGui_ImplGlfw_ScrollCallback(w, aside, steps);
    const bool control = glfwGetKey(w, GLFW_KEY_LEFT_CONTROL) == GLFW_PRESS;
    self(w)->events_.wheel(steps, control ? kControl : 0);
  });
  glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double x, double y) {
    PlayWindow& window = *self(w);
    if (window.captured_ && window.mouse_known_) window.events_.mouse_moved(x - window.mouse_x_, y - window.mouse_y_);
    window.mouse_x_ = x, window.mouse_y_ = y, window.mouse_known_ = true;
  });
  glfwSetWindowFocusCallback(window_, [](GLFWwindow* w, int focused) {
    ImGui_ImplGlfw_WindowFocusCallback(w, focused);
    self(w)->focused_ = focused != 0;
    self(w)->events_.focus(focused != 0);
  });
  glfwSetDropCallback(window_, [](GLFWwindow* w, int count, const char** paths) {
    self(w)->events_.dropped(std::vector<std::filesystem::path>(paths, paths + count));
  });
}

PlayWindow::~PlayWindow() {
  presenter_.reset();
  if (has_interface_) {
    ImGui_ImplGlfw_Shutdown();
    ImGui::DestroyContext();
  }
  if (window_) glfwDestroyWindow(window_);
  glfwTerminate();
}

void PlayWindow::poll(double wait_s) {
  if (wait_s > 0)
    glfwWaitEventsTimeout(wait_s);
  else
    glfwPollEvents();
  const int width = width_, height = height_;
  glfwGetFramebufferSize(window_, &width_, &height_);
  if (width != width_ || height != height_) mouse_known_ = false;  // where it is now is no movement
}

std::optional<Gamepad> PlayWindow::gamepad() const {
  constexpr float kDeadZone = 0.18f;  // worn sticks rest within it
  const auto axis = [](float x) { return std::abs(x) < kDeadZone ? 0.0 : static_cast<double>(x); };
  for (int n = GLFW_JOYSTICK_1; n <= GLFW_JOYSTICK_LAST; ++n) {
    GLFWgamepadstate state;
    if (!glfwJoystickIsGamepad(n) || !glfwGetGamepadState(n, &state)) continue;
    Gamepad pad;
    pad.left_x = axis(state.axes[GLFW_GAMEPAD_AXIS_LEFT_X]), pad.left_y = axis(state.axes[GLFW_GAMEPAD_AXIS_LEFT_Y]);
    pad.right_x = axis(state.axes[GLFW_GAMEPAD_AXIS_RIGHT_X]);
    pad.right_y = axis(state.axes[GLFW_GAMEPAD_AXIS_RIGHT_Y]);
    pad.left_trigger = (static_cast<double>(state.axes[GLFW_GAMEPAD_AXIS_LEFT_TRIGGER]) + 1) / 2;
    pad.right_trigger = (static_cast<double>(state.axes[GLFW_GAMEPAD_AXIS_RIGHT_TRIGGER]) + 1) / 2;
    for (int b = 0; b <= GLFW_GAMEPAD_BUTTON_LAST; ++b) pad.buttons |= state.buttons[b] ? 1u << b : 0;
    return pad;
  }
  return std::nullopt;
}

bool PlayWindow::wants_close() const { return glfwWindowShouldClose(window_) != 0; }
void PlayWindow::clear_close() { glfwSetWindowShouldClose(window_, GLFW_FALSE); }
bool PlayWindow::minimized() const {
  return width_ == 0 || height_ == 0 || glfwGetWindowAttrib(window_, GLFW_ICONIFIED) != 0;
}

/// Where the game has no use for a gamepad it moves through menus: A chooses, B goes back. ImGui's own reading of it
/// knows only joysticks whose buttons lie in one order (until its version 1.87).
void PlayWindow::navigate_by_gamepad() {
  ImGuiIO& io = ImGui::GetIO();
  const std::optional<Gamepad> pad = captured_ ? std::nullopt : gamepad();
  std::fill(std::begin(io.NavInputs), std::end(io.NavInputs), 0.0f);
  if (!pad) {
    io.ConfigFlags &= ~ImGuiConfigFlags_NavEnableGamepad;
    return;
  }
  io.ConfigFlags |= ImGuiConfigFlags_NavEnableGamepad;
  io.BackendFlags |= ImGuiBackendFlags_HasGamepad;
  static constexpr std::pair<int, int> kButtons[] = {{GLFW_GAMEPAD_BUTTON_A, ImGuiNavInput_Activate},
                                                     {GLFW_GAMEPAD_BUTTON_B, ImGuiNavInput_Cancel},
                                                     {GLFW_GAMEPAD_BUTTON_X, ImGuiNavInput_Menu},
                                                     {GLFW_GAMEPAD_BUTTON_Y, ImGuiNavInput_Input},
                                                     {GLFW_GAMEPAD_BUTTON_DPAD_LEFT, ImGuiNavInput_DpadLeft},
                                                     {GLFW_GAMEPAD_BUTTON_DPAD_RIGHT, ImGuiNavInput_DpadRight},
                                                     {GLFW_GAMEPAD_BUTTON_DPAD_UP, ImGuiNavInput_DpadUp},
                                                     {GLFW_GAMEPAD_BUTTON_DPAD_DOWN, ImGuiNavInput_DpadDown},
                                                     {GLFW_GAMEPAD_BUTTON_LEFT_BUMPER, ImGuiNavInput_FocusPrev},
                                                     {GLFW_GAMEPAD_BUTTON_RIGHT_BUMPER, ImGuiNavInput_FocusNext}};
  for (const auto& [button, input] : kButtons) io.NavInputs[input] = (pad->buttons >> button & 1) != 0 ? 1.0f : 0.0f;
  const auto push = [&](ImGuiNavInput input, double by) {
    io.NavInputs[input] = static_cast<float>(std::max(by, 0.0));
  };
  push(ImGuiNavInput_LStickLeft, -pad->left_x), push(ImGuiNavInput_LStickRight, pad->left_x);
  push(ImGuiNavInput_LStickUp, -pad->left_y), push(ImGuiNavInput_LStickDown, pad->left_y);
}

void PlayWindow::begin_frame() {
  presenter_->begin_frame();
  // What went up within the last frame, before this one begins: in the middle of one, keys and modifiers would
  // disagree.
  for (const int key : std::exchange(release_now_, std::exchange(released_, {})))
    ImGui_ImplGlfw_KeyCallback(window_, key, 0, GLFW_RELEASE, 0);
  pressed_.clear();
  ImGui_ImplGlfw_NewFrame();
  // While the mouse is captured nothing of the interface may see it.
  ImGuiIO& io = ImGui::GetIO();
  if (captured_)
    io.ConfigFlags |= ImGuiConfigFlags_NoMouse | ImGuiConfigFlags_NoMouseCursorChange;
  else
    io.ConfigFlags &= ~(ImGuiConfigFlags_NoMouse | ImGuiConfigFlags_NoMouseCursorChange);
  navigate_by_gamepad();
  ImGui::NewFrame();
}

world::Status PlayWindow::end_frame() {
  ImGui::Render();
  if (minimized()) return {};
  const auto shown = presenter_->show(ImGui::GetDrawData());
  if (shown.ok()) {
    losses_in_a_row_ = 0;
    return {};
  }
  // The world goes on in its own thread: what is lost is the way to the screen, which is made anew.
  ++losses_;
  why_not_vulkan_ = shown.error().message;
  if (for_vulkan_ && ++losses_in_a_row_ <= kMostLosses && open_with(true, width_, height_, vertical_sync_).ok())
    return {};
  if (!for_vulkan_) return shown.error();
  return open_with(false, width_, height_, vertical_sync_);
}

void PlayWindow::capture_mouse(bool on) {
  if (on == captured_) return;
  captured_ = on;
  mouse_known_ = false;
  glfwSetInputMode(window_, GLFW_CURSOR, on ? GLFW_CURSOR_DISABLED : GLFW_CURSOR_NORMAL);
  if (glfwRawMouseMotionSupported()) glfwSetInputMode(window_, GLFW_RAW_MOUSE_MOTION, on ? GLFW_TRUE : GLFW_FALSE);
}

void PlayWindow::set_full_screen(bool on) {
  if (on == full_screen_) return;
  GLFWmonitor* monitor = glfwGetPrimaryMonitor();
  if (on && !monitor) return;
  full_screen_ = on;
  if (on) {
    glfwGetWindowPos(window_, &window_x_, &window_y_);
    glfwGetWindowSize(window_, &window_width_, &window_height_);
    const GLFWvidmode* mode = glfwGetVideoMode(monitor);
    glfwSetWindowMonitor(window_, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
  } else {
    glfwSetWindowMonitor(window_, nullptr, window_x_, window_y_, window_width_, window_height_, GLFW_DONT_CARE);
  }
}

void PlayWindow::set_title(const std::string& title) { glfwSetWindowTitle(window_, title.c_str()); }

}  // namespace tools
