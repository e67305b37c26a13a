#version 460
#extension GL_GOOGLE_include_directive : require
// Which clusters, and which of their faces, may be seen past what is drawn so far. Those not drawn yet get their draw
// turned on. Four invocations a cluster: a word of 32 records each.
#include "render/raster/shading/read_picture.glsl.h"
#include "render/extract/face_record.shared.h"
#include "render/raster/face_blocks.shared.h"

layout(local_size_x = 64) in;
layout(constant_id = kSpecListsFaces) const bool kListsFaces = false;
layout(push_constant) uniform Range {
  uint begin, end;          // of candidates: those of one page
  uint first_listed, page;  // of kListsFaces: the page's part of the list
};
layout(binding = kBindFaces) uniform usamplerBuffer faces;
layout(binding = kBindChunks) uniform isamplerBuffer chunks;
layout(binding = kBindTiles) uniform samplerBuffer tiles;
layout(binding = kBindCandidates) uniform usamplerBuffer candidates;
layout(binding = kBindDraws, std430) writeonly buffer Draws { uint draws[]; };  // 5 words: indexCount, instanceCount..
layout(binding = kBindVisible, std430) writeonly buffer Visible { uint visible[]; };
layout(binding = kBindSecondIndices, std430) writeonly buffer Indices { uint indices[]; };
layout(binding = kBindListedFaces, std430) writeonly buffer Listed { uvec2 listed[]; };
layout(binding = kBindFaceHeads, std430) buffer Heads { uint heads[]; };

/// What corners cover on the screen, px, and the least of their view depths.
struct Covered {
  vec2 first, last;
  float nearest;
};
Covered covers_nothing() { return Covered(vec2(1e30), vec2(-1e30), 1e30); }
/// corner: in clip space, x, y and w.
void cover(inout Covered c, vec3 corner) {
  const vec2 at = (corner.xy / corner.z * 0.5 + 0.5) * picture.screen.xy;
  c.first = min(c.first, at);
  c.last = max(c.last, at);
  c.nearest = min(c.nearest, corner.z);
}

const uint kHidden = 0u, kSeen = 1u, kOutside = 2u;  // outside: of the picture

/// Whether some tile of the pixels has something drawn no nearer. margin: px beyond what the corners cover.
uint past_tiles(const Covered c, float margin) {
  const ivec2 size = ivec2(picture.screen.xy), tiles_across = (size + int(kTilePixels) - 1) / int(kTilePixels);
  const vec2 limit = picture.screen.xy + 1.0;
  // The first and the last pixel whose middle lies within.
  const ivec2 low = max(ivec2(ceil(clamp(c.first - margin - 0.5, vec2(-1), limit))), ivec2(0));
  const ivec2 high = min(ivec2(floor(clamp(c.last + margin - 0.5, vec2(-1), limit))), size - 1);
  if (any(lessThan(high, ivec2(0))) || any(greaterThanEqual(low, size))) return kOutside;
  if (any(lessThan(high, low))) return kHidden;
  const ivec2 low_tile = low / int(kTilePixels), high_tile = high / int(kTilePixels);
  // Depth is interpolated with a relative error far below this margin.
  const float depth = picture.fraction.w / c.nearest * 1.001;
  for (int y = low_tile.y; y <= high_tile.y; ++y)
    for (int x = low_tile.x; x <= high_tile.x; ++x)
      if (texelFetch(tiles, y * tiles_across.x + x).r <= depth) return kSeen;
  return kHidden;
}

vec3 clip_of(vec3 place) {
  return vec3(dot(picture.clip_x.xyz, place), dot(picture.clip_y.xyz, place), dot(picture.clip_w.xyz, place));
}

/// Conservative: never hides a box of which a pixel could show anything.
bool box_may_be_seen(vec3 low, vec3 high) {
  Covered covered = covers_nothing();
  for (int i = 0; i < 8; ++i) {
    const vec3 corner = clip_of(mix(low, high, bvec3((i & 1) != 0, (i & 2) != 0, (i & 4) != 0)));
    if (corner.z < picture.fraction.w) return true;
    cover(covered, corner);
  }
  return past_tiles(covered, 1.0) == kSeen;
}

/// m: faces nearer than that count as seen, and with planes nearer than that as facing the camera, so that rounding stays
/// below the margins.
const float kNearFace = 0.5, kNearPlane = 0.01;
const float kFaceMargin = 1.0 / 16;

