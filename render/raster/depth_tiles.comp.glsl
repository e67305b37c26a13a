#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// The farthest depth of each tile of pixels: what hides whatever lies behind it.
#include "render/raster/raster.shared.h"

layout(local_size_x = 16, local_size_y = 4) in;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindDepth) uniform texture2D depth;
layout(binding = kBindTiles, std430) writeonly buffer Tiles { float tiles[]; };

void main() {
  const ivec2 size = ivec2(picture.screen.xy), tiles_across = (size + int(kTilePixels) - 1) / int(kTilePixels);
  const ivec2 tile = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(tile, tiles_across))) return;
  const ivec2 low = tile * int(kTilePixels), high = min(low + int(kTilePixels), size);
  float farthest = 1.0;  // reversed: 0 is infinitely far
  for (int y = low.y; y < high.y && farthest > 0.0; ++y)
    for (int x = low.x; x < high.x; ++x) farthest = min(farthest, texelFetch(depth, ivec2(x, y), 0).r);
  tiles[tile.y * tiles_across.x + tile.x] = farthest;
}
