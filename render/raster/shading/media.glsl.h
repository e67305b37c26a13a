// Fog along a ray: fog_along() and transmittance() of render/trace/volumes.h, by the same closed forms; density grids
// by equal steps at whose middles the density is taken. Shafts of light in it: render/light/fog_shafts.shared.h.
#ifndef LOAM_RENDER_RASTER_SHADING_MEDIA_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_MEDIA_GLSL_H
#include "render/light/fog_shafts.shared.h"
#include "render/raster/shading/lighting.glsl.h"
#include "render/raster/shading/sun.glsl.h"
#include "render/raster/shading/sun_blockers.glsl.h"
#include "world/media/every_medium.shared.h"

layout(constant_id = kSpecFogShafts) const bool kFogShafts = false;

/// Bits of the kinds that the picture's media are of.
layout(constant_id = kSpecMediumKinds) const uint kMediumKinds = 0u;
layout(binding = kBindMedia) uniform usamplerBuffer medium_records;

/// The record of one medium, and the start of a ray relative to its position.
struct NearMedium {
  int at;
  uint kind;
  float scale;
  vec3 origin;
};
uvec4 medium_words(const NearMedium m, uint texel) { return texelFetch(medium_records, m.at + int(texel)); }
vec4 medium_texel(const NearMedium m, uint texel) { return uintBitsToFloat(medium_words(m, texel)); }
NearMedium near_medium(uint number, ivec3 voxel, vec3 fraction) {
  NearMedium m;
  m.at = int(number * kMediumTexels);
  const uvec4 place = medium_words(m, kMedVoxel);
  const vec4 in_voxel = medium_texel(m, kMedFraction);
  m.kind = place.w;
  m.scale = in_voxel.w;
  m.origin = fraction - (vec3(ivec3(place.xyz) - voxel) + in_voxel.xyz);
  return m;
}
vec3 medium_extinction(const NearMedium m) { return medium_texel(m, kMedExtinction).xyz; }

/// Whether it is of this kind: software runs all branches that may be taken, so those of absent kinds aren't there.
bool is_of_kind(const NearMedium m, uint kind) {
  return (kMediumKinds >> kind & 1u) != 0u && (kMediumKinds == 1u << kind || m.kind == kind);
}

MediumShape medium_shape(const NearMedium m) {
  MediumShape shape;
  shape.half_extent = medium_texel(m, kMedHalfExtent).xyz;
  shape.normal = medium_texel(m, kMedNormal).xyz;
  shape.scale_height = m.scale;
  return shape;
}

vec2 grid_span(const NearMedium m, vec3 direction) {
  const vec3 low = medium_texel(m, kMedHalfExtent).xyz * m.scale, high = medium_texel(m, kMedNormal).xyz * m.scale;
  vec2 span = medium_everywhere();
  for (int a = 0; a < 3; ++a) {
    const float to_low = low[a] - m.origin[a], to_high = high[a] - m.origin[a];
    if (direction[a] == 0.0) {
      if (to_low > 0.0 || to_high < 0.0) return medium_nowhere();
      continue;
    }
    const float x = to_low / direction[a], y = to_high / direction[a];
    span = vec2(max(span.x, min(x, y)), min(span.y, max(x, y)));
  }
  return span;
}

/// A voxel's sample.
float grid_sample(uint table, ivec3 low, ivec3 size, ivec3 voxel) {
  const ivec3 leaf = (voxel >> 3) - low;
  if (any(lessThan(leaf, ivec3(0))) || any(greaterThanEqual(leaf, size))) return 0.0;
  const uint brick = lighting_word(table + kMediumLeavesHead + uint((leaf.x * size.y + leaf.y) * size.z + leaf.z));
  if (brick == 0u) return 0.0;
  const ivec3 v = voxel & 7;
  return lighting_float(brick + uint(v.x * 64 + v.y * 8 + v.z));
}

float grid_density(const NearMedium m, vec3 voxels) {
  const uint table = medium_words(m, kMedEmission).w;
  const ivec3 low = lighting_ivec3(table), size = lighting_ivec3(table + 3u);
  if (medium_words(m, kMedInSun).w == 0u) return grid_sample(table, low, size, ivec3(floor(voxels)));
  const vec3 shifted = voxels - 0.5, base = floor(shifted), f = shifted - base;
  const ivec3 v = ivec3(base);
  float sum = 0.0;
  for (int i = 0; i < 8; ++i) {
    const ivec3 corner = ivec3(i & 1, i >> 1 & 1, i >> 2);
    const vec3 w = mix(1.0 - f, f, vec3(corner));
    const float weight = w.x * w.y * w.z;
    if (weight > 0.0) sum += weight * grid_sample(table, low, size, v + corner);
  }
  return sum;
}

