#version 460
#extension GL_GOOGLE_include_directive : require
// Says which face a pixel sees. With exact edges the pixel's own ray decides, as the ray caster's does.
#include "render/raster/raster.shared.h"

layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(constant_id = kSpecBlends) const bool kBlends = false;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };

#include "render/raster/mirror.glsl.h"
#include "render/raster/rectangle_edges.glsl.h"

layout(location = 0) flat in uvec3 face;  // as seen_image; the chunk's detail, and which edges' lines are within
layout(location = 0) out uvec2 seen_out;

void main() {
  const uvec2 seen = face.xy;
  if (kBlends && !chunk_shown(face.z, floor(gl_FragCoord.xy))) discard;
  if (kExactEdges && !within_edges(face.z)) discard;
  if (kClips) {
    const vec3 ray =
        picture.corner.xyz + gl_FragCoord.x * picture.step_x.xyz + gl_FragCoord.y * picture.step_y.xyz;
    const uint axis = seen_face(seen.x) >> 1;
    if (behind_mirror((float(int(seen.y)) - picture.fraction[axis]) / ray[axis] * ray)) discard;
  }
  seen_out = seen;
}
