// Light of the sun and of luminaires on a point, scattered towards the eye by the block's BSDF: direct_radiance() of
// render/trace/direct.cpp.
#ifndef LOAM_RENDER_RASTER_SHADING_DIRECT_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_DIRECT_GLSL_H
// Two of the shared formulas have one name in two namespaces.
#define cosine_direction bsdf_cosine_direction
#include "render/bsdf/every_bsdf.shared.h"
#undef cosine_direction
#include "render/light/spot_map.shared.h"
#include "render/raster/shading/grid.glsl.h"
#include "render/raster/shading/luminaires.glsl.h"
#include "render/raster/shading/media.glsl.h"
#include "render/raster/shading/random.glsl.h"

layout(constant_id = kSpecLuminaireShadow) const uint kLuminaireShadow = 0u;

// As render/trace/transport.h lays out a pixel's numbers.
const uint kVertexDimension = 8u, kDimensionsPerVertex = 16u, kOnLight = 1u, kOcclusion = 9u;

/// The block of a surface, made ready.
struct Scatterer {
  uint bsdf;
  bool finite;
  vec3 albedo;  // of all that it scatters, as if it were matte: by impulses alone, or light of no known direction
  BsdfParameters parameters;
};
Scatterer scatterer_of(uint block) {
  const uint at = picture.luminaires.w + block * kBlockWords, kind = lighting_word(at + kBlockBsdf);
  Scatterer s;
  s.bsdf = kind & 0xffu;
  s.finite = (kind & kBlockFinite) != 0u;
  s.parameters.lambertian = s.albedo = lighting_vec3(at + kBlockLambertian);
  s.parameters.smoothness = lighting_float(at + kBlockSmoothness);
  s.parameters.glossy = lighting_vec3(at + kBlockGlossy);
  if (s.finite) s.albedo += s.parameters.glossy;
  s.parameters.eta = lighting_float(at + kBlockEta);
  s.parameters.transmission = lighting_vec3(at + kBlockTransmission);
  s.parameters.coverage = lighting_float(at + kBlockCoverage);
  s.parameters.emission = vec3(0.0);
  s.parameters.gloss = lighting_word(at + kBlockGloss);
  return s;
}

/// f |n . wi|
vec3 scattered_share(const Scatterer s, uint flags, vec3 wi, vec3 wo, vec3 n) {
  const float cosine = dot(n, wi);
  if (!(cosine > 0.0)) return vec3(0.0);
  if (!s.finite) return (flags & kLumNoMatte) != 0u ? vec3(0.0) : s.albedo * (cosine / 3.14159265);
  BsdfParameters p = s.parameters;
  if ((flags & kLumNoMatte) != 0u) p.lambertian = vec3(0.0);
  if ((flags & kLumNoGloss) != 0u) p.glossy = vec3(0.0);
  return bsdf_finite_density(s.bsdf, p, wi, wo, n) * cosine;
}

/// Where light falls: a voxel and a place in it, of the world.
struct LitPoint {
  ivec3 voxel;
  vec3 fraction;
  vec3 normal, to_eye;
  vec3 side;      // the normal without detail: no light comes from behind its plane
  uint triangle;  // that the place lies on, or kNoTriangle
  float lift;     // m along the normal that rays to lights start off the place; only of a smooth surface
};

/// By the map of a spot.
float spot_map_lit(uint at, const LitPoint p, vec3 direction, float distance) {
  const int size = int(lighting_word(at + kLumMapSize));
  const uint depths = lighting_word(at + kLumMap) - 1u;
  const vec3 axis = lighting_vec3(at + kLumAxis), up = lighting_vec3(at + kLumUp);
  const float texels = float(size), half_edge = spot_map_half(lighting_float(at + kLumTangent), texels);
  const vec2 place = spot_map_place(-direction, axis, cross(up, axis), up, half_edge, texels), base = floor(place);
  vec4 four;
  for (int i = 0; i < 4; ++i) {
    const ivec2 t = clamp(ivec2(base) + ivec2(i & 1, i >> 1), ivec2(0), ivec2(size - 1));
    four[i] = lighting_float(depths + uint(t.y * size + t.x));
  }
  const float bias = sun_map_bias(spot_map_texel(half_edge, texels, distance), abs(dot(p.normal, direction)));
  return sun_map_lit(four, place - base, distance - bias);
}

