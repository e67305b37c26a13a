/* All members by number, for shaders: LUMINAIRE_omni and so on are numbers in the order of the names. Made from the
 * folder's list; C++ calls through a table (sampler.cpp). A slide's or sky's image and the choice among a mesh's
 * triangles are the caller's. */
#ifndef LOAM_EVERY_LUMINAIRE_SHARED_H
#define LOAM_EVERY_LUMINAIRE_SHARED_H
#include "world/luminaires/emitter.shared.h"

#include "world_luminaires.members.h"

SHARED_NAMESPACE(world)

SHARED EmitterSample luminaire_sample(uint kind, SHARED_IN(Emitter) e, real3 receiver, real2 u) {
  DISPATCH_LUMINAIRE(kind, sample, (e, receiver, u))
  return emitter_sample(-e.axis, 0.0, 0.0, 0.0);
}

SHARED EmitterHit luminaire_meet(uint kind, SHARED_IN(Emitter) e, real3 origin, real3 direction) {
  DISPATCH_LUMINAIRE(kind, meet, (e, origin, direction))
  return no_emitter_hit();
}

SHARED EmitterPhoton luminaire_emit(uint kind, SHARED_IN(Emitter) e, real2 u, real2 v, real3 centre, real radius) {
  DISPATCH_LUMINAIRE(kind, emit, (e, u, v, centre, radius))
  return emitter_photon(real3(0.0), e.axis, 0.0);
}

SHARED_NAMESPACE_END
#endif
