#version 460
#extension GL_GOOGLE_include_directive : require
// Lists the blocks that small shapes touch: small_shapes.shared.h.
#include "render/raster/small_shapes.shared.h"

layout(local_size_x = kMarksInGroup) in;
layout(push_constant) uniform Blocks { uint blocks, across; };
layout(binding = kBindTouchedBlocks, std430) buffer Touched { uint touched[]; };
layout(binding = kBindShapeHead, std430) buffer Head { uint head[]; };
layout(binding = kBindShapeBlocks, std430) writeonly buffer Listed { uint listed[]; };

void main() {
  const uint block = gl_GlobalInvocationID.x;
  if (block >= blocks || touched[block] == 0u) return;
  touched[block] = 0u;  // for the next picture
  const uint place = atomicAdd(head[3], 1u);
  atomicMax(head[0], place / kBlocksInGroup + 1u);
  listed[place] = block % across | block / across << 16;
}
