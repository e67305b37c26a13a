#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Radiance of each pixel from what it sees: the formula of render/shading.h, and the sky where it sees nothing.
#include "render/raster/raster.shared.h"
#include "render/light/sun_map.shared.h"
#include "render/light/surface_light.shared.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = kSpecSunShadow) const uint kSunShadow = 0u;
layout(constant_id = kSpecLight) const uint kLight = 0u;
layout(constant_id = kSpecInterpolation) const uint kInterpolation = 0u;
layout(constant_id = kSpecCornerOcclusion) const bool kCornerOcclusion = false;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindMaterials, std430) readonly buffer Materials { vec4 materials[]; };
layout(binding = kBindSeen) uniform utexture2D seen_image;
layout(push_constant) uniform Band { uint first_row; };  // the rows of this dispatch; `radiance` starts at them
layout(binding = kBindRadiance, std430) writeonly buffer Radiance { float radiance[]; };

layout(binding = kBindRegions, std430) readonly buffer Regions { ivec4 regions[]; };
layout(binding = kBindGroups, std430) readonly buffer Groups { uint groups[]; };
layout(binding = kBindMasks, std430) readonly buffer Masks { uint masks[]; };

layout(binding = kBindLightRegions, std430) readonly buffer LightRegions { ivec4 light_regions[]; };
layout(binding = kBindLightLeafOf, std430) readonly buffer LightLeafOf { uint light_leaf_of[]; };
layout(binding = kBindLightLeaves, std430) readonly buffer LightLeaves { uint light_leaves[]; };
layout(binding = kBindLightCodes, std430) readonly buffer LightCodes { uint light_codes[]; };
layout(binding = kBindSunMap, std430) readonly buffer SunMap { float sun_map[]; };

/// The place of a region in `groups`, or -1 where all of it is clear.
int find_region(ivec3 region) {
  const uint last = uint(picture.region_min.w);
  for (uint i = region_hash(region.x, region.y, region.z);; ++i) {
    const ivec4 entry = regions[i & last];
    if (entry.w == 0) return -1;
    if (entry.xyz == region) return entry.w - 1;
  }
}

/// Size of the clear aligned cube around a voxel: 128, 32, 8 or 1; 0 where the voxel is opaque.
int clear_cube(ivec3 voxel, int region) {
  if (region < 0) return 128;
  const ivec3 leaf = voxel >> 3, g = leaf >> 2 & 3, l = leaf & 3, v = voxel & 7;
  const uint at = (uint(region) * 64u + uint(g.x * 16 + g.y * 4 + g.z)) * kGroupWords;
  const uint bit = uint(l.x * 16 + l.y * 4 + l.z);
  const uvec2 any = uvec2(groups[at], groups[at + 1u]);
  if ((any.x | any.y) == 0u) return 32;
  if (((bit < 32u ? any.x : any.y) >> (bit & 31u) & 1u) == 0u) return 8;
  const uvec2 full = uvec2(groups[at + 2u], groups[at + 3u]);
  if (((bit < 32u ? full.x : full.y) >> (bit & 31u) & 1u) != 0u) return 0;
  const uvec2 mixed = any & ~full;
  const uint below = (1u << (bit & 31u)) - 1u;
  const uint before = bit < 32u ? uint(bitCount(mixed.x & below)) : uint(bitCount(mixed.x) + bitCount(mixed.y & below));
  const uint index = uint(v.y * 8 + v.z);
  const uint word = masks[(groups[at + 4u] + before) * 16u + uint(v.x) * 2u + (index >> 5)];
  return (word >> (index & 31u) & 1u) != 0u ? 0 : 1;
}

