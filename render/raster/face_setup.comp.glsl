#version 460
#extension GL_GOOGLE_include_directive : require
// Sets listed faces up, and lists them by block: face_blocks.shared.h.
#include "render/raster/shading/read_picture.glsl.h"
#include "render/raster/face_blocks.glsl.h"

layout(local_size_x = kSetupGroup) in;
layout(push_constant) uniform Range { SetupRange range; };
layout(binding = kBindFaces) uniform usamplerBuffer faces;
layout(binding = kBindChunks) uniform isamplerBuffer chunks;
layout(binding = kBindListedFaces) uniform usamplerBuffer listed_faces;
layout(binding = kBindFaceSetups, std430) writeonly buffer Setups { uvec4 setups[]; };
layout(binding = kBindFaceItems, std430) writeonly buffer Items { uvec4 items[]; };

const bool kExactEdges = true;
#include "render/raster/placed_face.glsl.h"

/// px around the corners' places, for what rounding does to them.
const float kCornerMargin = 1.0 / 16;

/// First and last block that a face may touch; first beyond last: none.
void touched_blocks(const PlacedFace face, out ivec2 first, out ivec2 last) {
  vec2 low = vec2(1e30), high = vec2(-1e30);
  float nearest = 1e30;
  for (int corner = 0; corner < 4; ++corner) {
    vec3 point;
    point[face.axis] = face.offset;
    point[face.u] = (corner & 1) != 0 ? face.high.x : face.low.x;
    point[face.v] = (corner & 2) != 0 ? face.high.y : face.low.y;
    const float depth = dot(picture.clip_w.xyz, point);
    const vec2 at = vec2(dot(picture.clip_x.xyz, point), dot(picture.clip_y.xyz, point)) / depth;
    low = min(low, at);
    high = max(high, at);
    nearest = min(nearest, depth);
  }
  // What isn't wholly before the eye may lie anywhere.
  const bool anywhere = nearest < picture.fraction.w;
  const vec2 size = picture.screen.xy;
  low = anywhere ? vec2(0) : clamp((low * 0.5 + 0.5) * size - kCornerMargin, vec2(-1), size + 1.0);
  high = anywhere ? size : clamp((high * 0.5 + 0.5) * size + kCornerMargin, vec2(-1), size + 1.0);
  // Pixels by their middles.
  const ivec2 first_pixel = max(ivec2(ceil(low - 0.5)), ivec2(0));
  const ivec2 last_pixel = min(ivec2(floor(high - 0.5)), ivec2(size) - 1);
  const bool none = any(lessThan(last_pixel, first_pixel));
  first = none ? ivec2(0) : first_pixel / int(kBlockPixels);
  last = none ? ivec2(-1) : last_pixel / int(kBlockPixels);
}

void main() {
  read_picture();
  const uint i = gl_GlobalInvocationID.x;
  uint count = range.count, number = range.first_face + i;
  if (kSecondFaces) {
    count = heads[kPageHeads + kHeadWords * range.page + 3u];
    for (uint page = 0u; page < range.page; ++page) number += heads[kPageHeads + kHeadWords * page + 3u];
  }
  if (i >= count || number >= range.faces) return;
  const uvec2 listed = texelFetch(listed_faces, int(range.first_listed + i)).xy;
  const uvec2 record = texelFetch(faces, int(listed.x)).xy;
  const ivec4 chunk = texelFetch(chunks, int(listed.y));
  const PlacedFace face = kLayerBlocks ? place_layer(record, chunk) : place_face(record, chunk);
  if (face.away) return;
  const RectangleEdges edges =
      rectangle_edges(face.axis, face.u, face.v, face.offset, vec4(face.low, face.high));
  setups[kSetupTexels * number] = uvec4(face.seen.xy, face.seen.z | edges.on_edge, floatBitsToUint(face.offset));
  setups[kSetupTexels * number + 1u] = floatBitsToUint(vec4(face.low, face.high));

  ivec2 first, last;
  touched_blocks(face, first, last);
  const ivec2 across = last - first + 1;
  const bool small = across.x * across.y <= int(kSmallBlocks);
  const int blocks = small ? across.x * across.y : 0;
  ivec2 at = first;
  for (int k = 0; k < blocks; ++k) {
    if (may_touch(edges, vec2(at) * float(kBlockPixels) + 0.5, float(kBlockPixels)))
      list_in_block(uvec2(at), number, range.of_block);
    if (++at.x > last.x) at = ivec2(first.x, at.y + 1);
  }
  const ivec2 first_bin = first / int(kBinBlocks), last_bin = last / int(kBinBlocks);
  const ivec2 bins_across = last_bin - first_bin + 1;
  const int bins = small ? 0 : bins_across.x * bins_across.y;
  const float side = float(kBinBlocks * kBlockPixels);
  at = first_bin;
  for (int k = 0; k < bins; ++k) {
    if (may_touch(edges, vec2(at) * side + 0.5, side)) {
      const uint place = take_place(kSecondFaces ? kSecondItemsHead : kItemsHead, kItemsInGroup);
      const ivec2 low = max(at * int(kBinBlocks), first), high = min(at * int(kBinBlocks) + int(kBinBlocks) - 1, last);
      if (place < range.items)
        items[place] = uvec4(number, uint(low.x) | uint(low.y) << 16, uint(high.x) | uint(high.y) << 16, 0u);
    }
    if (++at.x > last_bin.x) at = ivec2(first_bin.x, at.y + 1);
  }
}
