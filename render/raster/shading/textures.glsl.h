// Textures of blocks: texture_factor() is TextureSet::factor() of render/textures/texture_set.h.
#ifndef LOAM_RENDER_RASTER_SHADING_TEXTURES_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_TEXTURES_GLSL_H
#include "render/raster/shading/picture.glsl.h"

layout(constant_id = kSpecTextures) const uint kTextures = 0u;
layout(constant_id = kSpecAnisotropy) const uint kAnisotropy = 1u;
layout(binding = kBindTexels) uniform samplerBuffer texture_texels;
#define TEXTURE_FOUR(i) texelFetch(texture_texels, int(i))
#include "render/textures/texture.shared.h"

/// What a block's albedo is multiplied by at a place of a voxel's face. `step_x`, `step_y`: to the next pixels on its
/// plane, m; zero where they aren't known.
float texture_factor(Material material, ivec3 voxel, uint face, vec3 fraction, vec3 step_x, vec3 step_y) {
  if (material.tiles == 0u) return 1.0;
  const int axis = int(face >> 1);
  return 1.0 + material.contrast * texture_value(material.tiles, kTextures, kAnisotropy, voxel, face,
                                                 texture_place(axis, fraction), texture_place(axis, step_x),
                                                 texture_place(axis, step_y));
}

layout(constant_id = kSpecNormalDetail) const float kNormalDetail = 0.0;

/// TextureSet::normal()
vec3 textured_normal(Material material, ivec3 voxel, uint face, vec3 fraction, vec3 step_x, vec3 step_y,
                     vec3 flat_normal) {
  if (material.tiles == 0u) return flat_normal;
  const int axis = int(face >> 1);
  return texture_normal(material.tiles, kTextures, kAnisotropy, voxel, face, texture_place(axis, fraction),
                        texture_place(axis, step_x), texture_place(axis, step_y), kNormalDetail * material.contrast);
}

#endif
