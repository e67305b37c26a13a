#version 460
#extension GL_GOOGLE_include_directive : require
// Lists items, faces by bin, in those blocks of the bin that they touch: face_blocks.shared.h.
#include "render/raster/shading/read_picture.glsl.h"
#include "render/raster/face_blocks.glsl.h"

layout(local_size_x = kBinBlocks, local_size_y = kItemsInGroup) in;
layout(push_constant) uniform Room { uint items, of_block; };
layout(binding = kBindFaceSetups) uniform usamplerBuffer setups;
layout(binding = kBindFaceItems) uniform usamplerBuffer face_items;

void main() {
  read_picture();
  const uint listed = min(heads[(kSecondFaces ? kSecondItemsHead : kItemsHead) + 3u], items);
  for (uint place = gl_WorkGroupID.x * kItemsInGroup + gl_LocalInvocationID.y; place < listed;
       place += gl_NumWorkGroups.x * kItemsInGroup) {
    const uvec4 item = texelFetch(face_items, int(place));
    const uvec2 low = uvec2(item.y & 0xffffu, item.y >> 16), high = uvec2(item.z & 0xffffu, item.z >> 16);
    const uvec4 face = texelFetch(setups, int(kSetupTexels * item.x));
    const int axis = int(kLayerBlocks ? interface_axis(face.x) : seen_face(face.x) >> 1);
    const int u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
    const RectangleEdges edges = rectangle_edges(axis, u, v, uintBitsToFloat(face.w),
                                                 uintBitsToFloat(texelFetch(setups, int(kSetupTexels * item.x) + 1)));
    uvec2 block = uvec2(low.x + gl_LocalInvocationID.x, low.y);
    for (; block.y <= high.y; ++block.y)
      if (block.x <= high.x && may_touch(edges, vec2(block) * float(kBlockPixels) + 0.5, float(kBlockPixels)))
        list_in_block(block, item.x, of_block);
  }
}
