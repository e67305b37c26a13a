/* Spot: an omni inside a black shade with a round opening. Its power is the omni's, so that turning the half angle
 * changes what is lit, not how brightly; what gets out is
 *   Phi' = Phi (1 - cos theta) / 2 = Phi sin^2(theta / 2)
 * and, with a soft edge, the mean of that at both half angles. 0 lets nothing out, pi is the omni.
 * error   relative 1e-15 at any half angle; 1 - cos would be wrong by 32 % at 3e-4 (float)
 * source  chapter 14.11.8; hard cases L10 to L12, N14 */
#ifndef LOAM_SPOT_SHARED_H
#define LOAM_SPOT_SHARED_H
#include "world/luminaires/omni.shared.h"

SHARED_NAMESPACE(world)

SHARED uint spot_keys() { return kKeyPlace | kKeyAxis | kKeyPower | kKeyClamp | kKeyCone | kKeySoftEdge; }
SHARED real spot_area(SHARED_IN(Emitter)) { return 0.0; }
SHARED real spot_power(SHARED_IN(Emitter) e) { return 0.5 * (e.cone + e.inner_cone); }

SHARED EmitterSample spot_sample(SHARED_IN(Emitter) e, real3 receiver, real2 u) {
  EmitterSample s = omni_sample(e, receiver, u);
  s.biradiance *= cone_profile(e, -s.direction);
  return s;
}

SHARED EmitterHit spot_meet(SHARED_IN(Emitter), real3, real3) { return no_emitter_hit(); }

SHARED EmitterPhoton spot_emit(SHARED_IN(Emitter) e, real2, real2 v, real3, real) {
  real3 direction = cone_direction(e.axis, e.cone, v);
  return emitter_photon(real3(0.0), direction, e.cone * cone_profile(e, direction));
}

SHARED_NAMESPACE_END
#endif
