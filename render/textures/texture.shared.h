/* A block's texture at a place of a face: how a pyramid of texels is read, for both backends.
 *
 *   albedo = mean albedo (1 + contrast n),   n in [-1, 1], 0 in the mean over all tiles
 * A kind's function (render/textures/<kind>.shared.h) is sampled once into kTextureTiles tiles of 32 x 32 texels a
 * metre; each voxel's face shows one of them, picked by a hash of its place. Each tile has its levels of 16, 8, 4, 2
 * and 1 texel behind it, the means of four each. Beyond, where a pixel holds several voxels, n falls as the mean of
 * independent ones does.
 *
 *   point   the texel at the pixel's middle
 *   mip     the mean over probes along the longer side of the pixel's footprint, each a square as wide as they lie
 * apart, or as the shorter side, in the tile of the voxel that it falls into. A square's mean is over texels of the
 *           coarsest level whose texels are hardly wider, one of them wide at most: texels that are larger than a pixel
 * keep their edges, which don't crawl. At most texture_anisotropy probes exact   the mean of 8 x 8 places of the
 * footprint, in whichever voxels they lie
 *
 * A probe is one read: a word holds a texel and those beside, above and across it, wrapped, a byte each, in which -127
 * to 127 are n from -1 to 1. Between two levels, as trilinear filters read, there would be two, and the picture would
 * be further from the mean.
 *
 * error   mip against exact: tests/render/textures, and the subject texture_filter
 * source  Lance Williams. Pyramidal Parametrics. 1983; Alan Heirich. Feline, as simplified in McCormack and others.
 *         Feline: Fast Elliptical Lines for Anisotropic Texture Mapping. 1999 */
#ifndef LOAM_RENDER_TEXTURES_TEXTURE_SHARED_H
#define LOAM_RENDER_TEXTURES_TEXTURE_SHARED_H
#include "render/textures/noise.shared.h"

/* Where texels come from: in GLSL a buffer of the shader, in C++ an argument. */
#ifdef __cplusplus
#define TEXTURE_TEXELS const uint *texels,
#define TEXTURE_PASS texels,
#define TEXTURE_FOUR(i) texture_unpacked(texels[i])
#else
#define TEXTURE_TEXELS
#define TEXTURE_PASS
#ifndef TEXTURE_FOUR /* a shader says beforehand where they are */
#define TEXTURE_FOUR(i) vec4(0.0f)
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

/* From what a pixel sees at `hit` to what the next one does, in metres on the face's plane: the derivative of where its
 * ray meets it, so that one division serves both sides of a pixel. */
SHARED vec3 texture_step(vec3 hit, vec3 ray, vec3 to_next, int axis) {
  float inverse = 1.0f / ray[axis];
  return hit[axis] * inverse * (to_next - to_next[axis] * inverse * ray);
}

#ifdef __cplusplus
/* As a device reads four signed normalized bytes. */
inline vec4 texture_unpacked(uint word) {
  vec4 four;
  for (int i = 0; i < 4; ++i) four[i] = float(int8_t(word >> (8 * i))) / 127.0f;
  return four;
}
#endif

/* A texel of a level, wrapped, and those beside, above and across it. */
SHARED vec4 texture_four(TEXTURE_TEXELS uint tile, int level, int x, int y) {
  int size = kTextureSize >> level;
  /* Levels follow each other: 4/3 (32^2 - size^2 of this one) texels lie before. */
  uint before = uint((kTextureSize * kTextureSize - size * size) * 4 / 3);
  return TEXTURE_FOUR(tile + before + uint((y & (size - 1)) * size + (x & (size - 1))));
}

/* The mean of a level over a square of `width` texels of the finest level, at most one of its own. */
SHARED float texture_box(TEXTURE_TEXELS uint tile, int level, vec2 at, float width) {
  float scale = float(kTextureSize >> level), w = clamp(width * scale / float(kTextureSize), 1e-3f, 1.0f);
  vec2 low = at * scale - 0.5f * w, first = floor(low);
  vec2 share = clamp((low + w - first - 1.0f) / w, vec2(0.0f), vec2(1.0f)); /* of the second texel */
  vec4 four = texture_four(TEXTURE_PASS tile, level, int(first.x), int(first.y));
  return mix(mix(four.x, four.y, share.x), mix(four.z, four.w, share.x), share.y);
}

/* The tile that is shown at a place of a face's plane, which may lie beyond the voxel, and where in it. */
struct TexturePoint {
  uint tile;
  vec2 at;
};
SHARED TexturePoint texture_point(uint first, ivec3 voxel, uint face, vec2 at) {
  vec2 over = clamp(floor(at), vec2(-1e6f), vec2(1e6f));
  int axis = int(face >> 1), u = int(over.x), v = int(over.y);
  ivec3 there = axis == 0   ? ivec3(voxel.x, voxel.y + v, voxel.z + u)
                : axis == 1 ? ivec3(voxel.x + u, voxel.y, voxel.z + v)
                            : ivec3(voxel.x + u, voxel.y + v, voxel.z);
  TexturePoint point;
  point.tile = first + texture_tile(there.x, there.y, there.z, face) * kTextureTileTexels;
  point.at = at - over;
  return point;
}

/* n of a block whose tiles begin at `first`, at a place of a face; `step_x`, `step_y`: to the next pixels, m. */
SHARED float texture_value(TEXTURE_TEXELS uint first, uint filter_kind, uint anisotropy, ivec3 voxel, uint face,
                           vec2 at, vec2 step_x, vec2 step_y) {
  float size = float(kTextureSize);
  if (filter_kind == kTexturePoint) {
    uint tile = first + texture_tile(voxel.x, voxel.y, voxel.z, face) * kTextureTileTexels;
    return texture_four(TEXTURE_PASS tile, 0, int(floor(at.x * size)), int(floor(at.y * size))).x;
  }
  if (filter_kind == kTextureExact) {
    float sum = 0.0f;
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 8; ++i) {
        vec2 p = at + (float(i) - 3.5f) * 0.125f * step_x + (float(j) - 3.5f) * 0.125f * step_y;
        TexturePoint q = texture_point(first, voxel, face, p);
        sum += texture_four(TEXTURE_PASS q.tile, 0, int(q.at.x * size), int(q.at.y * size)).x;
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
  /* The next level from 1.8 texels of a level on: from there its squares, too wide, err less than this one's, too
   * narrow. */
  int level = min(int(log2(max(1.1f * width, 1.0f))), kTextureLevels - 1);
  float sum = 0.0f;
  for (float i = 0.0f; i < probes; i += 1.0f) {
    TexturePoint p = texture_point(first, voxel, face, at + longer * ((i + 0.5f) / probes - 0.5f));
    sum += texture_box(TEXTURE_PASS p.tile, level, p.at, width);
  }
  return sum / probes * min(size / width, 1.0f);
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
