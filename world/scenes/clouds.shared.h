/* A layer of clouds: how dense it is at a place, what is seen along a ray through it, and what of the sun it lets by.
 * Written once for C++ and GLSL.
 *
 *   lumps(x, z)    value noise in octaves, [0, 1]                                         [1]
 *   m(x, y, z)     lumps - threshold - kCloudRise h^2 + billows of kCloudBillow           h: height in the layer, 0 to
 * 1 density        clamp(m / kCloudEdge, 0, 1), of the extinction; the parabola in h makes flat bases and round tops
 *   light          the sun, scattered kCloudOrders times over: order i sees b^i of the depth towards the sun, and
 *                  scatters with b^i of the anisotropy                                    [2] eq. 1..3
 *   phase          two lobes of Henyey and Greenstein's                                   [3]
 * What is far fades into the sky along the same direction, as haze makes it.
 *
 * Places are relative to the corner of a voxel, which the layer's record names in whole cells of the coarsest lattice
 * and a rest: cells are counted in integers, so that clouds are as fine a million metres away as at the origin.
 *
 * Units: m, W/(m^2 sr) by band.
 * cost    a place: 4 hashes an octave of lumps, and where these leave it open 8 an octave of billows
 * error   a sum of orders in place of what is scattered many times: a thick layer sends 0.6 of the light of a sun
 *         overhead straight back (clouds_test.cpp), where real ones send 0.5 to 0.8. Steps: subject `clouds`
 * source  [1] Ken Perlin. An Image Synthesizer. 1985
 *         [2] Magnus Wrenninge, Chris Kulla, Viktor Lundqvist. Oz: The Great and Volumetric. 2013
 *         [3] Andrew Schneider. The Real-Time Volumetric Cloudscapes of Horizon: Zero Dawn. 2015 */
#ifndef LOAM_WORLD_SCENES_CLOUDS_SHARED_H
#define LOAM_WORLD_SCENES_CLOUDS_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(world)

/* What C++ works out from Clouds (cloud_layer.cpp). Only members of 16 bytes. */
struct CloudLayer {
  vec4 place;        /* the voxel's corner in its cell: x, z in [0, 1); y: of the base above it, m; w: cells a metre */
  ivec4 cell;        /* that cell: x, y for z; z: seed */
  vec4 shape;        /* thickness, m; extinction, 1/m; threshold; sine of the sun's height that shadows are cast at */
  vec4 sun;          /* towards it, unit */
  vec4 sun_light;    /* irradiance on what faces it */
  vec4 sky_light;    /* mean radiance from above */
  vec4 ground_light; /* and from below */
};

/* Of what noise is asked for: the other numbers are in its units, fitted by eye, 2026-11-28. */
SHARED_CONST int kCloudOctaves = 3, kCloudBillowOctaves = 2, kCloudOrders = 4;
SHARED_CONST float kCloudRise = 0.30f, kCloudEdge = 0.05f, kCloudBillow = 0.12f;
SHARED_CONST float kCloudSlope = 0.4f;   /* of lumps, a cell: how much wider edges are where details are left out */
SHARED_CONST float kBillowCells = 8.0f;  /* of the coarsest billows to one of the coarsest lumps */
SHARED_CONST float kBillowMean = 0.304f; /* measured, 2026-11-28 */
SHARED_CONST float kCloudHaze = 11e3f;   /* m: so far a cloud is 1/e of what it is near */
SHARED_CONST float kCloudFar = 70e3f;    /* m: none are seen beyond, where 1/600 is left of them */

/* source: Chris Wellons. Hash Function Prospecting. 2018 (lowbias32) */
SHARED uint cloud_hash(uint h) {
  h = (h ^ (h >> 16)) * 0x7feb352du;
  h = (h ^ (h >> 15)) * 0x846ca68bu;
  return h >> 16;
}
SHARED float cloud_corner(uint x, uint y, uint z, uint seed) {
  return float(cloud_hash(x * 0x9e3779b1u + y * 0x85ebca6bu + z * 0xc2b2ae35u + seed)) * (1.0f / 65535.0f);
}
SHARED float cloud_smooth(float f) { return f * f * (3.0f - 2.0f * f); }