/// Conservative too.
uint face_seen(uvec2 record, ivec4 chunk) {
  if (face_is_part(record.x)) return kSeen;  // it lies within its voxel
  const uint face = face_direction(record.y);
  const int axis = int(face >> 1), u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
  const int level = chunk.w & int(kChunkLevel);
  ivec3 voxel = chunk.xyz + (ivec3(face_voxel(record.x)) << level);
  voxel[axis] += int(face & 1u) << level;
  const vec3 low = vec3(voxel) - picture.fraction.xyz;
  const float offset = low[axis];
  if ((face & 1u) == 1u ? offset > kNearPlane : offset < -kNearPlane) return kHidden;  // looks away
  const float width = float(int(face_width(record.x)) << level), height = float(int(face_height(record.x)) << level);
  // All of it beyond the view distance is sky.
  const vec2 aside = clamp(vec2(0), vec2(low[u], low[v]), vec2(low[u] + width, low[v] + height));
  if (dot(aside, aside) + offset * offset > picture.sun.w * picture.sun.w * 1.0001 + 1.0) return kHidden;
  const vec3 corner = clip_of(low);
  const vec3 along_u = width * vec3(picture.clip_x[u], picture.clip_y[u], picture.clip_w[u]);
  const vec3 along_v = height * vec3(picture.clip_x[v], picture.clip_y[v], picture.clip_w[v]);
  const float nearest = corner.z + min(along_u.z, 0.0) + min(along_v.z, 0.0);
  if (nearest < max(picture.fraction.w, kNearFace)) return kSeen;
  Covered covered = covers_nothing();
  cover(covered, corner);
  cover(covered, corner + along_u);
  cover(covered, corner + along_v);
  cover(covered, corner + along_u + along_v);
  return past_tiles(covered, kFaceMargin);
}

shared uint fresh_of[64];  // records of each word that the second pass draws

void list_faces(uint fresh, uint first_record, uint chunk) {
  if (fresh == 0u) return;
  const uint head = kPageHeads + kHeadWords * page, some = uint(bitCount(fresh));
  uint at = atomicAdd(heads[head + 3u], some);
  atomicMax(heads[head], min((at + some + kSetupGroup - 1u) / kSetupGroup, kMostGroups));
  for (; fresh != 0u; fresh &= fresh - 1u)
    listed[first_listed + at++] = uvec2(first_record + uint(findLSB(fresh)), chunk);
}

void main() {
  read_picture();
  const uint i = begin + (gl_GlobalInvocationID.x >> 2), word = gl_LocalInvocationID.x & 3u;
  uint seen = 0u, fresh = 0u;
  uvec4 rest = uvec4(0);  // first, count, room, by_face
  int draw = -1, chunk_of = 0;
  if (i < end) {
    const int at = 4 * int(i);
    const ivec4 low = ivec4(texelFetch(candidates, at)), high = ivec4(texelFetch(candidates, at + 1));
    rest = texelFetch(candidates, at + 3);
    draw = low.w, chunk_of = high.w;
    const uint drawn = texelFetch(candidates, at + 2)[word], records = min(rest.y - min(rest.y, 32u * word), 32u);
    if (box_may_be_seen(vec3(low.xyz) - picture.fraction.xyz, vec3(high.xyz) - picture.fraction.xyz)) {
      if (rest.w == 0u) {
        seen = ~0u;
      } else {
        const ivec4 chunk = texelFetch(chunks, high.w);
        for (uint r = 0u; r < records; ++r) {
          const uint says = face_seen(texelFetch(faces, int(rest.x + 32u * word + r)).xy, chunk);
          // What lies outside of the picture isn't looked at, and stays as it was.
          seen |= (says == kOutside ? drawn >> r & 1u : says) << r;
        }
      }
    }
    visible[4u * i + word] = seen;
    fresh = seen & ~drawn;
  }
  if (kListsFaces) {
    list_faces(fresh, rest.x + 32u * word, uint(chunk_of));
    return;
  }
  fresh_of[gl_LocalInvocationID.x] = uint(bitCount(fresh));
  barrier();
  if (draw < 0) return;
  if (rest.w == 0u) {
    if (word == 0u) draws[5u * uint(draw) + 1u] = seen != 0u ? 1u : 0u;
    return;
  }
  const uint first_word = gl_LocalInvocationID.x & ~3u;
  uint before = 0u, all = 0u;
  for (uint w = 0u; w < 4u; ++w) {
    if (w == word) before = all;
    all += fresh_of[first_word + w];
  }
  if (word == 0u && all > 0u) {
    draws[5u * uint(draw)] = 6u * all;
    draws[5u * uint(draw) + 1u] = 1u;
  }
  uint at = 6u * (rest.z + before);
  for (; fresh != 0u; fresh &= fresh - 1u, at += 6u) {
    const uint corner = 4u * (rest.x + 32u * word + uint(findLSB(fresh)));
    indices[at] = corner;
    indices[at + 1u] = corner + 1u;
    indices[at + 2u] = corner + 2u;
    indices[at + 3u] = corner + 2u;
    indices[at + 4u] = corner + 1u;
    indices[at + 5u] = corner + 3u;
  }
}
