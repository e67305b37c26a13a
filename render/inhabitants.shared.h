/* Balls and boxes along a pixel's ray: render/inhabitants.h. Positions are relative to the camera, directions have
 * length 1. */
#ifndef LOAM_RENDER_INHABITANTS_SHARED_H
#define LOAM_RENDER_INHABITANTS_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(render)

struct DrawnBall {
  vec4 middle;                   /* w: radius */
  vec4 radiance;                 /* w: optical depth along its diameter */
  vec4 way SHARED_INIT(vec4(0)); /* w: 0 for none. All that it moves while the shutter is open; `middle` is halfway */
};

struct DrawnBox {
  vec4 low, high;
  vec4 radiance[6]; /* by face: -x +x -y +y -z +z */
};

/* The integral of sqrt(c - a s^2) from s0 to s1, where the root is real; a > 0. */
SHARED float half_chords(float a, float c, float s0, float s1) {
  float edge = sqrt(c / a);
  float x0 = clamp(s0 / edge, -1.0f, 1.0f), x1 = clamp(s1 / edge, -1.0f, 1.0f);
  float at0 = x0 * sqrt(max(1.0f - x0 * x0, 0.0f)) + asin(x0), at1 = x1 * sqrt(max(1.0f - x1 * x1, 0.0f)) + asin(x1);
  return 0.5f * sqrt(c) * edge * (at1 - at0);
}

/* How much of what lies behind a ball is hidden, for a ray that ends at `end`, in the mean while it moves: the mean of
 * the optical depth is exact where nothing cuts its way short; of what does, the ball's nearest place to the ray says
 * how much is left. */
SHARED float moving_ball_opacity(SHARED_IN(DrawnBall) ball, vec3 direction, float end) {
  vec3 middle = vec3(ball.middle.x, ball.middle.y, ball.middle.z), way = vec3(ball.way.x, ball.way.y, ball.way.z);
  float radius = ball.middle.w;
  vec3 beside = middle - dot(middle, direction) * direction, across = way - dot(way, direction) * direction;
  /* Its distance from the ray at the time s in [-1/2, 1/2], squared: a (s - nearest)^2 + closest. */
  float a = max(dot(across, across), 1e-6f * radius * radius);
  float nearest = clamp(-dot(beside, across) / a, -1e6f, 1e6f);
  vec3 off = beside + nearest * across;
  float c = radius * radius - dot(off, off);
  if (!(c > 0.0f)) return 0.0f;
  float chord = 2.0f * half_chords(a, c, -0.5f - nearest, 0.5f - nearest);
  float along = dot(middle + clamp(nearest, -0.5f, 0.5f) * way, direction), reach = sqrt(c);
  float left = min(along + reach, end) - max(along - reach, 0.0f);
  if (!(left > 0.0f)) return 0.0f;
  return 1.0f - exp(-ball.radiance.w * chord * (left / (2.0f * reach)) / (2.0f * radius));
}

/* The same for one that stands still, and for any. */
SHARED float ball_opacity(SHARED_IN(DrawnBall) ball, vec3 direction, float end) {
  if (ball.way.w != 0.0f) return moving_ball_opacity(ball, direction, end);
  vec3 middle = vec3(ball.middle.x, ball.middle.y, ball.middle.z);
  float along = dot(middle, direction);
  vec3 beside = middle - along * direction;
  float half2 = ball.middle.w * ball.middle.w - dot(beside, beside);
  if (!(half2 > 0.0f)) return 0.0f;
  float reach = sqrt(half2);
  float passed = min(along + reach, end) - max(along - reach, 0.0f);
  if (!(passed > 0.0f)) return 0.0f;
  return 1.0f - exp(-ball.radiance.w * passed / (2.0f * ball.middle.w));
}

/* Where a ray enters a box, and through which face; a distance below 0 where it doesn't. */
struct BoxHit {
  float distance;
  int face;
};
SHARED BoxHit meet_box(vec3 low, vec3 high, vec3 direction) {
  vec3 inverse = 1.0f / direction;
  vec3 a = low * inverse, b = high * inverse;
  vec3 enter = min(a, b), leave = max(a, b);
  float first = max(enter.x, max(enter.y, enter.z)), last = min(leave.x, min(leave.y, leave.z));
  BoxHit hit;
  hit.distance = first <= last && first > 0.0f ? first : -1.0f;
  int axis = enter.x >= enter.y ? (enter.x >= enter.z ? 0 : 2) : (enter.y >= enter.z ? 1 : 2);
  hit.face = 2 * axis + (direction[axis] < 0.0f ? 1 : 0);
  return hit;
}

SHARED_NAMESPACE_END
#endif
