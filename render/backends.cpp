#include "render/backend.h"
#include "render/raster/raster.h"
#include "render/raycast/raycast.h"
#include "render/reference/reference.h"

namespace render {

const std::vector<BackendInfo>& backends() {
  static const std::vector<BackendInfo> all{
      {"raster", "visible faces through Vulkan", make_raster_backend},
      {"raycast", "the grid walked on the CPU", make_raycast_backend},
      {"reference", "all light, by paths traced until the error is small", make_reference_backend},
  };
  return all;
}

}  // namespace render
