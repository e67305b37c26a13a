// Where the ray of a pixel meets a face of a shape: what the fragment shaders of shapes share. Needs `picture`.
#ifndef LOAM_RENDER_RASTER_SHAPE_FACE_GLSL_H
#define LOAM_RENDER_RASTER_SHAPE_FACE_GLSL_H
#include "render/raster/fragment_ray.glsl.h"
#include "render/raster/shape_quads.glsl.h"

/// Along the ray, to the face's plane. corner: of the face, relative to the camera.
float distance_to_face(uint quad, vec3 corner, vec3 ray) {
  const vec3 normal = texelFetch(quads, int(quad * kQuadVectors) + 3).xyz;
  return dot(normal, corner) / dot(normal, ray);
}

/// Whether the place t along the ray lies in front of the camera and on the face.
bool lies_on_face(uint quad, vec3 corner, vec3 ray, float t) {
  const int at = int(quad * kQuadVectors);
  const vec3 place = t * ray - corner;
  const vec2 on = vec2(dot(place, texelFetch(quads, at + 4).xyz), dot(place, texelFetch(quads, at + 5).xyz));
  return t > 0.0 && lies_within(on);
}

#endif
