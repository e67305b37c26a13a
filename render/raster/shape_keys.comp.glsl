#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require
// Which face of a small shape each pixel sees, and how far: small_shapes.shared.h. By its own ray, as
// shape_points.frag.glsl does.
#include "render/raster/shading/read_picture.glsl.h"
#include "render/raster/small_shapes.shared.h"
#include "render/raster/shape_quads.glsl.h"

layout(constant_id = kSpecBlends) const bool kBlends = false;
layout(constant_id = kSpecShapeTile) const uint kTile = 3u;
layout(local_size_x = kShapesInGroup) in;
layout(push_constant) uniform Range { ShapeRange told; };
layout(binding = kBindFaces) uniform usamplerBuffer faces;
layout(binding = kBindChunks) uniform isamplerBuffer chunks;
layout(binding = kBindListedShapes) uniform usamplerBuffer listed_shapes;
layout(binding = kBindShapeKeys, std430) buffer Keys { uint64_t keys[]; };
layout(binding = kBindShapeSetups, std430) writeonly buffer Setups { uvec2 setups[]; };
layout(binding = kBindTouchedBlocks, std430) writeonly buffer Touched { uint touched[]; };

#include "render/raster/placed_shape.glsl.h"

ShapeRange range;  // as `picture`: read first

vec3 pixel_ray(ivec2 pixel) {
  const vec2 middle = vec2(pixel) + 0.5;
  return picture.corner.xyz + middle.x * picture.step_x.xyz + middle.y * picture.step_y.xyz;
}

void keep(float t, uint face, uint shape, const PlacedShape placed, ivec2 pixel, ivec2 last) {
  const bool shown = !kBlends || chunk_shown(placed.detail, vec2(pixel));
  if (face != kNoQuad && shown && pixel.x <= last.x && pixel.y <= last.y) {
    const float depth = picture.fraction.w / (t * dot(picture.clip_w.xyz, pixel_ray(pixel)));
    const uint order = ~(shape << kShapeFaceBits | face);
    const uint bits = floatBitsToUint(min(depth, 1.0));
    atomicMax(keys[uint(pixel.y) * range.row_pixels + uint(pixel.x)], packUint2x32(uvec2(order, bits)));
  }
}

void main() {
  read_picture();
  range = told;
  if (gl_GlobalInvocationID.x >= range.count) return;
  const uint shape = range.first + gl_GlobalInvocationID.x;
  const uvec2 listed = texelFetch(listed_shapes, int(shape)).xy;
  const PlacedShape placed = place_shape(texelFetch(faces, int(listed.x)).xy, listed.y);
  setups[shape] = uvec2(placed.first, placed.place);

  // Pixels by their middles.
  const vec2 size = picture.screen.xy;
  const ivec2 first = max(ivec2(ceil((placed.least * 0.5 + 0.5) * size - 0.5 - kRim)), ivec2(0));
  const ivec2 last = min(ivec2(floor((placed.most * 0.5 + 0.5) * size - 0.5 + kRim)), ivec2(size) - 1);
  const bool none = placed.faces == 0u || any(lessThan(last, first));
  const int tile = int(kTile);
  const ivec2 across = none ? ivec2(0) : (last - first) / tile + 1;
  ivec2 pixel = first;
  for (int k = 0; k < across.x * across.y; ++k) {
    // Of each pixel which face of the shape it sees, and where along its ray.
    float nearest[kTile * kTile];
    uint seen[kTile * kTile];
    for (int i = 0; i < tile * tile; ++i) nearest[i] = 1e30, seen[i] = kNoQuad;
    for (uint number = 0u; number < placed.faces; ++number) {
      const ShapeFace face = shape_face(placed.first + number);
      for (int i = 0; i < tile * tile; ++i) {
        const float met = meet(face, placed.voxel, pixel_ray(pixel + ivec2(i % tile, i / tile)));
        const bool nearer = met > 0.0 && met < nearest[i];
        nearest[i] = nearer ? met : nearest[i];
        seen[i] = nearer ? number : seen[i];
      }
    }
    for (int i = 0; i < tile * tile; ++i)
      keep(nearest[i], seen[i], shape, placed, pixel + ivec2(i % tile, i / tile), last);
    pixel.x += tile;
    if (pixel.x > last.x) pixel = ivec2(first.x, pixel.y + tile);
  }

  const ivec2 first_block = first / int(kBlockPixels), last_block = last / int(kBlockPixels);
  const ivec2 blocks = none ? ivec2(0) : last_block - first_block + 1;
  ivec2 block = first_block;
  for (int k = 0; k < blocks.x * blocks.y; ++k) {
    touched[uint(block.y) * (range.row_pixels / kBlockPixels) + uint(block.x)] = 1u;  // all write the same
    if (++block.x > last_block.x) block = ivec2(first_block.x, block.y + 1);
  }
}
