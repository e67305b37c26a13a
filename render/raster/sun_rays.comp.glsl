#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Casts the rays to the sun that its height map leaves open. What they find in shadow, where it was shaded as lit, is
// put off.
#include "render/raster/shading/pixel.glsl.h"
#include "render/raster/shading/put_off.glsl.h"

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
  const uint index = gl_WorkGroupID.x * kShadeGroup * kShadeGroup + gl_LocalInvocationIndex;
  if (index >= ray_count) return;
  const uint place = sun_rays[index], width = uint(picture.screen.x);
  const uvec2 pixel = uvec2(place % width, place / width);
  const uvec2 seen = texelFetch(seen_image, ivec2(pixel), 0).xy;
  const vec3 ray = pixel_middle_ray(pixel);
  ivec3 start;
  vec3 fraction;
  if (kShapes && (seen.x & kSeenShape) != 0u) {
    const vec3 hit = shape_distance(seen, ray) * ray;
    start = shape_cell(seen);
    fraction = shape_fraction(start, hit);
  } else {
    const FacePoint point = seen_face_point(seen, seen_plane_t(seen, ray) * ray, normalize(ray));
    start = point.front;
    fraction = point.fraction;
  }
  if (!sun_visible(start, fraction)) put_pixel_off(place);
}