/* Value noise at a place in cells from (x, z), whose own cells are `scale` times as many. */
SHARED float cloud_noise(ivec2 cell, vec2 at, int scale, uint seed) {
  vec2 fine = at * float(scale), whole = floor(fine);
  float u = cloud_smooth(fine.x - whole.x), v = cloud_smooth(fine.y - whole.y);
  uint x = uint(cell.x) * uint(scale) + uint(int(whole.x)), z = uint(cell.y) * uint(scale) + uint(int(whole.y));
  return mix(mix(cloud_corner(x, 0u, z, seed), cloud_corner(x + 1u, 0u, z, seed), u),
             mix(cloud_corner(x, 0u, z + 1u, seed), cloud_corner(x + 1u, 0u, z + 1u, seed), u), v);
}
/* The same in space; y counts from the layer's base. */
SHARED float cloud_noise(ivec2 cell, vec3 at, int scale, uint seed) {
  vec3 fine = at * float(scale), whole = floor(fine);
  float u = cloud_smooth(fine.x - whole.x), v = cloud_smooth(fine.z - whole.z), w = cloud_smooth(fine.y - whole.y);
  uint x = uint(cell.x) * uint(scale) + uint(int(whole.x)), z = uint(cell.y) * uint(scale) + uint(int(whole.z)),
       y = uint(int(whole.y));
  float low = mix(mix(cloud_corner(x, y, z, seed), cloud_corner(x + 1u, y, z, seed), u),
                  mix(cloud_corner(x, y, z + 1u, seed), cloud_corner(x + 1u, y, z + 1u, seed), u), v);
  ++y;
  float high = mix(mix(cloud_corner(x, y, z, seed), cloud_corner(x + 1u, y, z, seed), u),
                   mix(cloud_corner(x, y, z + 1u, seed), cloud_corner(x + 1u, y, z + 1u, seed), u), v);
  return mix(low, high, w);
}

/* At a place in cells of the coarsest lattice; octaves whose cells are narrower than `width` of these are their mean.
 */
SHARED float cloud_lumps(SHARED_IN(CloudLayer) c, vec2 at, float width) {
  float sum = 0.0f, weight = 4.0f / 7.0f;
  int scale = 1;
  for (int i = 0; i < kCloudOctaves; ++i) {
    float there = clamp(2.0f - width * float(scale), 0.0f, 1.0f);
    float n = 0.5f;
    if (there > 0.0f) n = mix(0.5f, cloud_noise(ivec2(c.cell.x, c.cell.y), at, scale, uint(c.cell.z + i)), there);
    sum += weight * n;
    weight *= 0.5f;
    scale *= 2;
  }
  return sum;
}

/* Less their mean: round knobs with creases between them. */
SHARED float cloud_billows(SHARED_IN(CloudLayer) c, vec3 at, float width) {
  float sum = 0.0f, weight = 2.0f / 3.0f;
  int scale = int(kBillowCells);
  for (int i = 0; i < kCloudBillowOctaves; ++i) {
    float there = clamp(2.0f - width * float(scale), 0.0f, 1.0f);
    if (there > 0.0f)
      sum +=
          there * weight *
          (abs(2.0f * cloud_noise(ivec2(c.cell.x, c.cell.y), at, scale, uint(c.cell.z + 8 + i)) - 1.0f) - kBillowMean);
    weight *= 0.5f;
    scale *= 2;
  }
  return sum;
}

