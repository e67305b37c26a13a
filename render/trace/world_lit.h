/// The world's light on surfaces that rays meet, as the rasterizer shades with it: for direct light, where light_model
/// or corner_occlusion asks for it.
#pragma once

#include <optional>

#include "render/light/voxel_light.h"
#include "render/trace/transport.h"

namespace render {

/// What a picture is told; all of it outlives the picture.
struct WorldLitSource {
  const SurfaceLight& faces;
  const WorldLight& light;
  const world::MaskVolume& shadows;  // of what hides the sky from corners
};

class WorldLit {
 public:
  WorldLit(const WorldLitSource& source, const world::WorldView& view, const SkyView& sky, const RenderKnobs& knobs);

  struct Light {
    Vec3d lit;           // radiance of an albedo of 1 beside the sun's and the luminaires'
    bool sunlit = true;  // false where sun_shadow=sky_light hides the sun
  };
  /// sky: what the surface has under the whole sky.
  Light at(const Surface& surface, const Vec3d& sky) const;

 private:
  Light at_mesh(const Surface& surface, const Vec3d& sky) const;
  uint32_t code(const Surface& surface) const;

  const WorldLitSource& source_;
  const RenderKnobs& knobs_;
  SurfaceLightDecoder decoder_;
  VoxelCodes voxels_;
};

}  // namespace render
