/// The order of the passes. A row a pass: its file declares called_for and make.
#include "render/raster/faces_pass.h"
#include "render/raster/shade_pass.h"

namespace render::raster {

std::span<const PassKind> pass_kinds() {
  static const PassKind kinds[] = {
      // What each pixel sees: into targets.seen and targets.depth.
      FacesPass::kind(),
      // Radiance of what is seen: into targets.radiance, or targets.colour where a pass below needs that.
      ShadePass::kind(),
      // Over the shaded picture, with its depth: transparent things, particles.
      // On the whole picture: exposure, bloom, anti-aliasing.
  };
  return kinds;
}

}  // namespace render::raster