/* In [0, 1]. `place`: m from the voxel's corner; details narrower than `width` m are left out. */
SHARED float cloud_density(SHARED_IN(CloudLayer) c, vec3 place, float width) {
  float above = place.y - c.place.y, h = above / c.shape.x;
  if (!(h > 0.0f && h < 1.0f)) return 0.0f;
  vec2 at = vec2(c.place.x, c.place.z) + vec2(place.x, place.z) * c.place.w;
  float m = cloud_lumps(c, at, width * c.place.w) - c.shape.z - kCloudRise * h * h;
  if (m <= -kCloudBillow - kCloudSlope * width * c.place.w) return 0.0f;
  float billow = kCloudBillow * (0.3f + 0.7f * h);
  float cells = width * c.place.w, edge = kCloudEdge + kCloudSlope * cells;
  if (m < edge + billow) m -= 2.0f * billow * cloud_billows(c, vec3(at.x, above * c.place.w, at.y), cells);
  return clamp(0.5f + (m - 0.5f * kCloudEdge) / edge, 0.0f, 1.0f) * min(h * 12.0f, 1.0f);
}

/* Integral of max(m - kCloudRise h^2, 0) over h in [0, 1]. */
SHARED float cloud_rise_integral(float m) {
  float h = sqrt(clamp(m / kCloudRise, 0.0f, 1.0f));
  return max(m, 0.0f) * h - kCloudRise / 3.0f * h * h * h;
}
/* Mean of the density over the layer's height without billows, where lumps are `m` above the threshold. */
SHARED float cloud_column(float m) {
  return (cloud_rise_integral(m) - cloud_rise_integral(m - kCloudEdge)) / kCloudEdge;
}

/* Of the sun's light, along the sun's ray through the place: straight on, with what is scattered into the peak ahead,
 * of depth 1 - g^2. source: J. Joseph, W. Wiscombe, J. Weinman. The Delta-Eddington Approximation. 1976 */
SHARED_CONST float kCloudShadowDepth = 0.28f; /* g = 0.85 */
SHARED float cloud_sun_through(SHARED_IN(CloudLayer) c, vec3 place) {
  float to_middle = (c.place.y + 0.5f * c.shape.x - place.y) / c.shape.w;
  float beyond = clamp((c.place.y + c.shape.x - place.y) / c.shape.x, 0.0f, 1.0f);
  vec2 level = vec2(place.x, place.z) + vec2(c.sun.x, c.sun.z) * max(to_middle, 0.0f);
  vec2 at = vec2(c.place.x, c.place.z) + level * c.place.w;
  float column = cloud_column(cloud_lumps(c, at, 0.0f) - c.shape.z);
  return exp(-kCloudShadowDepth * c.shape.x * c.shape.y * column * beyond / c.shape.w);
}

SHARED float cloud_lobe(float g, float cosine) {
  float g2 = g * g, d = 1.0f + g2 - 2.0f * g * cosine;
  return (1.0f - g2) / (12.5663706f * d * sqrt(d));
}
/* Of each order. */
SHARED vec4 cloud_phases(float cosine) {
  vec4 p = vec4(0.0f);
  float g = 1.0f;
  for (int i = 0; i < kCloudOrders; ++i) {
    p[i] = mix(cloud_lobe(-0.25f * g, cosine), cloud_lobe(0.8f * g, cosine), 0.6f);
    g *= 0.5f;
  }
  return p;
}

/* Light that a place sends along the ray, over the extinction there: `depth` lies between it and the sun. */
SHARED vec3 cloud_source(SHARED_IN(CloudLayer) c, vec4 phases, float depth, float h) {
  float d3 = exp(-0.125f * depth), d2 = d3 * d3, d1 = d2 * d2, d0 = d1 * d1;
  return vec3(c.sun_light) * dot(phases, vec4(d0, d1, d2, d3)) +
         mix(vec3(c.ground_light), vec3(c.sky_light), 0.2f + 0.8f * h);
}

SHARED float cloud_depth_to_sun(SHARED_IN(CloudLayer) c, vec3 place, int steps) {
  float h = place.y - c.place.y;
  float far = (c.sun.y >= 0.0f ? c.shape.x - h : h) / max(abs(c.sun.y), 1e-3f);
  far = min(far, 3.0f * c.shape.x);
  float depth = 0.0f, before = 0.0f;
  for (int i = 0; i < steps; ++i) {
    /* Steps grow: what is near shades most sharply. */
    float end = float(i + 1) / float(steps);
    end *= end * far;
    depth += (end - before) * cloud_density(c, place + vec3(c.sun) * (0.5f * (before + end)), end - before);
    before = end;
  }
  return depth * c.shape.y;
}

