// The world's light at a point that is on no face: light_at_point() of render/light/voxel_light.h.
#ifndef LOAM_RENDER_RASTER_SHADING_VOXEL_LIGHT_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_VOXEL_LIGHT_GLSL_H
#include "render/light/voxel_light.shared.h"
#include "render/raster/shading/face_light.glsl.h"

layout(binding = kBindVoxelLeaves) uniform isamplerBuffer voxel_leaves;
layout(binding = kBindVoxelCodes) uniform usamplerBuffer voxel_codes;

/// Place of a voxel's first code, or kLightUnknown where none is kept.
uint voxel_codes_at(const ivec3 voxel) {
  const ivec3 leaf = voxel >> 3, v = voxel & 7;
  for (uint i = region_hash(leaf.x, leaf.y, leaf.z);; ++i) {
    const ivec4 entry = texelFetch(voxel_leaves, int(i & picture.voxel_light.x));
    if (entry.w == 0) return kLightUnknown;
    if (entry.xyz == leaf)
      return (uint(entry.w - 1) * 512u + uint(v.x * 64 + v.y * 8 + v.z)) * (kLight == kLightIrradiance ? 6u : 1u);
  }
}

/// VoxelCodes::code()
uint voxel_code(const uint at, const uint face) {
  if (at == kLightUnknown) return picture.voxel_light.y;
  return texelFetch(voxel_codes, int(at + (kLight == kLightIrradiance ? face : 0u))).r;
}

vec3 light_in_voxel(const uint at, const vec3 normal, const vec3 sky) {
  if (kLight != kLightIrradiance) return decode_light_under(voxel_code(at, 0u), sky);
  vec3 lit = sky;
  for (int a = 0; a < 3; ++a) {
    const uint face = uint(2 * a) + (normal[a] > 0.0 ? 1u : 0u);
    lit += normal[a] * normal[a] * (decode_light_under(voxel_code(at, face), sky) - sky);
  }
  return lit;
}

// Nothing of the eight is kept in an array: drivers unroll loops over one, and lavapipe compiled for a minute.
ivec3 voxel_of_eight(const ivec3 first, const int i) { return first + ivec3(i & 1, i >> 1 & 1, i >> 2); }

uint clear_voxels(const ivec3 first, uint which) {
  uint clear = 0u;
  for (; which != 0u; which &= which - 1u) {
    const int i = findLSB(which);
    if (voxel_code(voxel_codes_at(voxel_of_eight(first, i)), 0u) != kLightClosed) clear |= 1u << uint(i);
  }
  return clear;
}

/// sky: what the surface has under the whole sky; whole_sky: what sun_shadow=sky_light asks.
vec3 light_at_point(const ivec3 voxel, const vec3 fraction, const vec3 normal, const vec3 sky, out bool whole_sky) {
  const vec3 low = floor(fraction - 0.5), place = fraction - 0.5 - low;
  const ivec3 first = voxel + ivec3(low);
  const bool linear = kInterpolation != kLightFace;
  uint clear = clear_voxels(first, linear ? 0xffu : 1u << uint(own_voxel(place)));
  if (!linear && clear == 0u) clear = clear_voxels(first, 0xffu);
  whole_sky = false;
  if (clear == 0u) return vec3(0);
  const int lit = lit_voxel(clear, place);
  const uint at = voxel_codes_at(voxel_of_eight(first, lit));
  whole_sky = kLight != kLightLevels || sees_whole_sky(voxel_code(at, 0u));
  const vec3 own = light_in_voxel(at, normal, sky);
  if (!linear) return own;
  vec3 sum = vec3(0);
  float total = 1e-6;
  for (uint left = reached_voxels(clear, lit); left != 0u; left &= left - 1u) {
    const int i = findLSB(left);
    const float weight = voxel_weight(place, i);
    sum += weight * (light_in_voxel(voxel_codes_at(voxel_of_eight(first, i)), normal, sky) - own);
    total += weight;
  }
  return own + sum / total;
}

#endif
