/// The order of the passes. A row a pass: its file declares called_for and make.
#include "render/raster/faces_pass.h"
#include "render/raster/inhabitants_pass.h"
#include "render/raster/meshes_pass.h"
#include "render/raster/mirror_stencil_pass.h"
#include "render/raster/outline_pass.h"
#include "render/raster/shade_pass.h"
#include "render/raster/temporal_pass.h"
#include "render/raster/transparency_pass.h"

namespace render::raster {

std::span<const PassKind> pass_kinds() {
  static const PassKind kinds[] = {
      // What each pixel sees: into targets.seen and targets.depth.
      FacesPass::kind(), MeshesPass::kind(),
      // Of a picture in a mirror: where that is.
      MirrorStencilPass::kind(),
      // Radiance of what is seen: into targets.colour, or targets.radiance where a picture is too large for that.
      ShadePass::kind(),
      // Over the shaded picture, with its depth, into targets.colour:
      // Bodies, which may lie under water.
      BodiesPass::kind(),
      // See-through blocks.
      TransparencyPass::kind(),
      // Particles, so that rain before a lake isn't dimmed.
      ParticlesPass::kind(),
      // With what the pictures before saw: into targets.colour.
      TemporalPass::kind(),
      // The outline of what is picked.
      OutlinePass::kind(),
      // What is done with the whole picture, samples and effects, comes after all passes: render/effects/.
  };
  return kinds;
}

}  // namespace render::raster
