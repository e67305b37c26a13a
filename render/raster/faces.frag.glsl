#version 460
#extension GL_GOOGLE_include_directive : require
// Says which face a pixel sees. With exact edges the pixel's own ray is intersected with the face, so that coverage
// doesn't depend on the 1/256 pixel grid of the rasterizer.
#include "render/raster/raster.shared.h"

layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };

layout(location = 0) flat in uvec2 seen;
layout(location = 1) flat in vec4 rectangle;
layout(location = 0) out uvec2 seen_out;

void main() {
  if (kExactEdges) {
    const vec3 ray = picture.corner.xyz + gl_FragCoord.x * picture.step_x.xyz + gl_FragCoord.y * picture.step_y.xyz;
    const uint axis = seen.x >> (kSeenFaceShift + 1u);
    const vec3 offsets = float(int(seen.y)) - picture.fraction.xyz - picture.fraction_rest.xyz;
    const float offset = axis == 0u ? offsets.x : axis == 1u ? offsets.y : offsets.z;
    const float along = axis == 0u ? ray.x : axis == 1u ? ray.y : ray.z;
    const vec2 across = axis == 0u ? ray.zy : axis == 1u ? ray.zx : ray.yx;
    const float t = offset / along;
    const vec2 hit = t * across;
    // Rounding error of the hit (about 1e-4 pixel): faces may overlap by that much, but never leave a crack.
    const vec2 slack = abs(hit) * (2e-7 / abs(along) + 2e-7) + 2e-7 * t;
    if (t <= 0.0 || any(lessThan(hit, rectangle.xy - slack)) || any(greaterThan(hit, rectangle.zw + slack))) discard;
  }
  seen_out = seen;
}
