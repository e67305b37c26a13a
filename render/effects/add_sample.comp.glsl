#version 460
#extension GL_GOOGLE_include_directive : require
// Adds a picture to a sum of several: samples of a pixel.
#include "render/effects/device.shared.h"

layout(local_size_x = 64) in;
layout(push_constant) uniform Push { AddSample pushed; };
layout(binding = kEffectBindPicture, std430) readonly buffer Picture { float picture[]; };
layout(binding = kEffectBindFinished, std430) buffer Sum { uint sum[]; };

void main() {
  // Rows of 65535 groups: a dispatch takes no more along an axis.
  const uint i = gl_GlobalInvocationID.y * (65535u * 64u) + gl_GlobalInvocationID.x;
  if (i >= pushed.numbers) return;
  const float before = pushed.first != 0u ? 0.0 : uintBitsToFloat(sum[i]);
  sum[i] = floatBitsToUint(before + pushed.weight * picture[i / 3u * pushed.stride + i % 3u]);
}
