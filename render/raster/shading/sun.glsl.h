// How much of the sun arrives at a point of a face.
#ifndef LOAM_RENDER_RASTER_SHADING_SUN_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_SUN_GLSL_H
#include "render/raster/shading/grid.glsl.h"
#include "render/raster/shading/sun_cascades.glsl.h"

layout(constant_id = kSpecCloudShadows) const bool kCloudShadows = false;

/// SkyView::sun_through()
float sun_through_clouds(const ivec3 voxel, const vec3 fraction) {
  return cloud_sun_through(picture.clouds, vec3(voxel - picture.camera_voxel.xyz) + fraction);
}

/// SunMap::lit_at()
float sun_map_lit_at(const SunMapFrame frame, const vec2 at, const float reach) {
  if (!(at.x >= 0.0 && at.y >= 0.0 && at.x < float(frame.size.x - 1) && at.y < float(frame.size.y - 1))) return 1.0;
  const uint first = uint(at.y) * uint(frame.size.x) + uint(at.x), next = first + uint(frame.size.x);
  return sun_map_lit(vec4(sun_map_word(first), sun_map_word(first + 1u), sun_map_word(next), sun_map_word(next + 1u)),
                     fract(at), reach);
}

/// SunMaps::lit()
float sun_map_at(const ivec3 voxel, const vec3 fraction, const uint axis) {
  const SunMapFrame frame = SunMapFrame(picture.map_u, picture.map_v, picture.map_w, picture.map_low, picture.map_size);
  const vec3 place = sun_map_place(frame, vec3(voxel - frame.low.xyz) + fraction);
  if (kSunCascades > 0) return sun_cascades_lit(place, abs(picture.sun[axis]));
  const float reach = place.z - sun_map_filtered_bias(frame.w.w, abs(picture.sun[axis]), kSunMapFilter);
  float sum = 0.0;
  for (int j = 0; j < kSunMapFilter; ++j)
    for (int i = 0; i < kSunMapFilter; ++i)
      sum += sun_map_lit_at(frame, place.xy - 0.5 + (0.5 - 0.5 * float(kSunMapFilter)) + vec2(i, j), reach);
  return sum / float(kSunMapFilter * kSunMapFilter);
}

/// The same, and 0 where a triangle but one lies on the way: maps hold none.
float sun_by_map(const ivec3 voxel, const vec3 fraction, const uint axis, uint triangle) {
  if (kMeshes && meets_mesh(voxel, fraction, picture.sun.xyz, 1e30, triangle)) return 0.0;
  return sun_map_at(voxel, fraction, axis);
}

#endif
