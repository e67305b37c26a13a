/// While it lives, shaders of devices that are made check each access to a buffer before they make it. A device says
/// among its messages what lay outside.
#pragma once

#include <cstdlib>

namespace render {

class GpuAssisted {
 public:
  GpuAssisted() { setenv(kVariable, "VK_VALIDATION_FEATURE_ENABLE_GPU_ASSISTED_EXT", 1); }
  ~GpuAssisted() { unsetenv(kVariable); }
  GpuAssisted(const GpuAssisted&) = delete;
  GpuAssisted& operator=(const GpuAssisted&) = delete;

 private:
  static constexpr const char* kVariable = "VK_LAYER_ENABLES";
};

}  // namespace render
