/* Directional: light from so far that it comes along one direction, equally strong everywhere; the sun without its
 * disk. Its colour is the irradiance of a plane that faces it; no position is taken from another, so that the direction
 * is exact at any distance from the world's origin.
 * source  chapter 14.11.7 */
#ifndef LOAM_DIRECTIONAL_SHARED_H
#define LOAM_DIRECTIONAL_SHARED_H
#include "world/luminaires/emitter.shared.h"

SHARED_NAMESPACE(world)

SHARED uint directional_keys() { return kKeyAxis | kKeyIrradiance; }
SHARED real directional_area(SHARED_IN(Emitter)) { return kAtInfinity; }
SHARED real directional_power(SHARED_IN(Emitter)) { return kAtInfinity; }

SHARED EmitterSample directional_sample(SHARED_IN(Emitter) e, real3, real2) {
  return emitter_sample(-e.axis, kAtInfinity, 1.0, 0.0);
}

SHARED EmitterHit directional_meet(SHARED_IN(Emitter), real3, real3) { return no_emitter_hit(); }

SHARED EmitterPhoton directional_emit(SHARED_IN(Emitter) e, real2 u, real2, real3 centre, real radius) {
  return emitter_photon(distant_origin(e.axis, u, centre, radius), e.axis, kEmitterPi * radius * radius);
}

SHARED_NAMESPACE_END
#endif
