/* Directions drawn about a normal, and the cosines and sides that the members ask for.
 *
 * All of it is polynomials and roots, so that a GPU whose own sine may be off by 2^-11 (Vulkan's bound) draws what the
 * processor draws.
 *
 * error   sine and cosine of a turn: 2 u (u = 2^-24). The frame is orthonormal within 4 u, and exact along the axes.
 * source  the frame: Tom Duff et al. Building an Orthonormal Basis, Revisited. 2017
 */
#ifndef LOAM_RENDER_BSDF_SAMPLING_SHARED_H
#define LOAM_RENDER_BSDF_SAMPLING_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(render)

SHARED_CONST float kBsdfPi = 3.14159265358979f;
SHARED_CONST float kBsdfInversePi = 0.318309886183791f;

SHARED float largest_band(vec3 v) { return max(max(v.x, v.y), v.z); }
SHARED float mean_band(vec3 v) { return (v.x + v.y + v.z) * (1.0f / 3.0f); }

/* Whether both lie strictly on n's side. False where one is NaN. */
SHARED bool reflects(vec3 wi, vec3 wo, vec3 n) { return dot(n, wi) > 0.0f && dot(n, wo) > 0.0f; }

/* (cosine, sine) of `turns` in [0, 1] full turns. */
SHARED vec2 cosine_sine_of_turn(float turns) {
  /* Within an eighth of a turn of the nearest quarter; exact, as are all steps to x. */
  float quarter = floor(4.0f * turns + 0.5f);
  float x = turns - 0.25f * quarter, y = x * x;
  /* Taylor's series of cos(2 pi x) and sin(2 pi x): the first terms left out are below 2^-27 at x = 1/8. */
  float c = 1.0f + y * (-19.7392088f + y * (64.9393940f + y * (-85.4568172f + y * (60.2446414f + y * -26.4262568f))));
  float s = x * (6.28318531f + y * (-41.3417022f + y * (81.6052493f + y * (-76.7058598f + y * 42.0586939f))));
  int k = int(quarter) & 3;
  if (k == 1) return vec2(-s, c);
  if (k == 2) return vec2(-c, -s);
  if (k == 3) return vec2(s, -c);
  return vec2(c, s);
}

/* (x, y, z) in a frame whose z axis is n. */
SHARED vec3 about_normal(vec3 n, vec3 local) {
  float side = n.z >= 0.0f ? 1.0f : -1.0f;
  float a = -1.0f / (side + n.z), b = n.x * n.y * a;
  vec3 tangent = vec3(1.0f + side * n.x * n.x * a, side * b, -side * n.x);
  vec3 bitangent = vec3(b, side + n.y * n.y * a, -n.y);
  return local.x * tangent + local.y * bitangent + local.z * n;
}

/* With density cos / pi about n; u in [0, 1)^2. */
SHARED vec3 cosine_direction(vec3 n, vec2 u) {
  return about_normal(n, vec3(sqrt(u.x) * cosine_sine_of_turn(u.y), sqrt(1.0f - u.x)));
}

SHARED_NAMESPACE_END

#endif
