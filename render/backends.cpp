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

void FrameReport::add_passes(const FrameReport& other) {
  faces_drawn += other.faces_drawn, rays += other.rays;
  for (const PassReport& pass : other.passes) {
    size_t i = 0;
    while (i < passes.size() && passes[i].name != pass.name) ++i;
    if (i == passes.size())
      passes.push_back(pass);
    else
      passes[i].ms += pass.ms, passes[i].draws += pass.draws, passes[i].bytes += pass.bytes;
  }
}

}  // namespace render
