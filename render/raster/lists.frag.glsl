#version 460
#extension GL_GOOGLE_include_directive : require
// Adds an interface to the list of its pixel.
#include "render/raster/raster.shared.h"
#include "render/raster/rectangle_test.glsl.h"
#include "render/raster/transparency.shared.h"

layout(early_fragment_tests) in;
layout(constant_id = kSpecExactEdges) const bool kExactEdges = true;
layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindLayerConstants) uniform Layers { LayerConstants layers; };
layout(binding = kBindLayerHeads, r32ui) uniform uimage2D heads;
layout(binding = kBindLayerNodes, std430) writeonly buffer Nodes { uint nodes[]; };
layout(binding = kBindLayerCount, std430) buffer Count { uint count; };
layout(constant_id = kSpecListedPixels) const bool kListedPixels = false;
layout(binding = kBindLayerPixels, std430) writeonly buffer Pixels { uint pixels[]; };
layout(binding = kBindLayerDispatch, std430) buffer Dispatch { uint layer_groups, one_y, one_z, pixel_count; };

#include "render/raster/fragment_ray.glsl.h"

layout(location = 0) flat in uvec3 seen;
layout(location = 1) flat in vec4 rectangle;

void main() {
  if (kExactEdges && !meets_rectangle(seen.x >> 14u & 3u, uintBitsToFloat(seen.z), rectangle, fragment_ray())) return;
  const uint node = atomicAdd(count, 1u);
  if (node >= uint(layers.eye.y)) return;  // counted: the next try has room
  const uvec2 pixel = uvec2(gl_FragCoord.xy);
  const uint last = imageAtomicExchange(heads, ivec2(pixel), node + 1u);
  nodes[3u * node] = last;
  nodes[3u * node + 1u] = seen.x;
  nodes[3u * node + 2u] = seen.y;
  if (kListedPixels && last == 0u) {
    const uint place = atomicAdd(pixel_count, 1u);
    pixels[place] = pixel.x | pixel.y << 16;
    if (place % 64u == 0u) atomicAdd(layer_groups, 1u);
  }
}
