// Luminaires: points of them as a surface samples them, and what of them the eye sees. The formulas are those of
// world/luminaires/<kind>.shared.h; images and the choice among a mesh's triangles are sampler.cpp's.
#ifndef LOAM_RENDER_RASTER_SHADING_LUMINAIRES_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_LUMINAIRES_GLSL_H
#include "render/raster/shading/lighting.glsl.h"
// A picture has no code for kinds of luminaires that its world doesn't have: software would run it for each of them.
#define CALLED_FOR_LUMINAIRE(number) ((kLuminaireKinds >> number & 1u) != 0u)
#include "world/luminaires/every_luminaire.shared.h"

layout(binding = kBindSeenLuminaires) uniform usamplerBuffer seen_luminaires;
uint seen_luminaires_word(uint at) { return texelFetch(seen_luminaires, int(at)).x; }

const bool kMeshesShine = CALLED_FOR_LUMINAIRE(LUMINAIRE_mesh);
const bool kSlides = (kLuminaireKinds & kLuminaireSlides) != 0u, kSkies = (kLuminaireKinds & kLuminaireSkies) != 0u;
const uint kKindsAlone = kLuminaireKinds & ~(kLuminaireSlides | kLuminaireSkies);

/// From a luminaire's flags.
uint luminaire_kind(uint flags) {
  return (kKindsAlone & (kKindsAlone - 1u)) == 0u ? uint(findLSB(kKindsAlone)) : flags & 0xffu;
}

Emitter luminaire_emitter(uint at) {
  const uint flags = lighting_word(at + kLumKind);
  Emitter e;
  e.axis = lighting_vec3(at + kLumAxis);
  e.up = lighting_vec3(at + kLumUp);
  e.right = cross(e.up, e.axis);
  e.extent = vec2(lighting_float(at + kLumExtent), lighting_float(at + kLumExtent + 1u));
  e.radius = lighting_float(at + kLumRadius);
  e.cone = lighting_float(at + kLumCone);
  e.inner_cone = lighting_float(at + kLumCone + 1u);
  e.tan_half_angle = lighting_float(at + kLumTangent);
  e.attenuation = lighting_vec3(at + kLumAttenuation);
  e.corner = e.edge1 = e.edge2 = vec3(0.0);
  e.at_infinity = (flags & kLumAtInfinity) != 0u ? 1u : 0u;
  e.whole_sphere = (flags & kLumWhole) != 0u ? 1u : 0u;
  e.uniform_area = (flags & kLumUniform) != 0u ? 1u : 0u;
  return e;
}

/// One triangle in the place of a mesh's emitter.
void set_part(inout Emitter e, uint part) {
  e.corner = lighting_vec3(part);
  e.edge1 = lighting_vec3(part + 3u);
  e.edge2 = lighting_vec3(part + 6u);
  e.axis = normalize(cross(e.edge1, e.edge2));
}

/// Between the centres of an image's pixels.
vec3 image_value(uint at, vec2 place, bool sky) {
  const uint packed = lighting_word(at + kLumImageSize), pixels = lighting_word(at + kLumImage);
  const ivec2 size = ivec2(packed & 0xffffu, packed >> 16);
  const vec2 p = place * vec2(size) - 0.5, base = floor(p), f = p - base;
  vec3 sum = vec3(0.0);
  for (int i = 0; i < 4; ++i) {
    const ivec2 corner = ivec2(i & 1, i >> 1);
    ivec2 c = ivec2(base) + corner;
    if (sky) c.x = (c.x % size.x + size.x) % size.x;
    const ivec2 inside = clamp(c, ivec2(0), size - 1);
    if (!sky && inside != c) continue;  // a slide is black beyond its border
    const vec2 w = mix(1.0 - f, f, vec2(corner));
    sum += w.x * w.y * lighting_vec3(pixels + 3u * uint(inside.y * size.x + inside.x));
  }
  return sum;
}

/// ImageDistribution's step_of(): the first of `count` rising sums above u times the last.
struct ImageStep {
  uint index;
  float within, weight;
};
ImageStep image_step(uint sums, uint count, float u) {
  const float last = lighting_float(sums + count - 1u), target = u * last;
  uint low = 0u, high = count - 1u;
  while (low < high) {
    const uint middle = (low + high) / 2u;
    if (lighting_float(sums + middle) > target)
      high = middle;
    else
      low = middle + 1u;
  }
  ImageStep s;
  s.index = low;
  const float before = low > 0u ? lighting_float(sums + low - 1u) : 0.0;
  s.weight = lighting_float(sums + low) - before;
  s.within = s.weight > 0.0 ? clamp((target - before) / s.weight, 0.0, 0.9999999) : 0.0;
  return s;
}

/// A point of a luminaire, seen from a receiver, with the light of its colour.
struct ArrivingLight {
  vec3 direction;
  float distance;
  vec3 biradiance;  // radiance over density
};

