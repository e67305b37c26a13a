#version 460
#extension GL_GOOGLE_include_directive : require
// Says which face a pixel sees. With exact edges the pixel's own ray decides: it crosses the planes of the grid in the
// order of (t, axis), as the ray caster does, and sees a face where it crosses the face's plane after it has entered the
// face's rectangle and before it leaves. Every face works t out from the same integers, so a ray sees exactly one face
// of a convex edge: no crack, no overlap, at merged faces too.
#include "render/raster/raster.shared.h"

layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(constant_id = kSpecBlends) const bool kBlends = false;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };

#include "render/raster/fragment_ray.glsl.h"
#include "render/raster/mirror.glsl.h"
#include "render/raster/rectangle_test.glsl.h"

layout(location = 0) flat in uvec4 face;  // as seen_image; the chunk's detail; offset of the plane, a float's bits
layout(location = 1) flat in vec4 rectangle;
layout(location = 0) out uvec2 seen_out;

void main() {
  const uvec2 seen = face.xy;
  if (kBlends && !chunk_shown(face.z, floor(gl_FragCoord.xy))) discard;
  if (kExactEdges && !meets_rectangle(seen_face(seen.x) >> 1, uintBitsToFloat(face.w), rectangle, fragment_ray()))
    discard;
  if (kClips) {
    const vec3 ray = fragment_ray();
    const uint axis = seen_face(seen.x) >> 1;
    if (behind_mirror((float(int(seen.y)) - picture.fraction[axis]) / ray[axis] * ray)) discard;
  }
  seen_out = seen;
}
