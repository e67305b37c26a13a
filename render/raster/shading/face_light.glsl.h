// Light on faces beside the sun: the sky's, and that of the world's cells (render/raster/light_grid.h).
#ifndef LOAM_RENDER_RASTER_SHADING_FACE_LIGHT_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_FACE_LIGHT_GLSL_H
#include "render/light/surface_light.shared.h"
#include "render/raster/shading/grid.glsl.h"

layout(binding = kBindLightRegions) uniform isamplerBuffer light_regions;
layout(binding = kBindLightLeafOf) uniform usamplerBuffer light_leaf_of;
layout(binding = kBindLightLeaves) uniform usamplerBuffer light_leaves;
layout(binding = kBindLightCodes) uniform usamplerBuffer light_codes;

uint light_leaf_word(uint at) { return texelFetch(light_leaves, int(at)).r; }

/// SurfaceLight::code()
uint light_code(const ivec3 voxel, const uint face) {
  const ivec3 region = voxel >> 7;
  const uint last = uint(picture.light.x);
  int place = -1;
  for (uint i = region_hash(region.x, region.y, region.z);; ++i) {
    const ivec4 entry = texelFetch(light_regions, int(i & last));
    if (entry.w == 0) return kLightUnknown;
    if (entry.xyz == region) {
      place = entry.w - 1;
      break;
    }
  }
  const ivec3 leaf = voxel >> 3 & 15, v = voxel & 7;
  const uint record = texelFetch(light_leaf_of, place * 4096 + leaf.x * 256 + leaf.y * 16 + leaf.z).r;
  if (record == 0u) return kLightUnknown;
  const uint at = (record - 1u) * kLightLeafWords, slice = uint(v.x), bit = uint(v.y * 8 + v.z);
  const uint words = at + face * 16u + slice * 2u;
  const uvec2 faces = uvec2(light_leaf_word(words), light_leaf_word(words + 1u));
  if (((bit < 32u ? faces.x : faces.y) >> (bit & 31u) & 1u) == 0u) return kLightUnknown;
  const uint below = (1u << (bit & 31u)) - 1u;
  const uint in_slice =
      bit < 32u ? uint(bitCount(faces.x & below)) : uint(bitCount(faces.x) + bitCount(faces.y & below));
  const uint slot = face * 8u + slice;
  const uint before = light_leaf_word(at + kLightBefore + (slot >> 1)) >> ((slot & 1u) * 16u) & 0xffffu;
  return texelFetch(light_codes, int(light_leaf_word(at + kLightFirst) + before + in_slice)).r;
}

/// SurfaceLightDecoder::under()
vec3 decode_light_under(const uint code, const vec3 whole) {
  if (code == kLightUnknown) return whole;
  if (kLight == kLightIrradiance) {
    const float unit = uintBitsToFloat((127u - 24u + (code >> 27)) << 23);
    return vec3(code & 511u, code >> 9 & 511u, code >> 18 & 511u) * unit / 3.14159265;
  }
  vec3 lit;
  for (int b = 0; b < 3; ++b) {
    const uint level = code >> uint(4 * b) & 15u, of_blocks = code >> uint(12 + 4 * b) & 15u;
    lit[b] = whole[b] * picture_arrays.level_sky[level >> 2][level & 3u] +
             picture_arrays.level_block[of_blocks >> 2][of_blocks & 3u];
  }
  return lit;
}

/// SurfaceLightDecoder
vec3 decode_light(const uint code, const uint face) { return decode_light_under(code, sky_lit(face)); }

bool sees_whole_sky(const uint code) {
  return code == kLightUnknown || (code & 15u) == 15u || (code >> 4 & 15u) == 15u || (code >> 8 & 15u) == 15u;
}

/// Light of a face at a place on it: light_on_face().
vec3 light_on_face(const ivec3 voxel, const uint face, const vec2 at, const uint own) {
  vec3 lit = kLight == kLightNone ? sky_lit(face) : decode_light(own, face);
  const int axis = int(face >> 1);
  const ivec2 axes = light_axes(axis);
  ivec3 step_u = ivec3(0), step_v = ivec3(0), ahead = ivec3(0);
  step_u[axes.x] = 1;
  step_v[axes.y] = 1;
  ahead[axis] = (face & 1u) == 1u ? 1 : -1;
  if (kLight != kLightNone && kInterpolation != kLightFace) {
    LightCells cells;
    cells.value[4] = lit;
    uint known = 1u << 4;
    for (int i = 0; i < 9; ++i) {
      if (i == 4) continue;
      const uint code = light_code(voxel + (i % 3 - 1) * step_u + (i / 3 - 1) * step_v, face);
      cells.value[i] = vec3(0);
      if (code == kLightUnknown) continue;
      cells.value[i] = decode_light(code, face);
      known |= 1u << i;
    }
    lit = kInterpolation == kLightVertex ? vertex_light(cells, known, at) : linear_light(cells, known, at);
  }
  if (kCornerOcclusion && kLight != kLightIrradiance) {
    uint open = 1u << 4;
    for (int i = 0; i < 9; ++i) {
      if (i == 4) continue;
      const ivec3 before = voxel + ahead + (i % 3 - 1) * step_u + (i / 3 - 1) * step_v;
      if (is_clear(before)) open |= 1u << i;
    }
    lit *= corner_occlusion(open, at);
  }
  return lit;
}

#endif
