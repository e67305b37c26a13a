#include "render/backend.h"
#include "render/raster/raster.h"
#include "render/raycast/raycast.h"

namespace render {

const std::vector<BackendInfo>& backends() {
  static const std::vector<BackendInfo> all{
      {"raster", "visible faces through Vulkan", make_raster_backend},
      {"raycast", "the grid walked on the CPU", make_raycast_backend},
  };
  return all;
}

}  // namespace render
