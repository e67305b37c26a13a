/* Lens flare: reflections between the lenses of an objective show as images of its iris, polygons along the line
 * through a bright spot and the middle of the picture, and as streaks across the edges of the iris at the spot itself.
 * Which spots there are, how bright they are and how much of each is hidden, render/effects/flare_spots.h finds out.
 *
 * Seven images of the iris: where each lies on the line (1: on the spot, -1: as far on the other side), how large it
 * is, how bright and of which colour were chosen by eye, 2026-11-26, on valley's "sunrise", to look like figure 14.12.
 *
 * knobs   lens_flare: radiance of an image over that of a matte white surface which the spot lights; lens_flare_blades
 * source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.10.5 and
 *         figure 14.12 */
#ifndef LOAM_RENDER_EFFECTS_LENS_FLARE_SHARED_H
#define LOAM_RENDER_EFFECTS_LENS_FLARE_SHARED_H
#include "render/effects/effect.shared.h"

SHARED_NAMESPACE(render)

/* One image of the iris around the origin, of size 1: brightest at its rim, soft over a twelfth of its size. */
SHARED float iris_at(EFFECT_FRAME vec2 at) {
  float out_of_middle = 0.0f;
  for (uint k = 0u; k < f.modes.z; ++k) {
    vec4 two = f.blades[k >> 1u];
    out_of_middle = max(out_of_middle, dot(at, (k & 1u) == 0u ? vec2(two.x, two.y) : vec2(two.z, two.w)));
  }
  float inside = min(max((1.0f - out_of_middle) * 12.0f, 0.0f), 1.0f);
  return inside * (0.55f + 0.45f * out_of_middle * out_of_middle);
}

/* x: place on the line; y: size in half heights; z: brightness */
SHARED vec3 ghost_of(int i) {
  if (i == 0) return vec3(-1.30f, 0.28f, 0.10f);
  if (i == 1) return vec3(-0.85f, 0.11f, 0.22f);
  if (i == 2) return vec3(-0.52f, 0.05f, 0.40f);
  if (i == 3) return vec3(-0.28f, 0.16f, 0.12f);
  if (i == 4) return vec3(0.32f, 0.07f, 0.25f);
  if (i == 5) return vec3(0.56f, 0.03f, 0.50f);
  return vec3(1.45f, 0.20f, 0.08f);
}
SHARED vec3 tint_of(int i) {
  if (i == 0) return vec3(0.5f, 0.9f, 0.6f);
  if (i == 1) return vec3(0.6f, 0.7f, 1.0f);
  if (i == 2) return vec3(1.0f, 0.8f, 0.5f);
  if (i == 3) return vec3(0.5f, 1.0f, 0.7f);
  if (i == 4) return vec3(1.0f, 0.6f, 0.4f);
  if (i == 5) return vec3(0.7f, 0.8f, 1.0f);
  return vec3(0.9f, 0.6f, 1.0f);
}
SHARED_CONST int kGhosts = 7;

/* Across each edge of the iris light is bent into a streak: thin, and fading with the distance. */
SHARED float streaks_at(EFFECT_FRAME vec2 at) {
  float distance2 = dot(at, at), sum = 0.0f;
  for (uint k = 0u; k < f.modes.z; ++k) {
    vec4 two = f.blades[k >> 1u];
    vec2 along = (k & 1u) == 0u ? vec2(two.x, two.y) : vec2(two.z, two.w);
    float ahead = dot(at, along), beside = at.x * along.y - at.y * along.x;
    if (ahead > 0.0f) sum += 1.0f / (1.0f + beside * beside * 40000.0f);
  }
  float glow = 1.0f / (1.0f + distance2 * 400.0f);
  return glow * glow + 0.25f * sum / (1.0f + distance2 * 60.0f);
}

SHARED vec3 lens_flare_at(EFFECT_SOURCE EFFECT_UNUSED ivec2 pixel, vec3 colour) {
  vec2 at = from_middle(PASS_FRAME pixel);
  for (uint s = 0u; s < f.modes.y; ++s) {
    vec2 spot = vec2(f.spots[2u * s].x, f.spots[2u * s].y);
    vec3 radiance = vec3(f.spots[2u * s + 1u].x, f.spots[2u * s + 1u].y, f.spots[2u * s + 1u].z);
    vec3 seen = vec3(streaks_at(PASS_FRAME at - spot));
    for (int i = 0; i < kGhosts; ++i) {
      vec3 ghost = ghost_of(i);
      seen += ghost.z * iris_at(PASS_FRAME(at - ghost.x * spot) / ghost.y) * tint_of(i);
    }
    colour += radiance * seen;
  }
  return colour;
}

SHARED_NAMESPACE_END
#endif
