#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Adds an interface to sums that need no order. What passes all layers is exact: a product, summed as logarithms, with
// each block's absorption along the ray as (entry less exit) times its coefficient, its index of refraction likewise. What layers show is weighted by
// depth, as though the nearest hid the others by that.
// source  Morgan McGuire, Louis Bavoil. Weighted Blended Order-Independent Transparency. 2013, equation 9
#include "render/raster/rectangle_edges.glsl.h"
#include "render/raster/transparency.glsl.h"

layout(early_fragment_tests) in;
layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(binding = kBindSeen) uniform utexture2D seen_image;
layout(location = 0) flat in uvec3 seen;
layout(location = 0) out vec4 shown_out;
layout(location = 1) out vec4 depth_out;
layout(location = 2) out vec4 rest_out;

void main() {
  if (kFogShafts) fog_shift = fog_shaft_shift(floor(gl_FragCoord.x), floor(gl_FragCoord.y));
  const vec3 ray = pixel_ray(gl_FragCoord.xy);
  const Interface i = interface_of(seen.x, int(seen.y), ray);
  if (kExactEdges && !within_edges(seen.z)) discard;
  const float inverse_length = inversesqrt(dot(ray, ray)), t = i.t * dot(ray, ray) * inverse_length;
  if (t > picture.sun.w) discard;
  const vec3 direction = ray * inverse_length;
  const InterfaceShares shares = shares_of(i, direction);
  const uvec2 behind = texelFetch(seen_image, ivec2(gl_FragCoord.xy), 0).xy;
  const vec3 shown = shown_radiance(i, shares, 1.0, shares.passed, ray, direction, behind);
  const float alpha = 1.0 - (shares.passed.x + shares.passed.y + shares.passed.z) / 3.0;
  const float z = t / 200.0;
  const float weight = clamp(0.03 / (1e-5 + z * z * z * z), 1e-2, 3e3);
  shown_out = vec4(shown, alpha) * weight;
  // Of no more than e^-40 passes: what a float target can hold many times.
  const vec3 passed = max(shares.passed, vec3(4e-18));
  const vec3 entered = layer_block(i.far).absorption.xyz - layer_block(i.near).absorption.xyz;
  depth_out = vec4(-log(passed) - entered * t, -log(max(1.0 - alpha, 4e-18)));
  rest_out = vec4(entered, layer_block(i.far).absorption.w - layer_block(i.near).absorption.w);
}
