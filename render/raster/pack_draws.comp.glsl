#version 460
#extension GL_GOOGLE_include_directive : require
// The indirect draws of a page that draw anything, moved to the front in their order, and how many they are: reading one
// that draws nothing takes software as long as some triangles. One group a page.
#include "render/raster/raster.shared.h"

layout(local_size_x = 64) in;
layout(push_constant) uniform Range { uint begin, end, page; };  // of draws
layout(binding = kBindDraws, std430) buffer Draws { uint draws[]; };  // 5 words: indexCount, instanceCount..
layout(binding = kBindDrawCounts, std430) writeonly buffer Counts { uint counts[]; };

shared uint before_of[64];

void main() {
  const uint lane = gl_LocalInvocationIndex;
  uint packed = begin;
  for (uint first = begin; first < end; first += 64u) {
    const uint at = 5u * (first + lane);
    uint draw[5];
    const bool there = first + lane < end && draws[at + 1u] != 0u;
    if (there)
      for (uint w = 0u; w < 5u; ++w) draw[w] = draws[at + w];
    // Sums of the lanes before and this one, by doubling.
    before_of[lane] = there ? 1u : 0u;
    barrier();
    for (uint step = 1u; step < 64u; step += step) {
      const uint sum = before_of[lane] + (lane >= step ? before_of[lane - step] : 0u);
      barrier();
      before_of[lane] = sum;
      barrier();
    }
    if (there)
      for (uint w = 0u; w < 5u; ++w) draws[5u * (packed + before_of[lane] - 1u) + w] = draw[w];
    packed += before_of[63];
    barrier();
  }
  if (lane == 0u) counts[page] = packed - begin;
}
