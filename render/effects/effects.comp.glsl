#version 460
#extension GL_GOOGLE_include_directive : require
// The last pass of a picture's effects: all that looks at a pixel and around it, in one go.
#include "render/effects/device.shared.h"
#include "render/image/formats.shared.h"
layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = kSpecEffects) const uint kEffects = 0u;
layout(constant_id = kSpecToneCurve) const uint kToneCurve = 0u;
layout(constant_id = kSpecFormat) const uint kFormat = kFormatFloat32;
#define EFFECT_TONE_CURVE kToneCurve
#include "render/effects/chain.shared.h"

layout(binding = kEffectBindFinished, std430) writeonly buffer Finished { uint finished[]; };

vec3 finished_pixel(int i) {
  const int at = int(f.modes.w) * i;
  if (!(is_finite(picture[at]) && is_finite(picture[at + 1]) && is_finite(picture[at + 2])))
    atomicAdd(meter[kMeterNotFinite], 1u);
  return effects_at(kEffects, ivec2(i % f.size.x, i / f.size.x));
}

void main() {
  const ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (pixel.x >= f.size.x || pixel.y >= f.size.y) return;
  const int i = pixel.y * f.size.x + pixel.x;
  if (kFormat == kFormatRgb565) {
    // Two pixels share a word.
    if ((i & 1) != 0) return;
    uint both = pack_colour(kFormat, finished_pixel(i) * f.window.z).x;
    if (i + 1 < f.size.x * f.size.y) both |= pack_colour(kFormat, finished_pixel(i + 1) * f.window.z).x << 16u;
    finished[i >> 1] = both;
    return;
  }
  const vec3 colour = finished_pixel(i);
  if (kFormat == kFormatFloat32) {
    finished[3 * i] = floatBitsToUint(colour.r);
    finished[3 * i + 1] = floatBitsToUint(colour.g);
    finished[3 * i + 2] = floatBitsToUint(colour.b);
    return;
  }
  const uvec2 packed_colour = pack_colour(kFormat, colour * f.window.z);
  if (kFormat == kFormatHalf) {
    finished[2 * i] = packed_colour.x;
    finished[2 * i + 1] = packed_colour.y;
  } else {
    finished[i] = packed_colour.x;
  }
}
