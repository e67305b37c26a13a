/// Light in single voxels of a world, as a light model found it: what surfaces that are no faces of voxels are shaded
/// with, triangles of meshes and smooth surfaces, in place of the open sky (light on faces: surface_light.h).
///
///   levels       a code a voxel: the voxel's own, as SurfaceLight's
///   irradiance   six codes a voxel, by face: what arrives on the first wall behind the voxel that looks that way.
///                Across a slanted surface with normal n they weigh n.x^2, n.y^2, n.z^2. Unknown where no wall is
///                behind: there the surface has the open sky
/// error  levels: none but that of levels. irradiance: exact on a wall; away from it, what
///        stands in the light of the wall alone counts for the voxel too, and what stands in that of the voxel alone
///        doesn't. A surface at 45 degrees under an even sky over black ground has 12 % less than it should, by
///        the mean of squares
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render/light/surface_light.h"
#include "render/light/voxel_light.shared.h"
#include "world/space/world_point.h"

namespace render {

/// The codes themselves, worked out where they are asked for. For the length of a picture.
class VoxelCodes {
 public:
  VoxelCodes(const world::WorldView& view, const WorldLight& light, SurfaceLight::Kind kind);

  SurfaceLight::Kind kind() const { return kind_; }
  int per_voxel() const { return kind_ == SurfaceLight::Kind::irradiance ? world::kFaces : 1; }
  /// Of a voxel where nothing keeps light.
  uint32_t outside() const;
  /// Whether the voxel has none of its own: codes are shared::kLightClosed then.
  bool closed(world::VoxelPos v) const {
    return kind_ == SurfaceLight::Kind::levels ? code(v, 0) == shared::kLightClosed : opaque_.test(v);
  }
  /// face: which of per_voxel()
  uint32_t code(world::VoxelPos v, int face) const;
  /// Where the light is of voxels: regions of levels, sorted; those that hold the irradiance's box.
  std::vector<world::RegionPos> regions() const;

 private:
  const world::LightVolume* levels_;
  const world::SurfaceIrradiance* irradiance_;
  const world::MaskVolume& occupied_;
  const world::MaskVolume& opaque_;
  SurfaceLight::Kind kind_;
};

/// Light at a point.
struct PointLight {
  Rgb lit;         // radiance of an albedo of 1
  bool whole_sky;  // what sun_shadow=sky_light asks
};
/// `normal`: of the surface, on the side that is seen; `sky`: what it has under the whole sky. Interpolation as the
/// knob says: `face` is the point's own voxel, the others are linear between middles of voxels.
PointLight light_at_point(const SurfaceLightDecoder& decoder, LightInterpolation interpolation,
                          const VoxelCodes& voxels, const world::WorldPoint& point, const world::Vec3d& normal,
                          const Rgb& sky);

/// The codes of some leaves, kept, as a rasterizer sends them: those around triangles.
class VoxelLight {
 public:
  /// Follows the world's light in these leaves, sorted. True where anything is new.
  /// cost   some 20 us a leaf of levels and 100 of irradiance, on all threads; what changes says, where it does
  bool follow(const world::WorldView& view, const WorldLight& light, SurfaceLight::Kind kind,
              std::span<const world::LeafPos> leaves);
  void clear();

  std::span<const world::LeafPos> leaves() const { return leaves_; }
  uint32_t codes_per_leaf() const { return codes_per_leaf_; }
  const std::vector<uint32_t>& codes() const { return codes_; }  // [leaf][index_in_leaf][face]
  /// What the last follow() made anew, as places in leaves(); empty where all was.
  const std::vector<uint32_t>& patched() const { return patched_; }

 private:
  void make(const VoxelCodes& voxels, size_t leaf);

  std::vector<world::LeafPos> leaves_;
  std::vector<uint32_t> codes_, patched_;
  uint32_t codes_per_leaf_ = 0;
  SurfaceLight::Kind kind_ = SurfaceLight::Kind::none;
  uint64_t store_ = 0, light_ = 0, changes_ = 0;
  int block_subscriber_ = 0, light_subscriber_ = 0;
};

}  // namespace render
