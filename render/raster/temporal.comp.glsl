#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Mixes a picture with what the pictures before it saw: see temporal_pass.h. A second dispatch, with a mark below 0,
// writes what came of it into the picture, since neighbours read that in the first.
#include "render/raster/raster.shared.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(push_constant) uniform Push {
  TemporalConstants constants;
  uvec2 first_group;
};
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindDepth) uniform texture2D depth_image;
layout(binding = kBindColour, rgba32f) uniform image2D colour_image;
layout(binding = kBindHistory, std430) readonly buffer History { vec4 history[]; };
layout(binding = kBindNewHistory, std430) buffer NewHistory { vec4 new_history[]; };

const float kMostPictures = 8.0;

vec4 seen_before(ivec2 at, ivec2 size) {
  at = clamp(at, ivec2(0), size - 1);
  return history[at.y * size.x + at.x];
}

void main() {
  const ivec2 pixel = ivec2(8u * first_group + gl_GlobalInvocationID.xy), size = ivec2(picture.screen.xy);
  if (any(greaterThanEqual(pixel, size))) return;
  const int index = pixel.y * size.x + pixel.x;
  const float mark = constants.then_forward.w;
  if (mark < 0.0) {
    imageStore(colour_image, pixel, vec4(new_history[index].rgb, 1));
    return;
  }
  const vec3 now = imageLoad(colour_image, pixel).rgb;
  vec4 mixed = vec4(now, 1);
  if (mark > 0.0) {
    // How far the surface has moved on the screen since.
    const vec2 through = vec2(pixel) + 0.5;
    const vec3 ray = picture.corner.xyz + through.x * picture.step_x.xyz + through.y * picture.step_y.xyz;
    const float depth = texelFetch(depth_image, pixel, 0).x;
    const vec3 point = depth > 0.0 ? ray * (picture.fraction.w / depth) + constants.moved.xyz : ray;
    const float w = dot(constants.then_forward.xyz, point);
    const vec2 clip = vec2(dot(constants.then_right.xyz, point), dot(constants.then_down.xyz, point)) / w;
    const vec2 shift = vec2(constants.then_right.w, constants.then_down.w);
    vec2 motion = (clip * 0.5 + 0.5) * vec2(size) - (through + shift);
    if (all(lessThan(abs(motion), vec2(0.01)))) motion = vec2(0);
    const vec2 from = through + motion;
    if (w > 0.0 && all(greaterThanEqual(from, vec2(0))) && all(lessThan(from, vec2(size)))) {
      const vec2 corner = from - 0.5, low = floor(corner), part = corner - low;
      const ivec2 at = ivec2(low);
      vec4 before = mix(mix(seen_before(at, size), seen_before(at + ivec2(1, 0), size), part.x),
                        mix(seen_before(at + ivec2(0, 1), size), seen_before(at + ivec2(1, 1), size), part.x), part.y);
      vec3 least = now, most = now;
      for (int i = 0; i < 9; ++i) {
        const ivec2 beside = clamp(pixel + ivec2(i % 3 - 1, i / 3 - 1), ivec2(0), size - 1);
        const vec3 colour = imageLoad(colour_image, beside).rgb;
        least = min(least, colour);
        most = max(most, colour);
      }
      const float count = min(before.a + 1.0, kMostPictures);
      mixed = vec4(mix(clamp(before.rgb, least, most), now, 1.0 / count), count);
    }
  }
  new_history[index] = mixed;
}
