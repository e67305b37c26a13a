// Textures of blocks: texture_factor() is TextureSet::factor() of render/textures/texture_set.h.
#ifndef LOAM_RENDER_RASTER_SHADING_TEXTURES_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_TEXTURES_GLSL_H
#include "render/raster/shading/picture.glsl.h"

layout(constant_id = kSpecTextures) const uint kTextures = 0u;
layout(constant_id = kSpecAnisotropy) const uint kAnisotropy = 1u;
layout(binding = kBindTextureBlocks) uniform usamplerBuffer texture_blocks;
layout(binding = kBindTexels) uniform samplerBuffer texture_texels;
#define TEXTURE_FOUR(i) texelFetch(texture_texels, int(i))
#include "render/textures/texture.shared.h"

/// What a block's albedo is multiplied by at a place of a voxel's face. `step_x`, `step_y`: to the next pixels on its
/// plane, m; zero where they aren't known.
float texture_factor(uint block, ivec3 voxel, uint face, vec3 fraction, vec3 step_x, vec3 step_y) {
  const uvec2 tiles = texelFetch(texture_blocks, int(block)).xy;
  if (tiles.x == 0u) return 1.0;
  const int axis = int(face >> 1);
  return 1.0 + uintBitsToFloat(tiles.y) * texture_value(tiles.x, kTextures, kAnisotropy, voxel, face,
                                                        texture_place(axis, fraction), texture_place(axis, step_x),
                                                        texture_place(axis, step_y));
}

layout(constant_id = kSpecNormalDetail) const float kNormalDetail = 0.0;

/// TextureSet::normal()
vec3 textured_normal(uint block, ivec3 voxel, uint face, vec3 fraction, vec3 step_x, vec3 step_y, vec3 flat_normal) {
  const uvec2 tiles = texelFetch(texture_blocks, int(block)).xy;
  if (tiles.x == 0u) return flat_normal;
  const int axis = int(face >> 1);
  return texture_normal(tiles.x, kTextures, kAnisotropy, voxel, face, texture_place(axis, fraction),
                        texture_place(axis, step_x), texture_place(axis, step_y),
                        kNormalDetail * uintBitsToFloat(tiles.y));
}

#endif
