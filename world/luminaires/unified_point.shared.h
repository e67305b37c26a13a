/* Unified point: omni, spot and directional light as the fixed-function pipelines had them, with the centre in
 * homogeneous coordinates (w = 0: at_infinity) and any falloff of second degree.
 *
 *   M = Phi / (4 pi (a.x + a.y r + a.z r^2)),   r = 0 at infinity
 * (0, 0, 1) is physics; at infinity Phi is what an omni 1 m away would need where a.x = 1. Nearer than `radius` it
 * grows no further. Photons have only one falloff: they go as those of a = (0, 0, 1).
 *
 * source  chapter 14.11.9. There the cone's test has the light vector's sign reversed; here the cone lies around the
 *         axis, as in the spot light. */
#ifndef LOAM_UNIFIED_POINT_SHARED_H
#define LOAM_UNIFIED_POINT_SHARED_H
#include "world/luminaires/spot.shared.h"

SHARED_NAMESPACE(world)

SHARED uint unified_point_keys() { return kKeyPlace | kKeyAxis | kKeyPower | kKeyClamp | kKeyCone | kKeyAttenuation; }
SHARED real unified_point_area(SHARED_IN(Emitter) e) { return e.at_infinity != 0u ? kAtInfinity : real(0.0); }
SHARED real unified_point_power(SHARED_IN(Emitter) e) { return e.at_infinity != 0u ? kAtInfinity : e.cone; }

SHARED EmitterSample unified_point_sample(SHARED_IN(Emitter) e, real3 receiver, real2) {
  if (e.at_infinity != 0u) return emitter_sample(-e.axis, kAtInfinity, 1.0 / (4.0 * kEmitterPi * e.attenuation.x), 0.0);
  real r = length(receiver), clamped = max(r, e.radius);
  real3 direction = direction_or(-receiver, -e.axis);
  real falloff = dot(e.attenuation, real3(1.0, clamped, clamped * clamped));
  return emitter_sample(direction, r, cone_profile(e, -direction) / (4.0 * kEmitterPi * falloff), 0.0);
}

SHARED EmitterHit unified_point_meet(SHARED_IN(Emitter), real3, real3) { return no_emitter_hit(); }

SHARED EmitterPhoton unified_point_emit(SHARED_IN(Emitter) e, real2 u, real2 v, real3 centre, real radius) {
  if (e.at_infinity == 0u) return spot_emit(e, u, v, centre, radius);
  real irradiance = 1.0 / (4.0 * kEmitterPi * e.attenuation.x);
  return emitter_photon(distant_origin(e.axis, u, centre, radius), e.axis, irradiance * kEmitterPi * radius * radius);
}

SHARED_NAMESPACE_END
#endif
