#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// One of the two passes of section 14.10.3 over an interface: what it and the run of the block beyond let through, by
// which both targets are multiplied; or what it shows, which is added to the first.
#include "render/raster/block_grid.glsl.h"
#include "render/raster/rectangle_edges.glsl.h"

layout(early_fragment_tests) in;
layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(constant_id = kSpecAddsShown) const bool kAddsShown = false;
layout(binding = kBindSeen) uniform utexture2D seen_image;
layout(location = 0) flat in uvec3 seen;
layout(location = 0) out vec4 shown_out;
layout(location = 1) out vec4 passed_out;

void main() {
  if (kFogShafts) fog_shift = fog_shaft_shift(floor(gl_FragCoord.x), floor(gl_FragCoord.y));
  const vec3 ray = pixel_ray(gl_FragCoord.xy);
  const Interface i = interface_of(seen.x, int(seen.y), ray);
  if (kExactEdges && !within_edges(seen.z)) discard;
  const float inverse_length = inversesqrt(dot(ray, ray));
  if (i.t > picture.sun.w * inverse_length) discard;
  const vec3 direction = ray * inverse_length;
  const InterfaceShares shares = shares_of(i, direction);
  vec3 passed = shares.passed;
  const vec3 absorption = layer_block(i.far).absorption.xyz;
  if ((!kAddsShown || kVeiled) && absorption != vec3(0)) {
    const FacePoint at =
        stepped_beyond(face_point(0u, i.face, i.t * ray + picture.fraction.xyz, i.plane, -direction), i, direction);
    passed *= absorbed_along(absorption, run_length(at.front, at.fraction, direction, i.far));
  }
  const float n_near = layer_block(i.near).absorption.w;
  passed *= radiance_scale(n_near, layer_block(i.far).absorption.w);
  if (kAddsShown) {
    const uvec2 behind = texelFetch(seen_image, ivec2(gl_FragCoord.xy), 0).xy;
    // Nearer interfaces scale what lies behind them; what this one mirrors or shows is radiance as the eye sees it.
    const float scale = radiance_scale(n_near, eye_absorption().w);
    shown_out = vec4(shown_radiance(i, shares, scale, passed, ray, direction, behind), 0);
    passed_out = vec4(0);
    return;
  }
  shown_out = passed_out = vec4(passed, 1);
}