/// Whether nothing opaque lies between a point of a voxel and the sun. Distances are relative to the start, and each
/// crossing is worked out from its integer plane; the start is the voxel in front of a face, so no bias is needed.
bool sun_visible(const ivec3 start, const vec3 fraction) {
  const vec3 sun = picture.sun.xyz;
  const bvec3 up = greaterThanEqual(sun, vec3(0));
  const vec3 inverse = 1.0 / sun;
  ivec3 voxel = start, region = voxel >> 7;
  int place = find_region(region);
  for (int steps = 0; steps < 16384; ++steps) {
    const int size = clear_cube(voxel, place);
    if (size == 0) return false;
    // Leave the clear cube by the nearest of its planes ahead.
    const ivec3 low = voxel & ivec3(-size);
    const ivec3 planes = low + mix(ivec3(0), ivec3(size), up);
    vec3 t = (vec3(planes - start) - fraction) * inverse;
    t = mix(t, vec3(1e30), equal(sun, vec3(0)));
    const int axis = t.x <= t.y ? (t.x <= t.z ? 0 : 2) : (t.y <= t.z ? 1 : 2);
    voxel = clamp(start + ivec3(floor(fraction + t[axis] * sun)), low, low + (size - 1));
    voxel[axis] = up[axis] ? planes[axis] : planes[axis] - 1;
    const ivec3 next = voxel >> 7;
    if (next != region) {
      if (any(lessThan(next, picture.region_min.xyz)) || any(greaterThan(next, picture.region_max.xyz))) return true;
      region = next;
      place = find_region(region);
    }
  }
  return true;
}

/// SunMap::lit()
float sun_map_at(const ivec3 voxel, const vec3 fraction, const uint axis) {
  const SunMapFrame frame = SunMapFrame(picture.map_u, picture.map_v, picture.map_w, picture.map_low, picture.map_size);
  const vec3 place = sun_map_place(frame, vec3(voxel - frame.low.xyz) + fraction);
  const vec2 at = place.xy - 0.5;
  if (!(at.x >= 0.0 && at.y >= 0.0 && at.x < float(frame.size.x - 1) && at.y < float(frame.size.y - 1))) return 1.0;
  const uint first = uint(at.y) * uint(frame.size.x) + uint(at.x), next = first + uint(frame.size.x);
  const vec4 depths = vec4(sun_map[first], sun_map[first + 1u], sun_map[next], sun_map[next + 1u]);
  return sun_map_lit(depths, fract(at), place.z - sun_map_bias(frame.w.w, abs(picture.sun[axis])));
}

/// SurfaceLight::code()
uint light_code(const ivec3 voxel, const uint face) {
  const ivec3 region = voxel >> 7;
  const uint last = uint(picture.light.x);
  int place = -1;
  for (uint i = region_hash(region.x, region.y, region.z);; ++i) {
    const ivec4 entry = light_regions[i & last];
    if (entry.w == 0) return kLightUnknown;
    if (entry.xyz == region) {
      place = entry.w - 1;
      break;
    }
  }
  const ivec3 leaf = voxel >> 3 & 15, v = voxel & 7;
  const uint record = light_leaf_of[uint(place) * 4096u + uint(leaf.x * 256 + leaf.y * 16 + leaf.z)];
  if (record == 0u) return kLightUnknown;
  const uint at = (record - 1u) * kLightLeafWords, slice = uint(v.x), bit = uint(v.y * 8 + v.z);
  const uint words = at + face * 16u + slice * 2u;
  const uvec2 faces = uvec2(light_leaves[words], light_leaves[words + 1u]);
  if (((bit < 32u ? faces.x : faces.y) >> (bit & 31u) & 1u) == 0u) return kLightUnknown;
  const uint below = (1u << (bit & 31u)) - 1u;
  const uint in_slice = bit < 32u ? uint(bitCount(faces.x & below)) : uint(bitCount(faces.x) + bitCount(faces.y & below));
  const uint slot = face * 8u + slice;
  const uint before = light_leaves[at + kLightBefore + (slot >> 1)] >> ((slot & 1u) * 16u) & 0xffffu;
  return light_codes[light_leaves[at + kLightFirst] + before + in_slice];
}

/// SurfaceLightDecoder
vec3 decode_light(const uint code, const uint face) {
  const vec3 whole = picture.sky_lit[face].rgb;
  if (code == kLightUnknown) return whole;
  if (kLight == kLightIrradiance) {
    const float unit = uintBitsToFloat((127u - 24u + (code >> 27)) << 23);
    return vec3(code & 511u, code >> 9 & 511u, code >> 18 & 511u) * unit / 3.14159265;
  }
  vec3 lit;
  for (int b = 0; b < 3; ++b) {
    const uint level = code >> uint(4 * b) & 15u, of_blocks = code >> uint(12 + 4 * b) & 15u;
    lit[b] = whole[b] * picture.level_sky[level >> 2][level & 3u] + picture.level_block[of_blocks >> 2][of_blocks & 3u];
  }
  return lit;
}

bool sees_whole_sky(const uint code) {
  return code == kLightUnknown || (code & 15u) == 15u || (code >> 4 & 15u) == 15u || (code >> 8 & 15u) == 15u;
}