ArrivingLight sky_image_sample(uint at, const Emitter e, vec3 colour, vec2 u) {
  const uint packed = lighting_word(at + kLumImageSize);
  const uint width = packed & 0xffffu, height = packed >> 16;
  const uint rows = lighting_word(at + kLumTables), columns = rows + height, cosines = columns + width * height;
  const ImageStep row = image_step(rows, height, u.y), column = image_step(columns + row.index * width, width, u.x);
  const float top = lighting_float(cosines + row.index), low = lighting_float(cosines + row.index + 1u);
  ArrivingLight light;
  light.direction = hemisphere_direction_from_sky(e, (float(column.index) + column.within) / float(width),
                                                  top + row.within * (low - top));
  light.distance = kAtInfinity;
  const float solid_angle = 2.0 * kEmitterPi / float(width) * (top - low);
  const float probability = column.weight / lighting_float(rows + height - 1u);
  light.biradiance = vec3(0.0);
  if (probability > 0.0)
    light.biradiance =
        image_value(at, hemisphere_sky_from_direction(e, light.direction), true) * (solid_angle / probability) * colour;
  return light;
}

/// e: its own, which is read once for all of its samples, as `colour` is.
ArrivingLight luminaire_light(uint at, uint flags, Emitter e, vec3 colour, vec3 receiver, vec2 u) {
  if (kSkies && (flags & kLumSky) != 0u) return sky_image_sample(at, e, colour, u);
  if (kMeshesShine && (flags & kLumMesh) != 0u) {
    const uint parts = lighting_word(at + kLumParts), count = lighting_word(at + kLumPartCount);
    const float target = u.x * lighting_float(at + kLumArea);
    uint low = 0u, high = count - 1u;
    while (low < high) {
      const uint middle = (low + high) / 2u;
      if (lighting_float(parts + middle * kPartWords + 9u) > target)
        high = middle;
      else
        low = middle + 1u;
    }
    const float before = low > 0u ? lighting_float(parts + (low - 1u) * kPartWords + 9u) : 0.0;
    u.x = clamp((target - before) / (lighting_float(parts + low * kPartWords + 9u) - before), 0.0, 0.9999999);
    set_part(e, parts + low * kPartWords);
  }
  const EmitterSample s = luminaire_sample(luminaire_kind(flags), e, receiver, u);
  ArrivingLight light;
  light.direction = s.direction;
  light.distance = s.distance;
  light.biradiance = s.biradiance * colour;
  if (kSlides && (flags & kLumSlide) != 0u) {
    const vec3 place = gobo_slide_from_direction(e, -s.direction);
    light.biradiance *= place.z > 0.0 ? image_value(at, place.xy, false) : vec3(0.0);
  }
  return light;
}

/// Radiance of a luminaire at no place along a direction.
vec3 far_luminaire_radiance(uint at, vec3 direction) {
  const uint flags = lighting_word(at + kLumKind);
  const Emitter e = luminaire_emitter(at);
  const EmitterHit hit = luminaire_meet(luminaire_kind(flags), e, vec3(0.0), direction);
  if (!(hit.distance >= 0.0)) return vec3(0.0);
  const vec3 colour = lighting_vec3(at + kLumColour);
  if (kSkies && (flags & kLumSky) != 0u)
    return colour * image_value(at, hemisphere_sky_from_direction(e, direction), true);
  return colour * hit.radiance;
}

/// The luminaires that a ray from the camera's place through a pixel meets: its nearest, up to a distance.
struct SeenLuminaire {
  float distance;  // m, below 0: none
  vec3 radiance;
};
SeenLuminaire seen_luminaire(uvec2 pixel, vec3 direction, float farthest) {
  SeenLuminaire seen;
  seen.distance = -1.0;
  seen.radiance = vec3(0.0);
  const uint tile = (pixel.y / kSeenTile) * picture.luminaires_seen.y + pixel.x / kSeenTile;
  const uint list = seen_luminaires_word(2u * tile), count = seen_luminaires_word(2u * tile + 1u);
  for (uint i = 0u; i < count; ++i) {
    // Of a mesh, each part by itself.
    const uint number = seen_luminaires_word(list + 2u * i), part = seen_luminaires_word(list + 2u * i + 1u);
    const uint at = picture.luminaires.x + number * kLuminaireWords, flags = lighting_word(at + kLumKind);
    Emitter e = luminaire_emitter(at);
    float share = 1.0;
    if (kMeshesShine && (flags & kLumMesh) != 0u) {
      set_part(e, lighting_word(at + kLumParts) + part * kPartWords);
      share = mesh_area(e) / lighting_float(at + kLumArea);
    }
    const vec3 origin = picture.fraction.xyz - lighting_place(at + kLumVoxel, picture.camera_voxel.xyz);
    const EmitterHit hit = luminaire_meet(luminaire_kind(flags), e, origin, direction);
    // A luminaire on a face lies before it: kLuminaireTolerance of render/trace/geometry.h.
    if (!(hit.distance >= 0.0) || hit.distance * (1.0 - 1e-4) > farthest) continue;
    if (seen.distance >= 0.0 && hit.distance >= seen.distance) continue;
    seen.distance = hit.distance;
    seen.radiance = lighting_vec3(at + kLumColour) * (hit.radiance * share);
  }
  return seen;
}

#endif
