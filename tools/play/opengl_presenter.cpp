// Shows the window by OpenGL 3.0 where there is no Vulkan: pictures come from the ray caster then. Functions are asked
// of the window library, so that nothing is linked.
#include "tools/play/presenter.h"

#include <algorithm>
#include <map>

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

namespace tools {

namespace {

struct Functions {
  void (*gen_textures)(int, unsigned*) = nullptr;
  void (*bind_texture)(unsigned, unsigned) = nullptr;
  void (*tex_parameter)(unsigned, unsigned, int) = nullptr;
  void (*tex_image)(unsigned, int, int, int, int, int, unsigned, unsigned, const void*) = nullptr;
  void (*viewport)(int, int, int, int) = nullptr;
  void (*clear_colour)(float, float, float, float) = nullptr;
  void (*clear)(unsigned) = nullptr;
  void (*read_pixels)(int, int, int, int, unsigned, unsigned, void*) = nullptr;
  const unsigned char* (*get_string)(unsigned) = nullptr;
};

class OpenGlPresenter : public Presenter {
 public:
  explicit OpenGlPresenter(GLFWwindow* window) : window_(window) {}
  ~OpenGlPresenter() override {
    if (open_) ImGui_ImplOpenGL3_Shutdown();
  }

  world::Status open(bool vertical_sync) {
    bool all = true;
    const auto find = [&](auto& function, const char* name) {
      function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(glfwGetProcAddress(name));
      all &= function != nullptr;
    };
    find(gl_.gen_textures, "glGenTextures"), find(gl_.bind_texture, "glBindTexture");
    find(gl_.tex_parameter, "glTexParameteri"), find(gl_.tex_image, "glTexImage2D");
    find(gl_.viewport, "glViewport"), find(gl_.clear_colour, "glClearColor"), find(gl_.clear, "glClear");
    find(gl_.read_pixels, "glReadPixels"), find(gl_.get_string, "glGetString");
    if (!all || !ImGui_ImplOpenGL3_Init("#version 130"))
      return world::Error{world::ErrorKind::no_device, "neither Vulkan nor OpenGL 3.0 can show a window here"};
    open_ = true;
    set_vertical_sync(vertical_sync);
    return {};
  }

  std::string name() const override {
    const unsigned char* renderer = gl_.get_string(0x1F01);  // GL_RENDERER
    return std::string("OpenGL on ") + (renderer ? reinterpret_cast<const char*>(renderer) : "an unnamed device");
  }
  world::Status set_texture(uint32_t id, int width, int height, std::span<const uint8_t> rgba, bool smooth) override {
    unsigned& handle = textures_[id];
    if (handle == 0) gl_.gen_textures(1, &handle);
    constexpr unsigned kTexture2d = 0x0DE1, kRgba = 0x1908, kBytes = 0x1401;
    const int filter = smooth ? 0x2601 : 0x2600, clamp = 0x812F;
    gl_.bind_texture(kTexture2d, handle);
    for (const unsigned name : {0x2800u, 0x2801u}) gl_.tex_parameter(kTexture2d, name, filter);
    for (const unsigned name : {0x2802u, 0x2803u}) gl_.tex_parameter(kTexture2d, name, clamp);
    gl_.tex_image(kTexture2d, 0, static_cast<int>(kRgba), width, height, 0, kRgba, kBytes, rgba.data());
    return {};
  }
  void* texture(uint32_t id) override { return reinterpret_cast<void*>(static_cast<uintptr_t>(textures_[id])); }
  void begin_frame() override { ImGui_ImplOpenGL3_NewFrame(); }
  void set_vertical_sync(bool on) override { glfwSwapInterval(on ? 1 : 0); }
  void keep_next() override { keep_ = true; }
  Screenshot take_kept() override { return std::move(kept_); }

  world::Result<bool> show(ImDrawData* data) override {
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_, &width, &height);
    if (width == 0 || height == 0) return false;
    gl_.viewport(0, 0, width, height);
    gl_.clear_colour(0.05f, 0.06f, 0.08f, 1);
    gl_.clear(0x4000);  // GL_COLOR_BUFFER_BIT
    ImGui_ImplOpenGL3_RenderDrawData(data);
    if (keep_) keep(width, height);
    glfwSwapBuffers(window_);
    return true;
  }

 private:
  void keep(int width, int height) {
    keep_ = false;
    const size_t row = static_cast<size_t>(width) * 4;
    std::vector<uint8_t> upside_down(row * static_cast<size_t>(height));
    gl_.read_pixels(0, 0, width, height, 0x1908, 0x1401, upside_down.data());
    kept_ = {width, height, std::vector<uint8_t>(upside_down.size())};
    for (size_t y = 0; y < static_cast<size_t>(height); ++y)
      std::copy_n(upside_down.data() + (static_cast<size_t>(height) - 1 - y) * row, row, kept_.rgba.data() + y * row);
  }

  GLFWwindow* window_;
  Functions gl_;
  std::map<uint32_t, unsigned> textures_;
  bool open_ = false, keep_ = false;
  Screenshot kept_;
};

}  // namespace

world::Result<std::unique_ptr<Presenter>> make_opengl_presenter(GLFWwindow* window, bool vertical_sync) {
  auto presenter = std::make_unique<OpenGlPresenter>(window);
  TRY_STATUS(presenter->open(vertical_sync));
  return std::unique_ptr<Presenter>(std::move(presenter));
}

}  // namespace tools
