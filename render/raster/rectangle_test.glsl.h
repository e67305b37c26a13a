// Whether the ray of a pixel meets a rectangle of faces: it crosses the planes of the grid in the order of (t, axis),
// as the ray caster does, and meets a face where it crosses the face's plane after it has entered the rectangle and
// before it leaves.
#ifndef LOAM_RENDER_RASTER_RECTANGLE_TEST_GLSL_H
#define LOAM_RENDER_RASTER_RECTANGLE_TEST_GLSL_H

/// Whether a ray that crosses plane `a` at t_a and plane `b` at t_b crosses `a` first; a_first settles a tie.
bool crosses_before(float t_a, float t_b, bool a_first) { return a_first ? t_a <= t_b : t_a < t_b; }

/// offset: of the plane from the camera; rectangle: low u, low v, high u, high v, relative to the camera, with u and v
/// as in face_record.shared.h: z y of x faces, z x of y faces, y x of z faces.
bool meets_rectangle(uint axis, float offset, vec4 rectangle, vec3 ray) {
  const vec3 inverse = 1.0 / ray;
  const float t = offset * (axis == 0u ? inverse.x : axis == 1u ? inverse.y : inverse.z);
  const vec2 across = axis == 0u ? inverse.zy : axis == 1u ? inverse.zx : inverse.yx;
  const vec2 t_low = rectangle.xy * across, t_high = rectangle.zw * across;
  const vec2 t_enter = min(t_low, t_high), t_leave = max(t_low, t_high);
  const bool u_first = axis == 2u, v_first = axis != 0u;  // the axis of u, of v comes before the face's own
  return t > 0.0 && crosses_before(t_enter.x, t, u_first) && !crosses_before(t_leave.x, t, u_first) &&
         crosses_before(t_enter.y, t, v_first) && !crosses_before(t_leave.y, t, v_first);
}

#endif
