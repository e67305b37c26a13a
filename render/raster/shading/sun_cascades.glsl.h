// How much of the sun arrives at a point by its maps in cascades: SunCascades::lit() of render/light/sun_cascades.h.
#ifndef LOAM_RENDER_RASTER_SHADING_SUN_CASCADES_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_SUN_CASCADES_GLSL_H
#include "render/light/sun_cascades.shared.h"
#include "render/light/sun_map.shared.h"
#include "render/raster/shading/picture.glsl.h"

layout(constant_id = kSpecSunCascades) const int kSunCascades = 0;  // 0: one map
layout(constant_id = kSpecSunMapFilter) const int kSunMapFilter = 1;
layout(binding = kBindSunMap) uniform samplerBuffer sun_map;

float sun_map_word(uint at) { return texelFetch(sun_map, int(at)).x; }

float sun_cascade_lit(const int cascade, const vec3 place, const float cosine) {
  const float texel = sun_map_word(uint(cascade + 1) * kSunCascadeWords);
  const int side = int(sun_map_word(2));
  const float reach = place.z - sun_map_filtered_bias(texel, cosine, kSunMapFilter);
  float sum = 0.0;
  for (int j = 0; j < kSunMapFilter; ++j)
    for (int i = 0; i < kSunMapFilter; ++i) {
      const vec2 at = place.xy / texel - 0.5 * float(kSunMapFilter) + vec2(i, j), base = floor(at);
      const ivec2 t = ivec2(base);
      const vec4 depths = vec4(sun_map_word(sun_cascade_slot(cascade, t.x, t.y, side)),
                               sun_map_word(sun_cascade_slot(cascade, t.x + 1, t.y, side)),
                               sun_map_word(sun_cascade_slot(cascade, t.x, t.y + 1, side)),
                               sun_map_word(sun_cascade_slot(cascade, t.x + 1, t.y + 1, side)));
      sum += sun_map_lit(depths, at - base, reach);
    }
  return sum / float(kSunMapFilter * kSunMapFilter);
}

/// place: m, of the maps' frame.
float sun_cascades_lit(const vec3 place, const float cosine) {
  const vec2 aside = abs(place.xy - vec2(sun_map_word(0), sun_map_word(1)));
  const float distance = max(aside.x, aside.y);
  for (int k = 0; k < kSunCascades; ++k) {
    const float reach = sun_map_word(uint(k + 1) * kSunCascadeWords + 1u);
    if (!(distance <= reach)) continue;
    const float own = sun_cascade_lit(k, place, cosine);
    const float next = k + 1 < kSunCascades ? sun_cascade_blend(distance, reach) : 0.0;
    return next > 0.0 ? mix(own, sun_cascade_lit(k + 1, place, cosine), next) : own;
  }
  return 1.0;
}

#endif
