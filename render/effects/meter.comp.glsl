#version 460
#extension GL_GOOGLE_include_directive : require
// Counts pixels by luminance; then, in a second dispatch of one group, what exposure that asks for.
#include "render/effects/device.shared.h"
#include "render/effects/exposure.shared.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = kSpecResolve) const bool kResolve = false;
shared uint counts[kMeterBuckets];

void main() {
  const ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (kResolve) {
    if (pixel != ivec2(0)) return;
    uint all = 0u;
    for (int i = 0; i < kMeterBuckets; ++i) all += meter[i];
    MeterSum sum = MeterSum(0.0, 0.0, 0.0);
    for (int i = 0; i < kMeterBuckets; ++i) sum = meter_add(sum, float(all), i, float(meter[i]));
    meter[kMeterEv] = floatBitsToUint(metered_ev(sum));
    return;
  }
  // A group counts by itself first: integers, so that no order shows.
  for (uint i = gl_LocalInvocationIndex; i < uint(kMeterBuckets); i += 64u) counts[i] = 0u;
  barrier();
  // Each invocation takes a column of eight pixels.
  for (int row = 0; row < 8; ++row) {
    const ivec2 at = ivec2(pixel.x, (pixel.y >> 3) * 64 + (pixel.y & 7) * 8 + row);
    if (at.x >= f.size.x || at.y >= f.size.y) continue;
    const int bucket = meter_bucket(texel(at.x, at.y));
    if (bucket >= 0) atomicAdd(counts[bucket], 1u);
  }
  barrier();
  for (uint i = gl_LocalInvocationIndex; i < uint(kMeterBuckets); i += 64u)
    if (counts[i] != 0u) atomicAdd(meter[i], counts[i]);
}
