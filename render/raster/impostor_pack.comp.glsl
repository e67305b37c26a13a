#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Keeps what is seen of a chunk as the texels of its impostor.
#include "render/raster/impostors.shared.h"
#include "render/raster/raster.shared.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(push_constant) uniform Push { ImpostorPack pack; };
layout(binding = kBindImpostorSeen) uniform utexture2D seen_image;
layout(binding = kBindImpostorDepth) uniform texture2D depth_image;
layout(binding = kBindImpostorTexels, std430) writeonly buffer Texels { uvec2 texels[]; };
layout(binding = kBindImpostorRows, std430) buffer Rows { uint rows[]; };

/// Of the place of a texel; 0 where it shows nothing.
uvec2 seen_at(ivec2 at) {
  if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, pack.from.zw))) return uvec2(0);
  return texelFetch(seen_image, pack.from.xy + at, 0).xy;
}

/// Whether what a texel shows lies so near a side of its chunk that `texels` reach over it.
bool at_a_side(ivec2 at, float texels) {
  const vec3 ray = pack.corner.xyz + (float(at.x) + 0.5) * pack.step_x.xyz + (float(at.y) + 0.5) * pack.step_y.xyz;
  const float depth = pack.corner.w / texelFetch(depth_image, pack.from.xy + at, 0).r;
  const vec3 place = depth * ray - pack.low.xyz;
  const float reach = texels * depth * length(pack.step_x.xyz);
  return any(lessThan(place, vec3(reach))) || any(greaterThan(place, vec3(pack.low.w - reach)));
}

void main() {
  const ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, pack.from.zw))) return;
  ivec2 of = at;
  uvec2 seen = seen_at(at);
  if (seen.x == 0u) {
    // The nearest that spreads this far.
    int least = kSpreadTexels * kSpreadTexels + 1;
    for (int dy = -kSpreadTexels; dy <= kSpreadTexels; ++dy)
      for (int dx = -kSpreadTexels; dx <= kSpreadTexels; ++dx) {
        const ivec2 beside = at + ivec2(dx, dy);
        if (dx * dx + dy * dy >= least || seen_at(beside).x == 0u ||
            !at_a_side(beside, float(kSpreadTexels) + 1.0))
          continue;
        least = dx * dx + dy * dy;
        of = beside;
      }
    seen = seen_at(of);
  }
  uvec2 texel = uvec2(0);
  if (seen.x != 0u) {
    const uint face = seen_face(seen.x);
    const int plane = (int(seen.y) - pack.chunk[face >> 1]) >> (pack.chunk.w & int(kChunkLevel));
    texel = uvec2(seen_block(seen.x) | face << kTexelFaceShift | uint(plane) << kTexelPlaneShift,
                  floatBitsToUint(texelFetch(depth_image, pack.from.xy + of, 0).r));
    const uint strip = pack.first.y + uint(at.x) / kStripTexels;
    atomicMin(rows[2u * strip], uint(at.y));
    atomicMax(rows[2u * strip + 1u], uint(at.y));
  }
  texels[pack.first.x + uint(at.y * pack.from.z + at.x)] = texel;
}
