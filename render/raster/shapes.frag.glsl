#version 460
#extension GL_GOOGLE_include_directive : require
// Says which face of a shape a pixel sees. With exact edges the pixel's own ray decides: it is solved with the plane, and
// sees the face where the place lies on it.
#include "render/raster/raster.shared.h"

layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(constant_id = kSpecBlends) const bool kBlends = false;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindShapeQuads) uniform samplerBuffer quads;

#include "render/raster/mirror.glsl.h"

layout(location = 0) flat in uvec2 seen;
layout(location = 1) flat in vec3 corner;
layout(location = 2) flat in uint detail;
layout(location = 0) out uvec2 seen_out;

/// Faces that meet overlap by this, so that rounding leaves no gap between them.
const float kOverlap = 1e-5;

void main() {
  if (kBlends && !chunk_shown(detail, floor(gl_FragCoord.xy))) discard;
  if (kExactEdges) {
    const int at = int((seen.x & ~kSeenShape) * kQuadVectors);
    const vec3 ray = picture.corner.xyz + gl_FragCoord.x * picture.step_x.xyz + gl_FragCoord.y * picture.step_y.xyz;
    const vec3 normal = texelFetch(quads, at + 3).xyz;
    const float t = dot(normal, corner) / dot(normal, ray);
    const vec3 place = t * ray - corner;
    const vec2 on = vec2(dot(place, texelFetch(quads, at + 4).xyz), dot(place, texelFetch(quads, at + 5).xyz));
    if (!(t > 0.0) || any(lessThan(on, vec2(-kOverlap))) || any(greaterThan(on, vec2(1.0 + kOverlap)))) discard;
  }
  if (kClips) {
    const vec3 ray = picture.corner.xyz + gl_FragCoord.x * picture.step_x.xyz + gl_FragCoord.y * picture.step_y.xyz;
    const vec3 normal = texelFetch(quads, int((seen.x & ~kSeenShape) * kQuadVectors) + 3).xyz;
    if (behind_mirror(dot(normal, corner) / dot(normal, ray) * ray)) discard;
  }
  seen_out = seen;
}
