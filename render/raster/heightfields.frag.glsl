#version 460
#extension GL_GOOGLE_include_directive : require
// Which face a pixel sees where a grid of heights covers it: that which its ray meets on the columns near the point of
// the grid, so that the faces' own edges show. The grid's plane, moved to the height of the column there, says which:
// on that or on the one beside it. Where the ray meets neither, the top of the latter, at the point of the grid.
#include "render/raster/heightfields.shared.h"
#include "render/raster/raster.shared.h"

layout(constant_id = kSpecBlends) const bool kBlends = false;
layout(binding = kBindHeightWords) uniform usamplerBuffer height_words;

#include "render/raster/fragment_ray.glsl.h"

layout(location = 0) flat in ivec4 corner;
layout(location = 1) flat in uint first_word;
layout(location = 2) flat in vec4 fraction;
layout(location = 0) out uvec2 seen_out;

/// Columns from the point of the grid that the ray may meet land at.
const float kMostAside = 16.0;

uint column_word(ivec2 column) {
  return texelFetch(height_words, int(first_word) + column.x * kHeightColumns + column.y).x;
}
bool outside(ivec2 column) {
  return any(lessThan(column, ivec2(0))) || any(greaterThanEqual(column, ivec2(kHeightColumns)));
}

void main() {
  const int level = corner.w & int(kChunkLevel);
  const vec3 ray = fragment_ray();
  const float t = fraction.w / gl_FragCoord.z;
  // In cells, from the corner of the surface.
  const float cells = exp2(-float(level));
  const vec3 eye = (fraction.xyz - vec3(corner.xyz)) * cells, along = ray * cells;
  const ivec2 onward = ivec2(along.x < 0.0 ? -1 : 1, along.z < 0.0 ? -1 : 1);
  const vec2 inverse = 1.0 / vec2(abs(along.x) < 1e-12 ? 1e-12 : along.x, abs(along.z) < 1e-12 ? 1e-12 : along.z);
  const ivec2 last = ivec2(kHeightColumns - 1);
  const vec3 point = eye + t * along;
  const ivec2 below = clamp(ivec2(floor(point.xz)), ivec2(0), last);
  // The columns' tops lie about as high over the grid for some way: where the ray meets them so.
  const vec3 normal = cross(dFdx(point), dFdy(point));
  if (kBlends && !chunk_shown(uint(corner.w), floor(gl_FragCoord.xy))) discard;
  const float lower = point.y - float(column_word(below) & 0xffffu) + 0.5;
  const vec2 aside = -lower * normal.y / dot(normal, along) * along.xz;
  const ivec2 column =
      all(lessThan(abs(aside), vec2(kMostAside))) ? clamp(ivec2(floor(point.xz + aside)), ivec2(0), last) : below;
  uint word = column_word(column);
  const float top = float(word & 0xffffu);
  const vec2 enters = (vec2(column + (1 - onward) / 2) - eye.xz) * inverse,
             leaves = (vec2(column + (1 + onward) / 2) - eye.xz) * inverse;
  const float above = eye.y + max(enters.x, enters.y) * along.y, beyond = eye.y + min(leaves.x, leaves.y) * along.y;
  const bool within = above <= top;  // it comes in through a wall
  uint face = 3u;
  int plane = int(word & 0xffffu);
  bool meets = true;
  if (within || beyond > top) {
    // The column before it, or the next one.
    const bool by_x = within ? enters.x > enters.y : leaves.x < leaves.y;
    const ivec2 ahead = by_x ? ivec2(onward.x, 0) : ivec2(0, onward.y);
    const ivec2 other = within ? column - ahead : column + ahead;
    const bool is_none = outside(other);
    const uint other_word = is_none ? 0u : column_word(other);
    const float other_top = float(other_word & 0xffffu);
    if (within ? above > other_top : beyond <= other_top) {
      const ivec2 of = within ? column : other;
      face = by_x ? (onward.x > 0 ? 0u : 1u) : (onward.y > 0 ? 4u : 5u);
      plane = by_x ? of.x + (1 - onward.x) / 2 : of.y + (1 - onward.y) / 2;
      if (!within) word = other_word;
    } else {
      meets = false;
      if (!is_none) word = other_word;
    }
  }
  const uint what = word >> 16 | face << kSeenFaceShift | uint(level) << kSeenLevelShift;
  const uint axis = face >> 1;
  seen_out = meets ? uvec2(what, uint(corner[axis] + (plane << level))) : uvec2(what | kSeenPlaced, floatBitsToUint(t));
}
