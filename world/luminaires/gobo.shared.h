/* Gobo: a spot with a slide before its opening. The slide's picture fills the square around the cone's circle,
 *   (column, row) = (1/2, 1/2) + (x, -y) / (2 z tan(half angle)),   x, y, z along cross(axis, up), up and axis
 * whatever the picture's own sides, and is black beyond; behind the light there is nothing. A viewer who stands behind
 * the light and looks along its axis sees the picture as it lies in the file.
 * source  chapter 14.11.8, projective spot light; hard case L13 */
#ifndef LOAM_GOBO_SHARED_H
#define LOAM_GOBO_SHARED_H
#include "world/luminaires/spot.shared.h"

SHARED_NAMESPACE(world)

SHARED uint gobo_keys() {
  return kKeyPlace | kKeyAxis | kKeyUp | kKeyPower | kKeyClamp | kKeyCone | kKeySoftEdge | kKeySlide;
}
SHARED real gobo_area(SHARED_IN(Emitter)) { return 0.0; }
SHARED real gobo_power(SHARED_IN(Emitter) e) { return spot_power(e); } /* through a clear slide */

/* x, y: column and row in [0, 1] of what goes along `direction`; z: 1, or 0 where that passes beside the slide. */
SHARED real3 gobo_slide_from_direction(SHARED_IN(Emitter) e, real3 direction) {
  real depth = dot(direction, e.axis);
  if (!(depth > 0.0)) return real3(0.0);
  real scale = 0.5 / (depth * e.tan_half_angle);
  real column = 0.5 - scale * dot(direction, e.right), row = 0.5 - scale * dot(direction, e.up);
  if (!(column >= 0.0 && column <= 1.0 && row >= 0.0 && row <= 1.0)) return real3(0.0);
  return real3(column, row, 1.0);
}

/* x, y, z: the direction through a place of the slide; not of unit length: z is 1 along the axis. */
SHARED real3 gobo_direction_from_slide(SHARED_IN(Emitter) e, real2 place) {
  real2 across_slide = (2.0 * place - 1.0) * e.tan_half_angle;
  return e.axis - across_slide.x * e.right - across_slide.y * e.up;
}

/* Times the slide's value there. */
SHARED EmitterSample gobo_sample(SHARED_IN(Emitter) e, real3 receiver, real2 u) { return spot_sample(e, receiver, u); }
SHARED EmitterHit gobo_meet(SHARED_IN(Emitter), real3, real3) { return no_emitter_hit(); }
SHARED EmitterPhoton gobo_emit(SHARED_IN(Emitter) e, real2 u, real2 v, real3 centre, real radius) {
  return spot_emit(e, u, v, centre, radius);
}

SHARED_NAMESPACE_END
#endif