/// Light of a face at a place on it: light_on_face().
vec3 light_on_face(const ivec3 voxel, const uint face, const vec2 at, const uint own) {
  vec3 lit = kLight == kLightNone ? picture.sky_lit[face].rgb : decode_light(own, face);
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
      if (clear_cube(before, find_region(before >> 7)) != 0) open |= 1u << i;
    }
    lit *= corner_occlusion(open, at);
  }
  return lit;
}

vec3 sky(float cosine) {
  if (cosine < 0.0) return picture.sky_ground.rgb;
  return picture.sky_horizon.rgb + (picture.sky_zenith.rgb - picture.sky_horizon.rgb) * cosine;
}

void main() {
  const uvec2 pixel = gl_GlobalInvocationID.xy + uvec2(0, first_row);
  const uint width = uint(picture.screen.x), height = uint(picture.screen.y);
  if (pixel.x >= width || pixel.y >= height) return;
  const uvec2 seen = texelFetch(seen_image, ivec2(pixel), 0).xy;
  const vec3 ray = picture.corner.xyz + (float(pixel.x) + 0.5) * picture.step_x.xyz +
                   (float(pixel.y) + 0.5) * picture.step_y.xyz;
  const float inverse_length = inversesqrt(dot(ray, ray));
  vec3 colour = sky(ray.y * inverse_length);
  if (seen.x != 0u) {
    const uint face = seen.x >> kSeenFaceShift, axis = face >> 1, block = seen.x & 0xffffu;
    const vec3 offsets = float(int(seen.y)) - picture.fraction.xyz - picture.fraction_rest.xyz;
    const float t = axis == 0u ? offsets.x / ray.x : axis == 1u ? offsets.y / ray.y : offsets.z / ray.z;
    if (t <= picture.sun.w * inverse_length) {
      bool visible = picture.sun_lit[face].w != 0.0;
      // The voxel in front of the face, and the place exactly on the face.
      const vec3 hit = t * ray + picture.fraction.xyz;
      ivec3 start = ivec3(floor(hit));
      vec3 fraction = hit - vec3(start);
      const bool positive = (face & 1u) == 1u;
      const int plane = positive ? int(seen.y) : int(seen.y) - 1;
      const bvec3 own = bvec3(axis == 0u, axis == 1u, axis == 2u);
      start = mix(start, ivec3(plane), own);
      fraction = mix(fraction, vec3(positive ? 0.0 : 1.0), own);
      if (kSunShadow == kSunShadowRay && visible) visible = sun_visible(picture.camera_voxel.xyz + start, fraction);
      vec3 lit = picture.sky_lit[face].rgb;
      if (kLight != kLightNone || kCornerOcclusion) {
        ivec3 voxel = picture.camera_voxel.xyz + start;
        voxel[axis] -= positive ? 1 : -1;
        const ivec2 axes = light_axes(int(axis));
        vec2 at = vec2(fraction[axes.x], fraction[axes.y]);
        uint code = kLightUnknown;
        if (kLight != kLightNone) {
          code = light_code(voxel, face);
          if (code == kLightUnknown) {
            // Rounding may have put the place beyond an edge: the face across the nearest edge is the one that is seen.
            const vec2 inward = abs(at - 0.5);
            const int nearest = inward.x > inward.y ? 0 : 1;
            const int side = at[nearest] < 0.5 ? -1 : 1;
            ivec3 beside = voxel;
            beside[axes[nearest]] += side;
            const uint other = light_code(beside, face);
            if (other != kLightUnknown && inward[nearest] > 0.499) {
              code = other;
              voxel = beside;
              at[nearest] = side < 0 ? 1.0 : 0.0;
            }
          }
        }
        if (kSunShadow == kSunShadowSkyLight) visible = visible && sees_whole_sky(code);
        lit = light_on_face(voxel, face, at, code);
      }
      float sun = visible ? 1.0 : 0.0;
      if (kSunShadow == kSunShadowMap && visible) sun = sun_map_at(picture.camera_voxel.xyz + start, fraction, axis);
      lit += sun * picture.sun_lit[face].rgb;
      colour = materials[2u * block].rgb * lit + materials[2u * block + 1u].rgb;
    }
  }
  const uint at = 3u * (gl_GlobalInvocationID.y * width + pixel.x);
  radiance[at] = colour.r;
  radiance[at + 1u] = colour.g;
  radiance[at + 2u] = colour.b;
}
