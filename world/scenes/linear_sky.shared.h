/* The sky of an Environment, whose radiance goes linearly with the height of the direction:
 *
 *   L(y) = horizon + (zenith - horizon) y                       y >= 0
 *   L(y) = horizon + (ground - horizon) sky_ground_share(y)     y < 0
 * so that the horizon goes over into the ground within 10 degrees, as haze does, with no line between the two. Written
 * once for C++ and GLSL. y: component upwards of a unit vector. */
#ifndef LOAM_WORLD_SCENES_LINEAR_SKY_SHARED_H
#define LOAM_WORLD_SCENES_LINEAR_SKY_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(world)

SHARED_CONST float kHazeDepth = 0.17f; /* sine of those 10 degrees */

/* Of the ground in what is seen along a direction at or below the horizon. */
SHARED float sky_ground_share(float y) {
  float below = min(-y / kHazeDepth, 1.0f);
  return below * below * (3.0f - 2.0f * below);
}

SHARED vec3 linear_sky_radiance(vec3 zenith, vec3 horizon, vec3 ground, float y) {
  return y < 0.0f ? horizon + (ground - horizon) * sky_ground_share(y) : horizon + (zenith - horizon) * y;
}

/* What a ring of height -s sin t gives a surface whose unit normal has this y, where s^2 = 1 - y^2, over 2 s^2 dt: in t
 * it has no edge, which there is in the height where the surface's own plane touches the ring. */
SHARED float haze_ring(float y, float s, float t) {
  float sine = sin(t), cosine = cos(t);
  return (1.0f - sky_ground_share(-s * sine)) * cosine * (cosine - y * sine * atan(cosine, y * sine));
}

/* On that surface of a radiance of 1 - sky_ground_share() below the horizon: rings by Gauss and Legendre's rule, and
 * what is left where s < kHazeDepth, of which such a surface sees all or nothing.
 * error   2e-7 */
SHARED float haze_irradiance(float y) {
  const float kPi = 3.14159265f;
  float s = sqrt(max(1.0f - y * y, 0.0f)), half_range = s > kHazeDepth ? 0.5f * asin(kHazeDepth / s) : 0.25f * kPi;
  float a = 0.2386191861f * half_range, b = 0.6612093865f * half_range, c = 0.9324695142f * half_range;
  float sum = 0.4679139346f * (haze_ring(y, s, half_range - a) + haze_ring(y, s, half_range + a)) +
              0.3607615730f * (haze_ring(y, s, half_range - b) + haze_ring(y, s, half_range + b)) +
              0.1713244924f * (haze_ring(y, s, half_range - c) + haze_ring(y, s, half_range + c));
  sum *= 2.0f * s * s * half_range;
  if (y < 0.0f && s < kHazeDepth) {
    float u = s / kHazeDepth, u2 = u * u;
    sum -= 2.0f * kPi * y * kHazeDepth * kHazeDepth * (0.15f - u2 * (0.5f - u2 * (0.75f - 0.4f * u)));
  }
  return sum;
}

/* On a surface whose unit normal has this y. The sky's part above a tilted surface is a lune of angle pi - a, where a
 * is the normal's from the zenith. Over it, in coordinates around the lune's axis, the integral of w.y (n . w) is 2/3
 * ((pi - a) cos a + sin a). */
SHARED vec3 linear_sky_irradiance(vec3 zenith, vec3 horizon, vec3 ground, float y) {
  const float kPi = 3.14159265f;
  float cosine = clamp(y, -1.0f, 1.0f);
  vec3 sum =
      horizon * (0.5f * kPi * (1.0f + cosine)) + ground * (0.5f * kPi * (1.0f - cosine)) +
      (zenith - horizon) * (2.0f / 3.0f * ((kPi - acos(cosine)) * cosine + sqrt(max(1.0f - cosine * cosine, 0.0f))));
  return horizon == ground ? sum : sum + (horizon - ground) * haze_irradiance(cosine);
}

SHARED_NAMESPACE_END
#endif
