#version 460
#extension GL_GOOGLE_include_directive : require
// Which of its listed faces each pixel of a block sees: face_blocks.shared.h. Each invocation has a row of eight pixels,
// in two vectors, so that what a face brings is read once for 64 pixels.
#include "render/raster/shading/read_picture.glsl.h"
#include "render/raster/face_blocks.shared.h"
#define EDGES_OF_FACES
#include "render/raster/rectangle_edges.glsl.h"
#include "render/raster/block_rows.glsl.h"

layout(constant_id = kSpecSecondFaces) const bool kSecondFaces = false;
layout(constant_id = kSpecBlends) const bool kBlends = false;
layout(local_size_x = kBlockPixels, local_size_y = kBlocksInGroup) in;
layout(push_constant) uniform Room { uint of_block, row_pixels, seen_row_pixels, run_stride; };
layout(binding = kBindFaceSetups) uniform usamplerBuffer setups;
layout(binding = kBindBlockFaces) uniform usamplerBuffer block_faces;
layout(binding = kBindBlockCounts) uniform usamplerBuffer block_counts;
layout(binding = kBindFaceHeads, std430) readonly buffer Heads { uint heads[]; };
layout(binding = kBindActiveBlocks) uniform usamplerBuffer active_blocks;
layout(binding = kBindBlockDepths, std430) buffer Depths { vec4 depths[]; };
layout(binding = kBindTiles, std430) buffer Tiles { uint tiles[]; };
layout(binding = kBindSeenRows, std430) buffer SeenRows { uvec4 seen_rows[]; };

/// And what a pixel that sees it sees.
struct Face {
  RowFace rows;
  uint detail;
  uvec2 seen;
};

/// Four pixels of a row.
struct Four {
  vec4 x;             // of their middles
  vec4 depth;         // reversed, 0: nothing
  uvec4 seen, plane;  // as seen_image
  vec4 threshold;     // of blends, in 255ths
};

void draw(inout Four four, float y, const Face face) {
  bvec4 shown = within_edges(face.rows, four.x, y);
  const vec4 depth = depths_on(face.rows, four.x, y);
  shown = both(shown, either(greaterThan(depth, four.depth),
                             both(equal(depth, four.depth), greaterThan(uvec4(face.seen.x), four.seen))));
  if (kBlends)
    shown = both(shown, both(lessThan(four.threshold, vec4(face.detail >> kChunkOwnShift & 255u)),
                             greaterThanEqual(four.threshold, vec4(face.detail >> kChunkNextShift & 255u))));
  four.depth = mix(four.depth, depth, shown);
  four.seen = mix(four.seen, uvec4(face.seen.x), shown);
  four.plane = mix(four.plane, uvec4(face.seen.y), shown);
}

uint depths_at(uvec2 pixel) { return (pixel.y * row_pixels + pixel.x) / 4u; }
uint seen_at(uvec2 pixel) { return (pixel.y * seen_row_pixels + pixel.x) / 2u; }

Four four_at(uvec2 pixel) {
  Four four = Four(vec4(pixel.x) + vec4(0.5, 1.5, 2.5, 3.5), vec4(0), uvec4(0), uvec4(0), vec4(0));
  if (kBlends)
    for (uint k = 0u; k < 4u; ++k) four.threshold[k] = blend_threshold(vec2(pixel.x + k, pixel.y)) * 255.0;
  if (kSecondFaces) {
    four.depth = depths[depths_at(pixel)];
    const uvec4 low = seen_rows[seen_at(pixel)], high = seen_rows[seen_at(pixel) + 1u];
    four.seen = uvec4(low.xz, high.xz);
    four.plane = uvec4(low.yw, high.yw);
  }
  return four;
}

void keep(const Four four, uvec2 pixel) {
  depths[depths_at(pixel)] = min(four.depth, vec4(1));
  seen_rows[seen_at(pixel)] = uvec4(four.seen.x, four.plane.x, four.seen.y, four.plane.y);
  seen_rows[seen_at(pixel) + 1u] = uvec4(four.seen.z, four.plane.z, four.seen.w, four.plane.w);
}

float least_of(vec4 v) { return min(min(v.x, v.y), min(v.z, v.w)); }

Face face_of(uint number) {
  const uvec4 setup = texelFetch(setups, int(kSetupTexels * number));
  const vec4 rectangle = uintBitsToFloat(texelFetch(setups, int(kSetupTexels * number) + 1));
  return Face(row_face(int(seen_face(setup.x)) >> 1, setup, rectangle), setup.z, setup.xy);
}

void main() {
  read_picture();
  const uvec2 size = uvec2(picture.screen.xy), across = (size + kBlockPixels - 1u) / kBlockPixels;
  uvec2 group = gl_WorkGroupID.xy;
  if (!kSecondFaces) {
    const uvec2 groups = gl_NumWorkGroups.xy;
    uint place = group.y * groups.x + group.x;
    const uint runs = groups.x * groups.y / kGroupsInRun, run = place / kGroupsInRun;
    if (run < runs) place = run * run_stride % runs * kGroupsInRun + place % kGroupsInRun;
    group = uvec2(place % groups.x, place / groups.x);
  }
  uvec2 at = uvec2(group.x * kBlocksInGroup + gl_LocalInvocationID.y, group.y);
  if (kSecondFaces) {
    if (at.x >= heads[kActiveHead + 3u]) return;
    const uint packed = texelFetch(active_blocks, int(at.x)).x;
    at = uvec2(packed & 0xffffu, packed >> 16);
  } else if (at.x >= across.x) {
    return;
  }
  const uint block = at.y * across.x + at.x;
  const uvec2 pixel = at * kBlockPixels + uvec2(0, gl_LocalInvocationID.x);
  if (pixel.y >= size.y) return;
  Four left = four_at(pixel), right = four_at(pixel + uvec2(4, 0));
  const float y = float(pixel.y) + 0.5;
  const uint count = min(texelFetch(block_counts, int(block)).x, of_block);
  // Left at its end: software runs a loop's body to the end once more after a `break` before that. All of a block's rows
  // leave it at once.
  if (count > 0u)
    for (uint i = 0u;;) {
      const Face face = face_of(texelFetch(block_faces, int(block * of_block + i)).x);
      draw(left, y, face);
      draw(right, y, face);
      if (++i >= count) break;
    }
  keep(left, pixel);
  keep(right, pixel + uvec2(4, 0));
  if (!kSecondFaces) {
    // Pixels outside of the picture hide nothing and show nothing. Of numbers no less than 0 the bits have their order.
    const vec4 of_left = mix(vec4(1), left.depth, lessThan(left.x, vec4(size.x)));
    const vec4 of_right = mix(vec4(1), right.depth, lessThan(right.x, vec4(size.x)));
    const uint farthest = floatBitsToUint(min(least_of(of_left), least_of(of_right)));
    atomicMin(tiles[block], farthest);
  }
}
