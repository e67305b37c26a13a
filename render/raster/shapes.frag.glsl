#version 460
#extension GL_GOOGLE_include_directive : require
// Says which face of a shape a pixel sees. With exact edges the pixel's own ray decides: it is solved with the plane, and
// sees the face where the place lies on it.
#include "render/raster/raster.shared.h"

layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(constant_id = kSpecBlends) const bool kBlends = false;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };

#include "render/raster/mirror.glsl.h"
#include "render/raster/shape_face.glsl.h"

layout(location = 0) flat in uvec2 seen;
layout(location = 1) flat in vec3 corner;
layout(location = 2) flat in uint detail;
layout(location = 0) out uvec2 seen_out;

void main() {
  if (kBlends && !chunk_shown(detail, floor(gl_FragCoord.xy))) discard;
  if (kExactEdges || kClips) {
    const uint quad = seen.x & ~kSeenShape;
    const vec3 ray = fragment_ray();
    const float t = distance_to_face(quad, corner, ray);
    if (kExactEdges && !lies_on_face(quad, corner, ray, t)) discard;
    if (behind_mirror(t * ray)) discard;
  }
  seen_out = seen;
}
