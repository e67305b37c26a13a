// The pixel's ray, for fragment shaders that ask it exactly: its vertices bring what it is made of as flat inputs. Of a
// uniform buffer software reads a number lane by lane in a fragment shader, some 24 instructions, four of a texel in
// 40, a flat one in three. The vertex shader defines RAY_TO_FRAGMENTS and calls write_ray().
#ifndef LOAM_RENDER_RASTER_FRAGMENT_RAY_GLSL_H
#define LOAM_RENDER_RASTER_FRAGMENT_RAY_GLSL_H

#ifdef RAY_TO_FRAGMENTS
layout(location = 8) flat out vec3 ray_corner;
layout(location = 9) flat out vec3 ray_step_x;
layout(location = 10) flat out vec3 ray_step_y;

/// Needs `picture`.
void write_ray() {
  ray_corner = picture.corner.xyz;
  ray_step_x = picture.step_x.xyz;
  ray_step_y = picture.step_y.xyz;
}
#else
layout(location = 8) flat in vec3 ray_corner;
layout(location = 9) flat in vec3 ray_step_x;
layout(location = 10) flat in vec3 ray_step_y;

/// Its component along the camera's direction is 1.
vec3 fragment_ray() { return ray_corner + gl_FragCoord.x * ray_step_x + gl_FragCoord.y * ray_step_y; }
#endif

#endif