/* A number in [0, 1) that is the same for all directions within half a milliradian. */
SHARED float cloud_dither(vec3 direction) {
  vec3 cell = floor(direction * 2048.0f + 0.37f);
  return cloud_corner(uint(int(cell.x)), uint(int(cell.y)), uint(int(cell.z)), 77u);
}

/* Of clouds along a ray, up to where it ends. */
struct CloudView {
  vec3 added SHARED_INIT(vec3(0.0f)); /* to what lies behind them, */
  float through SHARED_INIT(1.0f);    /* of which they let this much through */
  float distance SHARED_INIT(0.0f);   /* m, the mean of what hides */
};

/* Up to t_end along the ray. `behind`: the sky's radiance there. `from`: m from the voxel's corner. Where a ray ends
 * moves none of the places before: what lies in a cloud cuts into the one that is seen beside it. */
SHARED CloudView clouds_along(SHARED_IN(CloudLayer) c, vec3 from, vec3 direction, vec3 behind, int steps,
                              int light_steps, float t_end) {
  CloudView view;
  view.added = vec3(0.0f);
  view.through = 1.0f;
  view.distance = 0.0f;
  float base = c.place.y - from.y, top = base + c.shape.x;
  float slope = abs(direction.y) < 1e-6f ? (direction.y < 0.0f ? -1e-6f : 1e-6f) : direction.y;
  float a = base / slope, b = top / slope;
  float start = max(min(a, b), 0.0f), out_of_layer = min(max(a, b), kCloudFar), end = min(out_of_layer, t_end);
  if (!(end > start)) return view;
  vec4 phases = cloud_phases(dot(direction, vec3(c.sun)));
  if (steps == 1) {
    float t = 0.5f * (start + out_of_layer);
    vec3 place = from + t * direction;
    vec2 at = vec2(c.place.x, c.place.z) + vec2(place.x, place.z) * c.place.w;
    float column = cloud_column(cloud_lumps(c, at, 0.0f) - c.shape.z);
    float depth = c.shape.y * column * (end - start), fade = exp(-t / kCloudHaze);
    view.through = exp(-depth);
    view.distance = 0.5f * (start + end);
    vec3 source = cloud_source(c, phases, light_steps > 0 ? 0.5f * c.shape.y * c.shape.x * column : 0.0f, 0.3f);
    view.added = (1.0f - view.through) * mix(behind, source, fade);
    return view;
  }
  float reach = c.shape.x, ratio = log((out_of_layer + reach) / (start + reach));
  float dither = cloud_dither(direction), before = start;
  for (int i = 0; i < steps && before < end; ++i) {
    float next = (start + reach) * exp(ratio * (float(i + 1) / float(steps))) - reach;
    float t = mix(before, next, dither), width = next - before;
    vec3 place = from + t * direction;
    float density = cloud_density(c, place, width);
    if (density > 0.0f) {
      vec3 source =
          cloud_source(c, phases, cloud_depth_to_sun(c, place, light_steps), (place.y - c.place.y) / c.shape.x);
      float passed = exp(-density * c.shape.y * (min(next, end) - before));
      float fade = exp(-t / kCloudHaze), hidden = view.through * (1.0f - passed);
      view.added += hidden * mix(behind, source, fade);
      view.distance += hidden * min(t, end);
      view.through *= passed;
      if (view.through < 1e-3f) break;
    }
    before = next;
  }
  view.distance /= max(1.0f - view.through, 1e-6f);
  return view;
}

/* What is seen through clouds with fog before and behind them. Of the fog up to their distance: what it lets through
 * and what it adds. `seen`: without them, with the fog of all the way. */
SHARED vec3 clouds_laid_over(CloudView clouds, vec3 fog_through, vec3 fog_added, vec3 seen) {
  return fog_added + fog_through * clouds.added + clouds.through * max(seen - fog_added, vec3(0.0f));
}

SHARED_NAMESPACE_END
#endif
