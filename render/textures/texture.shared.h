/* A block's texture at a place of a face: how a pyramid of texels is read, for both backends.
 *
 *   albedo = mean albedo (1 + contrast n),   n in [-1, 1], 0 in the mean over all tiles
 * A kind's function (render/textures/<kind>.shared.h) is sampled once into kTextureTiles tiles of 32 x 32 texels a
 * metre; each voxel's face shows one of them, picked by a hash of its place. Each tile has its levels of 16, 8, 4, 2
 * and 1 texel behind it, the means of four each. Beyond, where a pixel holds several voxels, n falls as the mean of
 * independent ones does.
 *
 *   point   the texel at the pixel's middle
 *   mip     the mean over a box of the pixel's footprint: of texels as they are where they are large, so that their
 *           edges stay sharp and don't crawl; between two levels where they are small. Along the longer side of a
 *           footprint, up to texture_anisotropy such boxes
 *   exact   the mean of 8 x 8 places of the footprint, in whichever voxels they lie
 *
 * error   mip against exact: tests/render/textures, and the subject texture_filter
 * source  Lance Williams. Pyramidal Parametrics. 1983; Alan Heirich. Feline, as simplified in McCormack and others.
 *         Feline: Fast Elliptical Lines for Anisotropic Texture Mapping. 1999 */
#ifndef LOAM_RENDER_TEXTURES_TEXTURE_SHARED_H
#define LOAM_RENDER_TEXTURES_TEXTURE_SHARED_H
#include "render/textures/noise.shared.h"

/* Where texels come from: in GLSL a buffer of the shader, in C++ an argument. */
#ifdef __cplusplus
#define TEXTURE_TEXELS const float *texels,
#define TEXTURE_PASS texels,
#define TEXTURE_TEXEL(i) texels[i]
#else
#define TEXTURE_TEXELS
#define TEXTURE_PASS
#ifndef TEXTURE_TEXEL /* a shader says beforehand where they are */
#define TEXTURE_TEXEL(i) 0.0f
#endif
#endif

SHARED_NAMESPACE(render)

SHARED_CONST uint kTextureOff = 0u, kTexturePoint = 1u, kTextureMip = 2u, kTextureExact = 3u;
SHARED_CONST int kTextureSize = 32, kTextureLevels = 6;
SHARED_CONST uint kTextureTiles = 4u;
SHARED_CONST uint kTextureTileTexels = 1365u; /* 32^2 + 16^2 + .. + 1 */

/* Place on a face, 0..1 along a level axis and, on the sides, upwards. */
SHARED vec2 texture_place(int axis, vec3 fraction) {
  return axis == 0   ? vec2(fraction.z, fraction.y)
         : axis == 1 ? vec2(fraction.x, fraction.z)
                     : vec2(fraction.x, fraction.y);
}

/* Of the tile of a voxel's face. Repeats from region to region (128 voxels), so that a world moved by whole regions
 * looks the same. */
SHARED uint texture_tile(int x, int y, int z, uint face) {
  uint place = uint(x & 127) | uint(y & 127) << 7 | uint(z & 127) << 14 | face << 21;
  return (texture_hash(place) >> 7) % kTextureTiles;
}

/* What falls between two points of a pixel's neighbours, in metres on the face's plane: from the pixel's ray, and the
 * rays beside it, through the plane that lies at `hit`. Bounded, since neighbours may miss the plane. */
SHARED vec3 texture_step(vec3 hit, vec3 ray, vec3 to_next, int axis) {
  vec3 next = ray + to_next;
  float t = hit[axis] / ray[axis], along = hit[axis] / next[axis];
  if (!(along > 0.0f && along < 64.0f * t)) along = 64.0f * t;
  return along * next - hit;
}

/* A texel of a level, wrapped. */
SHARED float texture_texel(TEXTURE_TEXELS uint tile, int level, int x, int y) {
  int size = kTextureSize >> level;
  /* Levels follow each other: 4/3 (32^2 - size^2 of this one) texels lie before. */
  uint before = uint((kTextureSize * kTextureSize - size * size) * 4 / 3);
  return TEXTURE_TEXEL(tile + before + uint((y & (size - 1)) * size + (x & (size - 1))));
}

/* The mean of a level over a square of `width` texels of the finest level, at most one of its own. */
SHARED float texture_box(TEXTURE_TEXELS uint tile, int level, vec2 at, float width) {
  float scale = float(kTextureSize >> level), w = clamp(width * scale / float(kTextureSize), 1e-3f, 1.0f);
  vec2 low = at * scale - 0.5f * w, first = floor(low);
  vec2 share = clamp((low + w - first - 1.0f) / w, vec2(0.0f), vec2(1.0f)); /* of the second texel */
  int x = int(first.x), y = int(first.y);
  float a = texture_texel(TEXTURE_PASS tile, level, x, y), b = texture_texel(TEXTURE_PASS tile, level, x + 1, y);
  float c = texture_texel(TEXTURE_PASS tile, level, x, y + 1),
        d = texture_texel(TEXTURE_PASS tile, level, x + 1, y + 1);
  return mix(mix(a, b, share.x), mix(c, d, share.x), share.y);
}