vec2 span_of(const NearMedium m, vec3 direction) {
  const MediumShape shape = medium_shape(m);
#define MEDIUM(name) \
  if (is_of_kind(m, MEDIUM_##name)) return name##_span(shape, m.origin, direction);
#include "world_media.list.h"
#undef MEDIUM
  if (is_of_kind(m, kMediumDensityGrid)) return grid_span(m, direction);
  return medium_nowhere();
}

/// The integral of the density over [t0, t1], m; of a density grid in so many steps.
float depth_in_steps(const NearMedium m, vec3 direction, float t0, float t1, uint steps) {
  const vec2 span = span_of(m, direction);
  t0 = max(t0, span.x);
  t1 = min(t1, span.y);
  if (!(t0 < t1)) return 0.0;
  const MediumShape shape = medium_shape(m);
#define MEDIUM(name) \
  if (is_of_kind(m, MEDIUM_##name)) return name##_depth(shape, m.origin, direction, t0, t1);
#include "world_media.list.h"
#undef MEDIUM
  if (!is_of_kind(m, kMediumDensityGrid)) return 0.0;
  const float inverse = 1.0 / m.scale;
  const float stretch = (t1 - t0) / float(steps);
  float sum = 0.0;
  for (uint i = 0u; i < steps; ++i)
    sum += grid_density(m, (m.origin + (t0 + (float(i) + 0.5) * stretch) * direction) * inverse);
  return sum * stretch;
}
float depth_of(const NearMedium m, vec3 direction, float t0, float t1) {
  return depth_in_steps(m, direction, t0, t1, picture.media.y);
}

vec3 attenuation(vec3 sigma, float depth) {
  return vec3(beer_lambert(sigma.x, depth), beer_lambert(sigma.y, depth), beer_lambert(sigma.z, depth));
}

/// What passes from a point along a direction up to t_end.
vec3 media_transmittance(ivec3 voxel, vec3 fraction, vec3 direction, float t_end) {
  vec3 passed = vec3(1.0);
  for (uint i = 0u; i < picture.media.x; ++i) {
    const NearMedium m = near_medium(i, voxel, fraction);
    passed *= attenuation(medium_extinction(m), depth_of(m, direction, 0.0, t_end));
  }
  return passed;
}

/// phase_density() of render/trace/volumes.h
float phase_density(float g, float cosine) {
  const float d = 1.0 + g * g - 2.0 * g * cosine;
  return (1.0 - g * g) / (4.0 * 3.14159265 * d * sqrt(d));
}

/// A medium's own radiance along a direction, with what it scatters in. sun: what arrives of the sun's light.
vec3 medium_source(const NearMedium m, vec3 direction, vec3 sun) {
  return medium_texel(m, kMedEmission).xyz +
         sun * medium_texel(m, kMedInSun).xyz *
             phase_density(medium_texel(m, kMedExtinction).w, dot(picture.sun.xyz, direction));
}

/// What is seen through the media and of them alone: value multiplies what lies behind.
struct FogView {
  vec3 value, added;
};

/// Goes on with a view that ends at t.
void see_fog(inout FogView view, ivec3 voxel, vec3 fraction, vec3 direction, float t, float t_end, vec3 sun) {
  // Between the ends of stretches the set of media is the same.
  for (uint part = 0u; part <= 2u * picture.media.x && t < t_end; ++part) {
    float next = t_end;
    for (uint i = 0u; i < picture.media.x; ++i) {
      const vec2 span = span_of(near_medium(i, voxel, fraction), direction);
      if (!(span.x < span.y)) continue;
      if (span.x > t) next = min(next, span.x);
      if (span.y > t) next = min(next, span.y);
    }
    vec3 depth = vec3(0.0), shine = vec3(0.0);
    for (uint i = 0u; i < picture.media.x; ++i) {
      const NearMedium m = near_medium(i, voxel, fraction);
      const vec2 span = span_of(m, direction);
      if (!(span.x < span.y) || span.x >= next || span.y <= t) continue;
      const float d = depth_of(m, direction, t, next);
      if (!(d > 0.0)) continue;
      const vec3 sigma = medium_extinction(m), source = medium_source(m, direction, sun);
      for (int b = 0; b < 3; ++b) {
        if (!(sigma[b] > 0.0)) continue;
        depth[b] += sigma[b] * d;
        shine[b] += min(sigma[b] * d, 1e30) * source[b];
      }
    }
    for (int b = 0; b < 3; ++b) {
      if (!(depth[b] > 0.0)) continue;
      view.added[b] += view.value[b] * (shine[b] / min(depth[b], 1e30)) * opacity(depth[b]);
      view.value[b] *= exp(-depth[b]);
    }
    t = next;
  }
}

/// Of the pixel at hand; main() sets it.
float fog_shift = 0.5;

/// All media's depth over [t0, t1], the mean of the bands: about that, in density grids.
float mean_depth(ivec3 voxel, vec3 fraction, vec3 direction, float t0, float t1) {
  float sum = 0.0;
  for (uint i = 0u; i < picture.media.x; ++i) {
    const NearMedium m = near_medium(i, voxel, fraction);
    const vec2 span = span_of(m, direction);
    const float from = max(t0, span.x), to = min(t1, span.y);
    if (!(from < to)) continue;
    sum +=
        dot(medium_extinction(m), vec3(1.0 / 3.0)) * depth_in_steps(m, direction, from, to, uint(kFogShaftGridSteps));
  }
  return sum;
}

/// Where the pieces lie; x >= y: the ray meets no medium.
vec2 fog_shaft_span(ivec3 voxel, vec3 fraction, vec3 direction, float t_end) {
  vec2 all = vec2(t_end, 0.0);
  for (uint i = 0u; i < picture.media.x; ++i) {
    const vec2 span = span_of(near_medium(i, voxel, fraction), direction);
    if (span.x < span.y) all = vec2(min(all.x, max(span.x, 0.0)), max(all.y, min(span.y, t_end)));
  }
  all.y = min(all.y, kFogShaftFarthest);
  if (!(all.x < all.y)) return all;
  const float most = all.y - all.x, total = mean_depth(voxel, fraction, direction, all.x, all.y);
  if (fog_shafts_go_through(mean_depth(voxel, fraction, direction, all.x, all.x + 0.5 * most), total)) return all;
  const float wanted = fog_shaft_depth(total);
  float high = 1.0;
  for (int i = 0; i < kFogShaftDoublings && high < most; ++i) {
    if (!(mean_depth(voxel, fraction, direction, all.x, all.x + high) < wanted)) break;
    high *= 2.0;
  }
  float low = 0.5 * high;
  for (int i = 0; i < kFogShaftHalvings; ++i) {
    const float middle = 0.5 * (low + high);
    if (mean_depth(voxel, fraction, direction, all.x, all.x + middle) < wanted)
      low = middle;
    else
      high = middle;
  }
  all.y = all.x + min(high, most);
  return all;
}

/// Of the sun's light what comes to a place along the ray, past what is opaque, through what isn't and the media.
vec3 sun_in_fog(ivec3 voxel, vec3 fraction, vec3 direction, float t) {
  const vec3 place = fraction + t * direction, corner = floor(place);
  const ivec3 there = voxel + ivec3(corner);
  if (!sun_visible(there, place - corner, kNoTriangle)) return vec3(0.0);
  vec3 arrives = media_transmittance(there, place - corner, picture.sun.xyz, kMediumFar);
  if (kSunBlockers) arrives *= sun_let_through(there, place - corner);
  if (kCloudShadows) arrives *= sun_through_clouds(there, place - corner);
  return arrives;
}

/// A ray through fog, as far as it has been followed.
struct FogWalk {
  ivec3 voxel;  // of its start
  vec3 fraction, direction;
  FogView view;     // up to t
  vec2 span;        // where the pieces lie
  float t, last;    // where the piece at hand ends
  uint pieces, at;  // how many, and those begun
  vec3 sun;         // that comes to the piece at hand
};

/// t_end: where the ray ends, past all that is seen through.
FogWalk begin_fog(ivec3 voxel, vec3 fraction, vec3 direction, float t_end) {
  FogWalk w;
  w.voxel = voxel;
  w.fraction = fraction;
  w.direction = direction;
  w.view.value = vec3(1.0);
  w.view.added = vec3(0.0);
  w.sun = vec3(1.0);
  w.t = 0.0;
  if (!kFogShafts) return w;
  w.span = fog_shaft_span(voxel, fraction, direction, t_end);
  w.pieces = w.span.x < w.span.y ? picture.media.z : 0u;
  w.last = w.pieces > 0u ? 0.0 : kMediumFar;
  w.at = 0u;
  return w;
}

/// On to t.
void follow_fog(inout FogWalk w, float t) {
  if (!kFogShafts) {
    see_fog(w.view, w.voxel, w.fraction, w.direction, w.t, t, w.sun);
    w.t = t;
    return;
  }
  for (uint part = 0u; part <= w.pieces && w.t < t; ++part) {
    if (w.t >= w.last) {
      const float place = mix(w.span.x, w.span.y, (float(w.at) + fog_shift) / float(w.pieces));
      w.sun = sun_in_fog(w.voxel, w.fraction, w.direction, place);
      ++w.at;
      w.last = w.at < w.pieces ? mix(w.span.x, w.span.y, float(w.at) / float(w.pieces)) : kMediumFar;
    }
    const float next = min(t, w.last);
    see_fog(w.view, w.voxel, w.fraction, w.direction, w.t, next, w.sun);
    w.t = next;
  }
}

FogView fog_along(ivec3 voxel, vec3 fraction, vec3 direction, float t_end) {
  FogWalk walk = begin_fog(voxel, fraction, direction, t_end);
  follow_fog(walk, t_end);
  return walk.view;
}

#endif
