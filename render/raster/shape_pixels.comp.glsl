#version 460
#extension GL_GOOGLE_include_directive : require
// What pixels see of small shapes, past what is drawn already: small_shapes.shared.h. An invocation has eight of a row.
#include "render/raster/small_shapes.shared.h"

layout(local_size_x = kBlockPixels, local_size_y = kBlocksInGroup) in;
layout(push_constant) uniform Rows { uint row_pixels, seen_row_pixels, height; };
layout(binding = kBindShapeSetups) uniform usamplerBuffer setups;
layout(binding = kBindShapeKeys, std430) writeonly buffer Keys { uvec4 keys[]; };
layout(binding = kBindShapeKeyTexels) uniform usamplerBuffer key_texels;
layout(binding = kBindShapeBlocks) uniform usamplerBuffer blocks;
layout(binding = kBindShapeHead, std430) readonly buffer Head { uint head[]; };
layout(binding = kBindBlockDepths, std430) writeonly buffer Depths { float depths[]; };
layout(binding = kBindBlockDepthTexels) uniform samplerBuffer depth_texels;
layout(binding = kBindSeenRows, std430) writeonly buffer SeenRows { uvec2 seen_rows[]; };

void show(uvec2 key, float behind, uvec2 pixel) {
  const float depth = uintBitsToFloat(key.y);
  if (depth <= behind) return;
  const uint order = ~key.x, face = order & ((1u << kShapeFaceBits) - 1u);
  const uvec2 setup = texelFetch(setups, int(order >> kShapeFaceBits)).xy;
  depths[pixel.y * row_pixels + pixel.x] = depth;
  seen_rows[pixel.y * seen_row_pixels + pixel.x] = uvec2(kSeenShape | setup.x + face, setup.y);
}

void main() {
  const uint at = gl_WorkGroupID.x * kBlocksInGroup + gl_LocalInvocationID.y;
  if (at >= head[3]) return;
  const uint packed = texelFetch(blocks, int(at)).x;
  const uvec2 first = uvec2(packed & 0xffffu, packed >> 16) * kBlockPixels + uvec2(0, gl_LocalInvocationID.x);
  if (first.y >= height) return;
  const uint place = first.y * row_pixels + first.x;
  for (uint four = 0u; four < kBlockPixels; four += 4u) {
    const uint two = (place + four) / 2u;
    const uvec4 left = texelFetch(key_texels, int(two)), right = texelFetch(key_texels, int(two) + 1);
    const vec4 behind = texelFetch(depth_texels, int((place + four) / 4u));
    const uvec2 pixel = first + uvec2(four, 0);
    show(left.xy, behind.x, pixel);
    show(left.zw, behind.y, pixel + uvec2(1, 0));
    show(right.xy, behind.z, pixel + uvec2(2, 0));
    show(right.zw, behind.w, pixel + uvec2(3, 0));
    keys[two] = keys[two + 1u] = uvec4(0);  // for the next picture
  }
}
