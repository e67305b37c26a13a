#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Which layers of its block each pixel may see, a bit each: layer_blocks.h. Each invocation has a row of eight pixels, as in
// face_blocks.comp.glsl.
#include "render/gpu/time_slices.shared.h"
#include "render/raster/shading/read_picture.glsl.h"
#include "render/raster/face_blocks.shared.h"
#include "render/raster/transparency.shared.h"
#define EDGES_OF_FACES
#include "render/raster/rectangle_edges.glsl.h"
#include "render/raster/block_rows.glsl.h"

layout(constant_id = kSpecListedTiles) const bool kListedTiles = false;
layout(local_size_x = kBlockPixels, local_size_y = kBlocksInGroup) in;
layout(push_constant) uniform Room { uint of_block; };
layout(binding = kBindFaceSetups) uniform usamplerBuffer setups;
layout(binding = kBindBlockFaces) uniform usamplerBuffer block_faces;
layout(binding = kBindBlockCounts, std430) buffer BlockCounts { uint block_counts[]; };
layout(binding = kBindFaceHeads, std430) readonly buffer Heads { uint heads[]; };
layout(binding = kBindActiveBlocks) uniform usamplerBuffer active_blocks;
layout(binding = kBindDepth) uniform texture2D depth_image;
layout(binding = kBindLayerMasks, std430) writeonly buffer Masks { uvec4 masks[]; };
layout(binding = kBindLayerTiles, std430) writeonly buffer Tiles { uint tiles[]; };
layout(binding = kBindLayerDispatch, std430) buffer Dispatch {
  ListHead tile_list;
  uint tile_slices[];
};

/// Of four pixels of the picture; those beyond it don't matter.
vec4 depths_at(ivec2 pixel) {
  vec4 depths;
  for (int k = 0; k < 4; ++k)
    depths[k] = texelFetch(depth_image, min(pixel + ivec2(k, 0), ivec2(picture.screen.xy) - 1), 0).x;
  return depths;
}

/// Of a depth: what lies no farther than this behind what is seen has a bit. Whether it lies before that the distances
/// along the pixel's ray say (lists.comp.glsl), which round otherwise.
const float kDepthMargin = 1e-4;

uvec4 bits_of(const RowFace face, vec4 x, float y, vec4 depths, uint bit) {
  return mix(uvec4(0), uvec4(bit),
             both(within_edges(face, x, y), greaterThanEqual((1.0 + kDepthMargin) * depths_on(face, x, y), depths)));
}

void main() {
  read_picture();
  const uint place = gl_WorkGroupID.x * kBlocksInGroup + gl_LocalInvocationID.y;
  if (place >= heads[kActiveHead + 3u]) return;
  const uint packed = texelFetch(active_blocks, int(place)).x;
  const uvec2 at = uvec2(packed & 0xffffu, packed >> 16), size = uvec2(picture.screen.xy);
  const uint block = at.y * ((size.x + kBlockPixels - 1u) / kBlockPixels) + at.x;
  const ivec2 pixel = ivec2(at * kBlockPixels + uvec2(0, gl_LocalInvocationID.x));
  const vec4 left_depths = depths_at(pixel), right_depths = depths_at(pixel + ivec2(4, 0));
  const vec4 left = vec4(pixel.x) + vec4(0.5, 1.5, 2.5, 3.5), right = left + 4.0;
  const float y = float(pixel.y) + 0.5;
  const uint count = min(block_counts[block] & ~kBlockIsSeen, of_block);
  uvec4 any = uvec4(0);
  // As in face_blocks.comp.glsl loops are left at their ends.
  for (uint word = 0u; word * kMaskLayers < count;) {
    const uint end = min(count, (word + 1u) * kMaskLayers);
    uvec4 of_left = uvec4(0), of_right = uvec4(0);
    for (uint i = word * kMaskLayers; i < end;) {
      const uint number = texelFetch(block_faces, int(block * of_block + i)).x, bit = 1u << i % kMaskLayers;
      const uvec4 setup = texelFetch(setups, int(kSetupTexels * number));
      const vec4 rectangle = uintBitsToFloat(texelFetch(setups, int(kSetupTexels * number) + 1));
      const RowFace face = row_face(int(interface_axis(setup.x)), setup, rectangle);
      of_left |= bits_of(face, left, y, left_depths, bit);
      of_right |= bits_of(face, right, y, right_depths, bit);
      if (++i >= end) break;
    }
    const uint row = (block * (of_block / kMaskLayers) + word) * kBlockPixels + gl_LocalInvocationID.x;
    masks[2u * row] = of_left;
    masks[2u * row + 1u] = of_right;
    any |= of_left | of_right;
    if (end >= count) break;
    ++word;
  }
  if (!kListedTiles || (any.x | any.y | any.z | any.w) == 0u || pixel.y >= int(size.y)) return;
  if ((atomicOr(block_counts[block], kBlockIsSeen) & kBlockIsSeen) != 0u) return;
  const uint listed = atomicAdd(tile_list.listed, 1u);
  tiles[listed] = listed_tile(at.x, at.y, (count + kMaskLayers - 1u) / kMaskLayers);
  atomicAdd(tile_slices[kSliceWords * (listed / tile_list.slice_groups)], 1u);
}
