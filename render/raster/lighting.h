/// Luminaires, media and the scattering of blocks on the device, in the layout of lighting.shared.h: what a world that
/// calls for them adds to shading. Made anew where they change; a world that has none holds no buffer.
///
/// Which luminaires of an area the eye sees in which tile of the picture is worked out for each picture.
/// cost    144 bytes a luminaire and 4 for each cell that it reaches, see light_cells.h; images and density grids as
///         they are. A picture of seen luminaires: their boxes on the screen.
/// fails   where images and grids are larger than a storage buffer may be: those are left out, and dropped() names them
#pragma once

#include <string>
#include <vector>

#include "render/camera.h"
#include "render/gpu/owned.h"
#include "render/knobs.h"
#include "render/light/light_cells.h"
#include "render/raster/lighting.shared.h"
#include "render/raster/raster.shared.h"
#include "render/sky_view.h"
#include "world/store/ray_stream.h"
#include "world/world.h"

namespace render::raster {

/// What shading is compiled for, beside what the knobs say of the sun and of the world's cells.
struct LightingVariant {
  bool luminaires = false, media = false;
  uint32_t luminaire_kinds = 0;  // bits of LUMINAIRE_..., kLuminaireSlides, kLuminaireSkies
  uint32_t medium_kinds = 0;     // bits of MEDIUM_... and kMediumDensityGrid
  bool fog_shafts = false;       // fog asks for the sun along rays
  bool bsdf = false;             // blocks scatter by their BSDF, not by the sum of what they scatter
  uint32_t luminaire_shadow = 0;
  friend auto operator<=>(const LightingVariant&, const LightingVariant&) = default;
};

class Lighting {
 public:
  /// Follows the world's luminaires, media and palette. Returns the bytes sent.
  /// `opaque`: of the world, where the knobs ask for maps of spots.
  world::Result<uint64_t> follow(gpu::Device& device, const world::WorldView& view, const SkyView& sky,
                                 const world::RayStream* opaque, const RenderKnobs& knobs);
  /// Which luminaires are seen where, in a picture of this size. Returns the bytes sent.
  world::Result<uint64_t> see(gpu::Device& device, const Camera& camera, int width, int height);
  void describe(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs, uint64_t seed,
                PictureConstants& picture) const;

  /// Whether shading asks the grid of opaque voxels.
  bool casts_rays() const {
    return variant_.fog_shafts || (variant_.luminaires && variant_.luminaire_shadow != kLuminaireShadowNone);
  }
  const LightingVariant& variant() const { return variant_; }
  /// Null handles where there is nothing in them.
  const gpu::Buffer& words() const { return words_; }
  const gpu::Buffer& media_texels() const { return media_; }
  const gpu::Buffer& seen() const { return seen_; }
  size_t luminaires() const { return lights_.size(); }
  size_t media() const { return media_count_; }
  const LightCells& cells() const { return cells_; }
  uint64_t bytes() const { return words_.size + media_.size + seen_.size; }
  const std::vector<std::string>& dropped() const { return dropped_; }
  /// Bytes that the buffer may have, at most the device's limit; tests lower it.
  uint64_t binding_limit = ~uint64_t{0};
  /// The camera is in a liquid's voxel, in the air above it.
  bool eye_above_liquid = false;

 private:
  /// A part of a luminaire that the eye may see.
  struct SeenPart {
    uint32_t luminaire = 0, part = 0;
    world::WorldPoint position;
    world::Vec3d centre{0};  // from the position
    double radius = 0;       // of a sphere around the centre that holds it
  };
  world::Status add_luminaires(const world::World& world, const RenderKnobs& knobs, std::vector<uint32_t>& words);
  void add_spot_maps(const world::World& world, const world::RayStream& opaque, int texels,
                     std::vector<uint32_t>& words);
  void add_cells(std::vector<uint32_t>& words);
  /// Returns the records; density grids go to the words.
  std::vector<uvec4> add_media(const world::World& world, const SkyView& sky, FogLight fog,
                               std::vector<uint32_t>& words);
  void add_blocks(const world::World& world, const RenderKnobs& knobs, std::vector<uint32_t>& words);

  LightingVariant variant_;
  std::vector<LightCells::Light> lights_;
  std::vector<SeenPart> seen_parts_;
  std::vector<uint32_t> far_;  // numbers of luminaires at no place that are seen
  LightCells cells_;
  size_t media_count_ = 0;
  uint64_t signature_ = 0, limit_ = 0;
  uint32_t luminaires_at_ = 0, everywhere_at_ = 0, cells_at_ = 0, cell_slots_ = 0, blocks_at_ = 0, far_at_ = 0,
           tiles_across_ = 0;
  gpu::Buffer words_, media_, seen_;
  std::vector<std::string> dropped_;
};

}  // namespace render::raster
