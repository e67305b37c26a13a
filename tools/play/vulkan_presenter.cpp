#include "tools/play/presenter.h"

#include "render/gpu/window.h"

#include <GLFW/glfw3.h>
#include <imgui.h>

namespace tools {

namespace {

static_assert(sizeof(ImDrawVert) == sizeof(render::gpu::OverlayVertex) && sizeof(ImDrawIdx) == 2);

class VulkanPresenter : public Presenter {
 public:
  explicit VulkanPresenter(GLFWwindow* window) : glfw_(window) {}

  world::Status open(bool vertical_sync) {
    uint32_t count = 0;
    const char** names = glfwGetRequiredInstanceExtensions(&count);
    if (!names)
      return world::Error{world::ErrorKind::no_device,
                          "cannot draw with Vulkan: it can't show windows here; install libvulkan1 and "
                          "mesa-vulkan-drivers"};
    render::gpu::DeviceOptions options;
    options.instance_extensions.assign(names, names + count);
    options.make_surface = [window = glfw_](VkInstance instance, VkSurfaceKHR* surface) {
      return glfwCreateWindowSurface(instance, window, nullptr, surface);
    };
    TRY(window_, render::gpu::Window::make(options, vertical_sync));
    ImGui::GetIO().BackendFlags |= ImGuiBackendFlags_RendererHasVtxOffset;
    unsigned char* pixels = nullptr;
    int width = 0, height = 0;
    ImGui::GetIO().Fonts->GetTexDataAsRGBA32(&pixels, &width, &height);
    ImGui::GetIO().Fonts->SetTexID(texture(kFontTexture));
    return set_texture(kFontTexture, width, height,
                       {pixels, static_cast<size_t>(width) * static_cast<size_t>(height) * 4}, true);
  }

  std::string name() const override { return window_->device().name(); }
  world::Status set_texture(uint32_t id, int width, int height, std::span<const uint8_t> rgba, bool smooth) override {
    return window_->overlay().set_texture(id, width, height, rgba, smooth);
  }
  void* texture(uint32_t id) override { return reinterpret_cast<void*>(static_cast<uintptr_t>(id)); }
  void set_vertical_sync(bool on) override { window_->set_vertical_sync(on); }
  void keep_next() override { window_->keep_next(); }
  Screenshot take_kept() override {
    auto kept = window_->take_kept();
    return {kept.width, kept.height, std::move(kept.rgba)};
  }
  std::vector<std::string> messages() const override { return window_->device().messages(); }

  world::Result<bool> show(ImDrawData* data) override {
    vertices_.clear(), indices_.clear(), draws_.clear();
    for (int n = 0; n < data->CmdListsCount; ++n) {
      const ImDrawList* list = data->CmdLists[n];
      const auto first_vertex = static_cast<int32_t>(vertices_.size());
      const auto first_index = static_cast<uint32_t>(indices_.size());
      const auto* vertices = reinterpret_cast<const render::gpu::OverlayVertex*>(list->VtxBuffer.Data);
      vertices_.insert(vertices_.end(), vertices, vertices + list->VtxBuffer.Size);
      indices_.insert(indices_.end(), list->IdxBuffer.Data, list->IdxBuffer.Data + list->IdxBuffer.Size);
      for (const ImDrawCmd& command : list->CmdBuffer) {
        if (command.UserCallback) continue;
        const auto id = static_cast<uint32_t>(reinterpret_cast<uintptr_t>(command.GetTexID()));
        draws_.push_back({command.ClipRect.x, command.ClipRect.y, command.ClipRect.z, command.ClipRect.w, id,
                          first_index + command.IdxOffset, command.ElemCount,
                          first_vertex + static_cast<int32_t>(command.VtxOffset)});
      }
    }
    int width = 0, height = 0;
    glfwGetFramebufferSize(glfw_, &width, &height);
    return window_->show({static_cast<uint32_t>(width), static_cast<uint32_t>(height)}, {vertices_, indices_, draws_});
  }

 private:
  GLFWwindow* glfw_;
  std::unique_ptr<render::gpu::Window> window_;
  std::vector<render::gpu::OverlayVertex> vertices_;
  std::vector<uint16_t> indices_;
  std::vector<render::gpu::OverlayDraw> draws_;
};

}  // namespace

world::Result<std::unique_ptr<Presenter>> make_vulkan_presenter(GLFWwindow* window, bool vertical_sync) {
  auto presenter = std::make_unique<VulkanPresenter>(window);
  TRY_STATUS(presenter->open(vertical_sync));
  return std::unique_ptr<Presenter>(std::move(presenter));
}

}  // namespace tools
