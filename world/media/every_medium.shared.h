/* All members with closed forms by number, for shaders: MEDIUM_box_fog and so on are numbers in the order of the names.
 * Made from the folder's list; C++ calls through the table of medium.cpp. */
#ifndef LOAM_WORLD_MEDIA_EVERY_MEDIUM_SHARED_H
#define LOAM_WORLD_MEDIA_EVERY_MEDIUM_SHARED_H
#include "world/media/medium.shared.h"

#include "world_media.members.h"

SHARED_NAMESPACE(world)

SHARED real2 medium_span(uint kind, SHARED_IN(MediumShape) m, real3 origin, real3 direction) {
  DISPATCH_MEDIUM(kind, span, (m, origin, direction))
  return medium_nowhere();
}

SHARED real medium_density(uint kind, SHARED_IN(MediumShape) m, real3 point) {
  DISPATCH_MEDIUM(kind, density, (m, point))
  return 0.0;
}

/* Integral of the density over [t0, t1], in m; outside the span it is 0. */
SHARED real medium_depth(uint kind, SHARED_IN(MediumShape) m, real3 origin, real3 direction, real t0, real t1) {
  real2 span = medium_span(kind, m, origin, direction);
  t0 = max(t0, span.x);
  t1 = min(t1, span.y);
  if (!(t0 < t1)) return 0.0;
  DISPATCH_MEDIUM(kind, depth, (m, origin, direction, t0, t1))
  return 0.0;
}

/* Within the span: the t at which the depth from t0 on is `depth`. */
SHARED real medium_reach_from(uint kind, SHARED_IN(MediumShape) m, real3 origin, real3 direction, real t0, real depth) {
  DISPATCH_MEDIUM(kind, reach, (m, origin, direction, t0, depth))
  return kMediumFar;
}

/* The t at which the depth from t0 on is `depth`; infinite where it is not before t1. */
SHARED real medium_reach(uint kind, SHARED_IN(MediumShape) m, real3 origin, real3 direction, real t0, real t1,
                         real depth) {
  real2 span = medium_span(kind, m, origin, direction);
  t0 = max(t0, span.x);
  t1 = min(t1, span.y);
  if (!(t0 < t1)) return kMediumFar;
  real t = medium_reach_from(kind, m, origin, direction, t0, depth);
  return t < t1 ? t : kMediumFar;
}

SHARED_NAMESPACE_END

#endif
