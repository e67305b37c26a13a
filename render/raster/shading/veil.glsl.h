// What lies before all that the eye sees: media, and clouds where these lie before others than the sky.
#ifndef LOAM_RENDER_RASTER_SHADING_VEIL_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_VEIL_GLSL_H
#include "render/raster/shading/media.glsl.h"
#include "render/raster/shading/sky.glsl.h"

const bool kVeiled = kMedia || kCloudsBefore;

/// A ray from the eye on, as far as it has been followed.
struct VeilWalk {
  FogWalk begun, fog;
  FogView view;
};

/// t_end: where the ray ends, past all that is seen through.
VeilWalk begin_veil(vec3 direction, float t_end) {
  VeilWalk w;
  w.fog.direction = direction;
  w.fog.view.value = vec3(1.0);
  w.fog.view.added = vec3(0.0);
  if (kMedia) w.fog = begin_fog(picture.camera_voxel.xyz, picture.fraction.xyz, direction, t_end);
  w.begun = w.fog;
  w.view = w.fog.view;
  return w;
}

/// On to t: Transport::fog_straight() and with_clouds() of render/trace/transport.h.
void follow_veil(inout VeilWalk w, float t) {
  if (kMedia) follow_fog(w.fog, t);
  w.view = w.fog.view;
  if (!kCloudsBefore) return;
  const CloudView clouds = clouds_up_to(picture.fraction.xyz, w.fog.direction, t);
  if (clouds.through == 1.0) return;
  FogWalk nearer = w.begun;
  if (kMedia) follow_fog(nearer, clouds.distance);
  w.view.added = clouds_laid_over(clouds, nearer.view.value, nearer.view.added, w.fog.view.added);
  w.view.value = clouds.through * w.fog.view.value;
}

FogView veil_before(vec3 direction, float t_end) {
  VeilWalk walk = begin_veil(direction, t_end);
  follow_veil(walk, t_end);
  return walk.view;
}

#endif
