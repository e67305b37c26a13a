/* Balls and boxes along a pixel's ray: render/inhabitants.h. Positions are relative to the camera, directions have
 * length 1. */
#ifndef LOAM_RENDER_INHABITANTS_SHARED_H
#define LOAM_RENDER_INHABITANTS_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(render)

struct DrawnBall {
  vec4 middle;   /* w: radius */
  vec4 radiance; /* w: optical depth along its diameter */
};

struct DrawnBox {
  vec4 low, high;
  vec4 radiance[6]; /* by face: -x +x -y +y -z +z */
};

/* How much of what lies behind a ball is hidden, for a ray that ends at `end`. */
SHARED float ball_opacity(SHARED_IN(DrawnBall) ball, vec3 direction, float end) {
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
