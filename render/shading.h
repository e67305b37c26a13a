/// What a voxel face shows: one table for each picture, so that every backend shades with the same numbers.
///
///   L = albedo/pi * (E_sky(face) + V * E_sun * max(0, n . s)) + P / (6 pi A)
/// with V the sun's visibility, P the block's emission, A = 1 m^2 of a face: a Lambertian emitter of six faces radiates
/// P = 6 * pi * A * L. What a block reflects glossily or as a mirror counts as matte here: albedo is k_L + k_g. source:
/// chapter 14.9.2 (Lambertian scattering), 14.4 (units)
#pragma once

#include <vector>

#include "render/image/image.h"
#include "render/sky_view.h"
#include "world/blocks/block.h"
#include "world/scenes/environment.h"
#include "world/scenes/sky.h"
#include "world/space/coords.h"

namespace render {

struct Shading {
  Rgb sky_lit[6];  // radiance of an albedo of 1 under the sky alone, by face
  Rgb sun_lit[6];  // added where the sun is visible; 0 on faces turned away
  bool sun_faces[6];
  struct Material {
    float albedo[3];   // matte and glossy
    float emitted[3];  // radiance
  };
  std::vector<Material> materials;  // by block id

  Shading(const SkyView& sky, const world::BlockPalette& palette);

  Rgb face_radiance(world::BlockId block, int face, bool sun_visible) const {
    return face_radiance(block, face, sun_visible ? 1.0f : 0.0f, sky_lit[face]);
  }
  /// `sun`: the part of its light that arrives. `lit`: radiance of an albedo of 1 there without it. `texture`: what the
  /// albedo is multiplied by.
  Rgb face_radiance(world::BlockId block, int face, float sun, Rgb lit, float texture = 1) const {
    const Material& m = materials[block];
    lit = (lit + sun_lit[face] * sun) * texture;
    return {m.albedo[0] * lit.r + m.emitted[0], m.albedo[1] * lit.g + m.emitted[1], m.albedo[2] * lit.b + m.emitted[2]};
  }
};

/// The same on a surface of any unit normal. sun_arrives: the part of the sun's light. lit: radiance of an albedo of 1
/// there without the sun; null: under the sky.
Rgb normal_radiance(const Shading& shading, const SkyView& sky, world::BlockId block, const world::Vec3d& normal,
                    float sun_arrives, const Rgb* lit = nullptr);

/// Irradiance of the whole sky and ground on a face of the voxel grid: linear_sky_irradiance(), or the table of a
/// SkyLight.
world::Irradiance3 sky_irradiance(const SkyView& sky, int face);
/// The same on a surface with any unit normal.
world::Irradiance3 sky_irradiance(const SkyView& sky, const world::Vec3d& normal);

}  // namespace render