/// The part of a sample of a luminaire that nothing hides.
float luminaire_visible(uint at, const LitPoint p, uint flags, vec3 direction, float distance) {
  if (kLuminaireShadow == kLuminaireShadowNone || (flags & kLumNoShadow) != 0u) return 1.0;
  if (kLuminaireShadow == kLuminaireShadowMap && !kTrianglesAlone && lighting_word(at + kLumMap) != 0u)
    return kMeshes && meets_mesh(p.voxel, p.fraction, direction, distance * (1.0 - 1e-4), p.triangle)
               ? 0.0
               : spot_map_lit(at, p, direction, distance);
  return nothing_between(p.voxel, p.fraction + p.lift * p.normal, direction, distance * (1.0 - 1e-4), p.triangle) ? 1.0
                                                                                                                  : 0.0;
}

vec3 one_luminaire(uint number, const LitPoint p, const Scatterer s) {
  const uint at = picture.luminaires.x + number * kLuminaireWords, flags = lighting_word(at + kLumKind);
  vec3 receiver = vec3(0.0);
  if ((flags & kLumFinite) != 0u) {
    receiver = p.fraction - lighting_place(at + kLumVoxel, p.voxel);
    const float reach = lighting_float(at + kLumReach);
    if (dot(receiver, receiver) > reach * reach) return vec3(0.0);
  }
  const uint samples = (flags & kLumImpulse) != 0u ? 1u : picture.light_samples.x;
  const uint dimension = kVertexDimension + (number + 1u) * kDimensionsPerVertex * 64u + kOnLight;
  const Emitter emitter = luminaire_emitter(at);
  const vec3 colour = lighting_vec3(at + kLumColour);
  vec3 sum = vec3(0.0);
  for (uint i = 0u; i < samples; ++i) {
    const vec2 u = samples == 1u && (flags & kLumImpulse) != 0u
                       ? vec2(0.0)
                       : sampler_two(dimension, i, picture.light_samples.y == 0u);
    const ArrivingLight light = luminaire_light(at, flags, emitter, colour, receiver, u);
    if (!(largest_band(light.biradiance) > 0.0 && dot(light.direction, p.side) > 0.0)) continue;
    vec3 arrives = light.biradiance * scattered_share(s, flags, light.direction, p.to_eye, p.normal);
    if (!(largest_band(arrives) > 0.0)) continue;
    arrives *= luminaire_visible(at, p, flags, light.direction, light.distance);
    if (!(largest_band(arrives) > 0.0)) continue;
    if (kMedia) arrives *= media_transmittance(p.voxel, p.fraction, light.direction, light.distance);
    sum += arrives;
  }
  return sum / float(samples);
}

/// What reaches the cell that holds a voxel: where its list is, and how long. Bounded as find_blocker_region() is.
uvec2 luminaires_of_cell(ivec3 voxel) {
  const ivec3 cell = voxel >> picture.light_cells.z;
  const uint last = picture.light_cells.y;
  for (uint k = 0u, i = region_hash(cell.x, cell.y, cell.z); k <= last; ++k, ++i) {
    const uint at = picture.light_cells.x + (i & last) * kCellWords;
    const uint list = lighting_word(at + 3u);
    if (list == 0u) return uvec2(0);
    if (lighting_ivec3(at) == cell) return uvec2(list, lighting_word(at + 4u));
  }
  return uvec2(0);
}

/// All of them in one loop: each further place that calls one_luminaire() is so much more to compile.
vec3 luminaires_at(const LitPoint p, const Scatterer s) {
  const uint everywhere = picture.luminaires.z;
  const uvec2 near = picture.light_cells.x == 0u ? uvec2(0) : luminaires_of_cell(p.voxel);
  vec3 sum = vec3(0.0);
  for (uint i = 0u; i < everywhere + near.y; ++i)
    sum += one_luminaire(lighting_word(i < everywhere ? picture.luminaires.y + i : near.x + i - everywhere), p, s);
  return sum;
}

#endif
