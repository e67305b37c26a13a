/* Hemisphere: a sky at no distance, of the same radiance everywhere above its horizon, or as an image says; with
 * whole_sphere below it too. Its axis is the pole, the middle of the sky; a plane that faces it gets E = pi L.
 *
 * An image is equirectangular and always of the whole sphere: the top row is the pole, the bottom row the opposite one,
 *   column = 1/2 + atan2(d . right, d . up) / (2 pi),   row = acos(d . axis) / pi,   in [0, 1), rows from the top
 * so `up` lies in the middle of the picture, right = cross(up, axis) to its right, as seen from inside. With the
 * default axis +y and up +z the left edge is -z, a quarter of the width +x, the middle +z: Mitsuba's `envmap` without a
 * transform, but that the centres of its outer rows are the poles themselves: at most half a row away.
 * Without whole_sphere the lower half of the picture is not used.
 *
 * source  chapter 14.11.5, whose dome of finite size this is as its radius grows */
#ifndef LOAM_HEMISPHERE_SHARED_H
#define LOAM_HEMISPHERE_SHARED_H
#include "world/luminaires/emitter.shared.h"

SHARED_NAMESPACE(world)

SHARED uint hemisphere_keys() { return kKeyAxis | kKeyUp | kKeyRadiance | kKeySky; }
SHARED real hemisphere_area(SHARED_IN(Emitter)) { return kAtInfinity; }
SHARED real hemisphere_power(SHARED_IN(Emitter)) { return kAtInfinity; }

/* Solid angle over 4 pi. */
SHARED real hemisphere_part(SHARED_IN(Emitter) e) { return e.whole_sphere != 0u ? 1.0 : 0.5; }

SHARED EmitterSample hemisphere_sample(SHARED_IN(Emitter) e, real3, real2 u) {
  real part = hemisphere_part(e);
  real solid_angle = 4.0 * kEmitterPi * part;
  return emitter_sample(cone_direction(e.axis, part, u), kAtInfinity, solid_angle, 1.0 / solid_angle);
}

SHARED EmitterHit hemisphere_meet(SHARED_IN(Emitter) e, real3, real3 direction) {
  if (e.whole_sphere == 0u && !(dot(direction, e.axis) >= 0.0)) return no_emitter_hit();
  return emitter_hit(kAtInfinity, 1.0, 1.0 / (4.0 * kEmitterPi * hemisphere_part(e)));
}

/* What passes the scene's sphere: radiance times solid angle times the area of its disk. */
SHARED EmitterPhoton hemisphere_emit(SHARED_IN(Emitter) e, real2 u, real2 v, real3 centre, real radius) {
  real part = hemisphere_part(e);
  real3 direction = -cone_direction(e.axis, part, v);
  return emitter_photon(distant_origin(direction, u, centre, radius), direction,
                        4.0 * kEmitterPi * part * kEmitterPi * radius * radius);
}

/* Column and row in [0, 1] of an image. */
SHARED real2 hemisphere_sky_from_direction(SHARED_IN(Emitter) e, real3 direction) {
  real x = dot(direction, e.right), y = dot(direction, e.up);
  real column = x == 0.0 && y == 0.0 ? real(0.5) : 0.5 + atan(x, y) / (2.0 * kEmitterPi);
  return real2(column, acos(clamp(dot(direction, e.axis), -1.0, 1.0)) / kEmitterPi);
}

/* cosine: of the angle to the pole. */
SHARED real3 hemisphere_direction_from_sky(SHARED_IN(Emitter) e, real column, real cosine) {
  real sine = root_or_zero((1.0 - cosine) * (1.0 + cosine)), phi = 2.0 * kEmitterPi * (column - 0.5);
  return normalize(sine * (sin(phi) * e.right + cos(phi) * e.up) + cosine * e.axis);
}

SHARED_NAMESPACE_END
#endif