/* Between the two levels whose texels are near `width` texels of the finest wide. */
SHARED float texture_mip(TEXTURE_TEXELS uint tile, vec2 at, float width) {
  float level = log2(max(width, 1.0f));
  int below = int(level);
  if (below >= kTextureLevels - 1) {
    return texture_texel(TEXTURE_PASS tile, kTextureLevels - 1, 0, 0) * (float(kTextureSize) / width);
  }
  float fine = texture_box(TEXTURE_PASS tile, below, at, width);
  if (level <= 0.0f) return fine;
  return mix(fine, texture_box(TEXTURE_PASS tile, below + 1, at, width), level - float(below));
}

/* n of a block whose tiles begin at `first`, at a place of a face; `step_x`, `step_y`: to the next pixels, m. */
SHARED float texture_value(TEXTURE_TEXELS uint first, uint filter_kind, uint anisotropy, ivec3 voxel, uint face,
                           vec2 at, vec2 step_x, vec2 step_y) {
  uint tile = first + texture_tile(voxel.x, voxel.y, voxel.z, face) * kTextureTileTexels;
  float size = float(kTextureSize);
  if (filter_kind == kTexturePoint)
    return texture_texel(TEXTURE_PASS tile, 0, int(floor(at.x * size)), int(floor(at.y * size)));
  if (filter_kind == kTextureExact) {
    int axis = int(face >> 1);
    float sum = 0.0f;
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 8; ++i) {
        vec2 p = at + (float(i) - 3.5f) * 0.125f * step_x + (float(j) - 3.5f) * 0.125f * step_y;
        vec2 over = clamp(floor(p), vec2(-1e6f), vec2(1e6f));
        int u = int(over.x), v = int(over.y);
        ivec3 there = axis == 0   ? ivec3(voxel.x, voxel.y + v, voxel.z + u)
                      : axis == 1 ? ivec3(voxel.x + u, voxel.y, voxel.z + v)
                                  : ivec3(voxel.x + u, voxel.y + v, voxel.z);
        uint other = first + texture_tile(there.x, there.y, there.z, face) * kTextureTileTexels;
        vec2 within = (p - over) * size;
        sum += texture_texel(TEXTURE_PASS other, 0, int(within.x), int(within.y));
      }
    return sum / 64.0f;
  }
  float x2 = dot(step_x, step_x), y2 = dot(step_y, step_y);
  vec2 longer = x2 > y2 ? step_x : step_y;
  float major = sqrt(max(x2, y2)) * size;
  /* The other side's part across the longer one: the parallelogram's area over its longer side. */
  float area = abs(step_x.x * step_y.y - step_x.y * step_y.x) * size * size;
  float minor = major > 0.0f ? area / major : 0.0f;
  float most = float(anisotropy);
  float probes = clamp(ceil(major / max(minor, 1.0f) - 0.25f), 1.0f, most);
  float width = max(major / probes, minor);
  float sum = 0.0f;
  for (float i = 0.0f; i < probes; i += 1.0f)
    sum += texture_mip(TEXTURE_PASS tile, at + longer * ((i + 0.5f) / probes - 0.5f), width);
  return sum / probes;
}

/* The normal of a face that is taken as high where its texture is bright. `slope`: of a value of 1 over a texel. */
SHARED vec3 texture_normal(TEXTURE_TEXELS uint first, uint filter_kind, uint anisotropy, ivec3 voxel, uint face,
                           vec2 at, vec2 step_x, vec2 step_y, float slope) {
  float h = 1.0f / float(kTextureSize);
  vec2 off_u = vec2(h, 0.0f), off_v = vec2(0.0f, h);
  float u = texture_value(TEXTURE_PASS first, filter_kind, anisotropy, voxel, face, at + off_u, step_x, step_y) -
            texture_value(TEXTURE_PASS first, filter_kind, anisotropy, voxel, face, at - off_u, step_x, step_y);
  float v = texture_value(TEXTURE_PASS first, filter_kind, anisotropy, voxel, face, at + off_v, step_x, step_y) -
            texture_value(TEXTURE_PASS first, filter_kind, anisotropy, voxel, face, at - off_v, step_x, step_y);
  int axis = int(face >> 1);
  float out_ = (face & 1u) == 1u ? 1.0f : -1.0f, a = -0.5f * slope * u, b = -0.5f * slope * v;
  return normalize(axis == 0 ? vec3(out_, b, a) : axis == 1 ? vec3(a, out_, b) : vec3(a, b, out_));
}

SHARED_NAMESPACE_END
#endif
