// Hard case R12: a window whose size changes with each picture.
#include <csignal>
#include <string>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "render/gpu/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

namespace tools {
namespace {

/// A display that nobody sees, named by the environment while it lives.
class HiddenDisplay {
 public:
  HiddenDisplay() {
    int ends[2];
    if (pipe(ends) != 0) return;
    server_ = fork();
    if (server_ == 0) {
      close(ends[0]);
      const std::string number = std::to_string(ends[1]);
      if (!freopen("/dev/null", "w", stderr)) _exit(127);
      execlp("Xvfb", "Xvfb", "-displayfd", number.c_str(), "-screen", "0", "640x400x24", "-nolisten", "tcp", nullptr);
      _exit(127);
    }
    close(ends[1]);
    std::string display = ":";
    for (char c; read(ends[0], &c, 1) == 1 && c != '\n';) display += c;
    close(ends[0]);
    if (display.size() == 1) return;
    setenv("DISPLAY", display.c_str(), 1);
    runs_ = true;
  }
  ~HiddenDisplay() {
    unsetenv("DISPLAY");
    if (server_ > 0) kill(server_, SIGTERM), waitpid(server_, nullptr, 0);
  }
  bool runs() const { return runs_; }

 private:
  pid_t server_ = -1;
  bool runs_ = false;
};

TEST(HardCaseR12, AThousandSizesLeakNothingAndAreNoMistake) {
  const HiddenDisplay display;
  if (!display.runs()) GTEST_SKIP() << "Xvfb does not start here";
  ASSERT_TRUE(glfwInit());
  glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
  GLFWwindow* const glfw = glfwCreateWindow(64, 64, "sizes", nullptr, nullptr);
  ASSERT_TRUE(glfw);
  {
    uint32_t count = 0;
    const char** const names = glfwGetRequiredInstanceExtensions(&count);
    ASSERT_TRUE(names);
    render::gpu::DeviceOptions options;
    options.validation = true;
    options.instance_extensions.assign(names, names + count);
    options.make_surface = [glfw](VkInstance instance, VkSurfaceKHR* surface) {
      return glfwCreateWindowSurface(instance, glfw, nullptr, surface);
    };
    auto window = render::gpu::Window::make(options, false);
    ASSERT_TRUE(window.ok()) << window.error().message;
    uint64_t shown = 0, at_first = 0;
    for (int i = 0; i < 1000; ++i) {
      glfwSetWindowSize(glfw, 40 + i * 37 % 200, 30 + i * 53 % 150);
      glfwPollEvents();
      int width = 0, height = 0;
      glfwGetFramebufferSize(glfw, &width, &height);
      // Every tenth is told a size that the window had, as where it changes between the two calls.
      if (i % 10 == 9) width += 3;
      const auto drawn = (*window)->show({static_cast<uint32_t>(width), static_cast<uint32_t>(height)}, {});
      ASSERT_TRUE(drawn.ok()) << drawn.error().message;
      shown += *drawn;
      if (i == 10) at_first = (*window)->device().memory().bytes_used();
    }
    std::printf("  %llu pictures shown, %llu swapchains\n", static_cast<unsigned long long>(shown),
                static_cast<unsigned long long>((*window)->swapchains_made()));
    EXPECT_GT(shown, 500u);
    EXPECT_GT((*window)->swapchains_made(), 500u);
    EXPECT_EQ((*window)->device().memory().bytes_used(), at_first);
    EXPECT_EQ((*window)->device().messages(), std::vector<std::string>{});
  }
  glfwDestroyWindow(glfw);
  glfwTerminate();
}

}  // namespace
}  // namespace tools
