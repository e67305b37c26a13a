#version 460
#extension GL_GOOGLE_include_directive : require
// Adds an interface to the list of its pixel. The first takes the pixel's own node, so that most pixels ask for no number
// that all share.
#include "render/raster/raster.shared.h"
#include "render/raster/rectangle_edges.glsl.h"
#include "render/raster/transparency.shared.h"

layout(early_fragment_tests) in;
layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindLayerConstants) uniform Layers { LayerConstants layers; };
layout(binding = kBindLayerHeads, r32ui) uniform uimage2D heads;
layout(binding = kBindLayerNodes, std430) writeonly buffer Nodes { uvec4 nodes[]; };
layout(binding = kBindLayerCount, std430) buffer Count { uint count; };
layout(constant_id = kSpecListedTiles) const bool kListedTiles = false;
layout(binding = kBindLayerTileMarks, std430) writeonly buffer TileMarks { uint tile_marks[]; };

layout(location = 0) flat in uvec3 seen;
layout(location = 0) out uvec2 own_node;

void main() {
  if (kExactEdges && !within_edges(seen.z)) discard;
  const ivec2 pixel = ivec2(gl_FragCoord.xy);
  own_node = seen.xy;
  if (imageAtomicCompSwap(heads, pixel, 0u, kOwnNode) == 0u) {
    if (kListedTiles) tile_marks[tile_place(pixel.x >> 3, pixel.y >> 3, layers.eye.w)] = 1u;
    return;
  }
  const uint node = atomicAdd(count, 1u);
  // Beyond those that fit it is only counted: the next try has room.
  if (node < uint(layers.eye.y))
    nodes[node].xyz = uvec3(imageAtomicExchange(heads, pixel, node + kFirstNode), seen.xy);
  discard;
}
