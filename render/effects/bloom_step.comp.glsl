#version 460
#extension GL_GOOGLE_include_directive : require
// One step of making the lobes of bloom: halves a level, or blurs it along rows or columns.
#include "render/effects/device.shared.h"
#include "render/effects/bloom.shared.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = kSpecStep) const uint kKind = 0u;
layout(push_constant) uniform Step { BloomStep pushed; };

void main() {
  const ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (at.x >= pushed.to_width || at.y >= pushed.to_height) return;
  BloomStep now = pushed;
  now.kind = kKind;
  const vec3 made = bloom_made(now, at.x, at.y);
  const int to = now.to + 3 * (at.y * now.to_width + at.x);
  blurred[to] = made.r;
  blurred[to + 1] = made.g;
  blurred[to + 2] = made.b;
}
