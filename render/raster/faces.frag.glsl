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

#include "render/raster/mirror.glsl.h"

layout(location = 0) flat in uvec2 seen;
layout(location = 1) flat in vec4 rectangle;
layout(location = 2) flat in uint detail;
layout(location = 0) out uvec2 seen_out;

/// Whether a ray that crosses plane `a` at t_a and plane `b` at t_b crosses `a` first; a_first settles a tie.
bool crosses_before(float t_a, float t_b, bool a_first) { return a_first ? t_a <= t_b : t_a < t_b; }

void main() {
  if (kBlends && !chunk_shown(detail, floor(gl_FragCoord.xy))) discard;
  if (kExactEdges) {
    const vec3 ray = picture.corner.xyz + gl_FragCoord.x * picture.step_x.xyz + gl_FragCoord.y * picture.step_y.xyz;
    const vec3 inverse = 1.0 / ray;
    const uint axis = seen_face(seen.x) >> 1;
    const vec3 offsets = float(int(seen.y)) - picture.fraction.xyz - picture.fraction_rest.xyz;
    const float t = axis == 0u ? offsets.x * inverse.x : axis == 1u ? offsets.y * inverse.y : offsets.z * inverse.z;
    // u and v as in face_record.shared.h: z y of x faces, z x of y faces, y x of z faces.
    const vec2 across = axis == 0u ? inverse.zy : axis == 1u ? inverse.zx : inverse.yx;
    const vec2 t_low = rectangle.xy * across, t_high = rectangle.zw * across;
    const vec2 t_enter = min(t_low, t_high), t_leave = max(t_low, t_high);
    const bool u_first = axis == 2u, v_first = axis != 0u;  // the axis of u, of v comes before the face's own
    if (!(t > 0.0) || !crosses_before(t_enter.x, t, u_first) || crosses_before(t_leave.x, t, u_first) ||
        !crosses_before(t_enter.y, t, v_first) || crosses_before(t_leave.y, t, v_first))
      discard;
  }
  if (kClips) {
    const vec3 ray = picture.corner.xyz + gl_FragCoord.x * picture.step_x.xyz + gl_FragCoord.y * picture.step_y.xyz;
    const uint axis = seen_face(seen.x) >> 1;
    if (behind_mirror((float(int(seen.y)) - picture.fraction[axis]) / ray[axis] * ray)) discard;
  }
  seen_out = seen;
}
