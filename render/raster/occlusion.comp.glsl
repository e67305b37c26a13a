#version 460
#extension GL_GOOGLE_include_directive : require
// Which clusters of faces may be seen past what is drawn so far. Those not drawn yet get their draw turned on.
#include "render/raster/raster.shared.h"

layout(local_size_x = 64) in;
layout(push_constant) uniform Count { uint count; };
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindTiles, std430) readonly buffer Tiles { float tiles[]; };
layout(binding = kBindCandidates, std430) readonly buffer Candidates { ivec4 candidates[]; };
layout(binding = kBindDraws, std430) writeonly buffer Draws { uint draws[]; };  // 5 words each, instanceCount second
layout(binding = kBindVisible, std430) writeonly buffer Visible { uint visible[]; };

/// Conservative: never hides a box of which a pixel could show anything.
bool may_be_seen(vec3 low, vec3 high) {
  vec2 first = vec2(1e30), last = vec2(-1e30);
  float nearest = 1e30;
  for (int i = 0; i < 8; ++i) {
    const vec3 corner = mix(low, high, bvec3((i & 1) != 0, (i & 2) != 0, (i & 4) != 0));
    const float w = dot(picture.clip_w.xyz, corner);
    if (w < picture.fraction.w) return true;
    const vec2 at = vec2(dot(picture.clip_x.xyz, corner), dot(picture.clip_y.xyz, corner)) / w;
    first = min(first, at);
    last = max(last, at);
    nearest = min(nearest, w);
  }
  const ivec2 size = ivec2(picture.screen.xy), tiles_across = (size + int(kTilePixels) - 1) / int(kTilePixels);
  // A pixel more on each side than the box covers.
  first = clamp((first * 0.5 + 0.5) * picture.screen.xy - 1.0, vec2(-1), picture.screen.xy);
  last = clamp((last * 0.5 + 0.5) * picture.screen.xy + 1.0, vec2(-1), picture.screen.xy);
  if (any(lessThan(last, vec2(0))) || any(greaterThanEqual(first, picture.screen.xy))) return false;
  const ivec2 low_tile = max(ivec2(first), ivec2(0)) / int(kTilePixels);
  const ivec2 high_tile = min(ivec2(last) / int(kTilePixels), tiles_across - 1);
  // Depth is interpolated with a relative error far below this margin.
  const float depth = picture.fraction.w / nearest * 1.001;
  for (int y = low_tile.y; y <= high_tile.y; ++y)
    for (int x = low_tile.x; x <= high_tile.x; ++x)
      if (tiles[y * tiles_across.x + x] <= depth) return true;
  return false;
}

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= count) return;
  const ivec4 low = candidates[2u * i], high = candidates[2u * i + 1u];
  const bool seen = may_be_seen(vec3(low.xyz) - picture.fraction.xyz, vec3(high.xyz) - picture.fraction.xyz);
  visible[i] = seen ? 1u : 0u;
  if (low.w >= 0) draws[5u * uint(low.w) + 1u] = seen ? 1u : 0u;
}
