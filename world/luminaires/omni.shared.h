/* Omni: a point that sends the same everywhere.
 *
 *   M = Phi / (4 pi max(r, radius)^2)
 * A point's light grows without bound near by, where no lamp is a point: within `radius` it stays what it is there.
 * What that takes from a room is at most the light within the radius; a sphere of that radius is the exact answer.
 * source  chapter 14.11.6 */
#ifndef LOAM_OMNI_SHARED_H
#define LOAM_OMNI_SHARED_H
#include "world/luminaires/emitter.shared.h"

SHARED_NAMESPACE(world)

SHARED uint omni_keys() { return kKeyPlace | kKeyPower | kKeyClamp; }
SHARED real omni_area(SHARED_IN(Emitter)) { return 0.0; }
SHARED real omni_power(SHARED_IN(Emitter)) { return 1.0; }

SHARED EmitterSample omni_sample(SHARED_IN(Emitter) e, real3 receiver, real2) {
  real r = length(receiver), clamped = max(r, e.radius);
  return emitter_sample(direction_or(-receiver, -e.axis), r, 1.0 / (4.0 * kEmitterPi * clamped * clamped), 0.0);
}

SHARED EmitterHit omni_meet(SHARED_IN(Emitter), real3, real3) { return no_emitter_hit(); }

SHARED EmitterPhoton omni_emit(SHARED_IN(Emitter), real2, real2 v, real3, real) {
  return emitter_photon(real3(0.0), sphere_direction(v), 1.0);
}

SHARED_NAMESPACE_END
#endif
