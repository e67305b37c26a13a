#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Puts the layers of each pixel in order and adds them to what was seen behind them. The order is that of (t, axis), as
// a ray crosses the planes of the grid; the next in order is sought anew each time, so that lists may be of any length
// and no pixel needs room of its own.
#define PICTURE_READ_FIRST
#include "render/raster/face_blocks.shared.h"
#include "render/raster/reflection.glsl.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = kSpecCoveragePattern) const uint kCoveragePattern = 0u;
layout(binding = kBindColour, rgba32f) uniform image2D colour_image;
layout(binding = kBindLayerHeads, r32ui) uniform uimage2D heads;
layout(binding = kBindLayerNodes) uniform usamplerBuffer nodes;
layout(binding = kBindLayerOwnNodes) uniform utexture2D own_nodes;
layout(constant_id = kSpecListedTiles) const bool kListedTiles = false;
layout(binding = kBindLayerTiles) uniform usamplerBuffer tiles;
layout(push_constant) uniform Slice {
  uvec2 first_group;  // x: of the listed tiles
  uint of_block;      // kSpecLayerBlocks: layers that there is room for in each
};
layout(constant_id = kSpecLayerBlocks) const bool kLayerBlocks = false;
layout(binding = kBindLayerMasks) uniform usamplerBuffer layer_masks;
layout(binding = kBindBlockCounts) uniform usamplerBuffer block_counts;
layout(binding = kBindBlockFaces) uniform usamplerBuffer block_faces;
layout(binding = kBindFaceSetups) uniform usamplerBuffer setups;

uvec2 own_node = uvec2(0);  // of the pixel
/// Of a node the node before it (0: none), the interface and its plane.
uvec3 node_at(uint node) {
  const uvec3 further = texelFetch(nodes, int(node - kFirstNode)).xyz;
  return node == kOwnNode ? uvec3(0u, own_node) : further;
}

/// What a pixel's layers are found by.
struct PixelLayers {
  uint head;                     // of its list, 0: it has none; or of its block:
  uint words;                    // of masks
  uint first_mask, first_layer;  // places of the pixel's first word, and in the list
};
/// words: of the tile, where it is listed.
PixelLayers layers_of_block(ivec2 pixel, uint words) {
  const uint across = (uint(picture.screen.x) + kBlockPixels - 1u) / kBlockPixels;
  const uvec2 at = uvec2(pixel) / kBlockPixels, within = uvec2(pixel) % kBlockPixels;
  const uint block = at.y * across + at.x, room = of_block / kMaskLayers;
  PixelLayers layers;
  layers.head = 0u;
  layers.words =
      kListedTiles ? words
                   : (min(texelFetch(block_counts, int(block)).x, of_block) + kMaskLayers - 1u) / kMaskLayers;
  layers.first_mask = (block * room * kBlockPixels + within.y) * kBlockPixels + within.x;
  layers.first_layer = block * of_block;
  return layers;
}

/// Of those beyond `last` and before t_end the nearest, in the order of (t, axis), and how many there are.
struct NextLayer {
  vec2 order;
  uvec2 of;  // packed interface, plane
  uint left;
};
bool before(vec2 a, vec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); }
void consider(inout NextLayer next, uvec2 of, vec2 last, float t_end, vec3 ray) {
  const uint axis = interface_axis(of.x);
  const vec2 order = vec2(level_plane_t(axis, int(of.y), interface_level(of.x), ray), float(axis));
  if (!before(last, order) || order.x >= t_end) return;
  ++next.left;
  if (before(order, next.order)) next.order = order, next.of = of;
}

/// Loops have two ways out. Software runs a loop's body to its end for all of some pixels, and then once more unless all
/// leave it there; but where that is the only way out, those that leave it before others don't keep what they found (Mesa
/// 22.3.6).
NextLayer next_layer(PixelLayers layers, vec2 last, float t_end, vec3 ray) {
  NextLayer next = NextLayer(vec2(t_end, 0), uvec2(0), 0u);
  if (kLayerBlocks) {
    for (uint word = 0u; word < layers.words;) {
      uint bits = texelFetch(layer_masks, int(layers.first_mask + kBlockPixels * kBlockPixels * word)).x;
      for (; bits != 0u;) {
        const uint at = layers.first_layer + kMaskLayers * word + uint(findLSB(bits));
        const uint layer = texelFetch(block_faces, int(at)).x;
        consider(next, texelFetch(setups, int(kSetupTexels * layer)).xy, last, t_end, ray);
        bits &= bits - 1u;
        if (bits == 0u) break;
      }
      if (++word >= layers.words) break;
    }
    return next;
  }
  for (uint node = layers.head; node != 0u;) {
    const uvec3 at = node_at(node);
    consider(next, at.yz, last, t_end, ray);
    node = at.x;
    if (node == 0u) break;
  }
  return next;
}

/// The first layer that bends a ray, and where the ray goes on straight behind the next one.
struct Bend {
  bool found, left;
  vec3 at, direction;  // relative to the camera; unit
  float t_in, t_out;   // m
};

void main() {
  read_picture();
  ivec2 pixel = ivec2(8u * first_group + gl_GlobalInvocationID.xy);
  uint words = 0u;
  if (kListedTiles) {
    const uint tile = texelFetch(tiles, int(first_group.x + gl_WorkGroupID.x)).r;
    const uint side = (1u << kTileBits) - 1u;
    pixel = 8 * ivec2(tile & side, tile >> kTileBits & side) + ivec2(gl_LocalInvocationID.xy);
    words = tile >> 2u * kTileBits;
  }
  if (any(greaterThanEqual(pixel, ivec2(picture.screen.xy)))) return;
  PixelLayers of_pixel;
  if (kLayerBlocks) {
    of_pixel = layers_of_block(pixel, words);
  } else {
    of_pixel.head = imageLoad(heads, pixel).x;
    // The next picture finds it empty.
    if (of_pixel.head != 0u) imageStore(heads, pixel, uvec4(0));
    if (of_pixel.head != 0u) own_node = texelFetch(own_nodes, pixel, 0).xy;
  }
  const uvec2 seen = texelFetch(seen_image, pixel, 0).xy;
  bool mirror = kReflection != kReflectionNone && seen.x != 0u && (seen.x & kSeenNoFace) == 0u &&
                (code_properties(seen_block(seen.x)) & 1u) != 0u;
  const bool in_absorber = eye_absorption().xyz != vec3(0);
  if (!kLayerBlocks && of_pixel.head == 0u && !mirror && !in_absorber) return;
  if (kFogShafts) fog_shift = fog_shaft_shift(float(pixel.x), float(pixel.y));
  const vec3 ray = pixel_ray(vec2(pixel) + 0.5);
  const float inverse_length = inversesqrt(dot(ray, ray)), metres = dot(ray, ray) * inverse_length;
  const vec3 direction = ray * inverse_length;
  float t_end = min(picture.sun.w * inverse_length, seen_t(seen, ray));
  const float on_body = body_t(pixel, t_end);
  mirror = mirror && on_body == t_end;
  t_end = on_body;

  StraightView view = start_of_view();
  const uint eye = kEyeInAir ? 0u : uint(layers.eye.x);
  uint medium = eye;
  SeeThroughBlock last_block;  // of that kind, what it absorbs
  last_block.absorption = eye_absorption();
  bool any = false;
  vec2 last = vec2(0, -1);
  Bend bend;
  bend.found = bend.left = false;
  VeilWalk veil = begin_pixel_veil(seen, ray, direction);
  for (uint left = ~0u; left != 0u;) {
    const NextLayer next = next_layer(of_pixel, last, t_end, ray);
    left = next.left;
    if (left == 0u) break;
    any = true;
    last = next.order;
    const Interface i = interface_of(next.of.x, int(next.of.y), ray);
    const SeeThroughBlock owner = layer_block(i.owner);
    const InterfaceShares shares = shares_of(i, direction);
    const vec3 matte = kLayerMatte && shares.matte > 0.0 ? matte_radiance(i, ray, direction) : vec3(0);
    vec3 mirrored = vec3(0);
    if (shares.mirrored != vec3(0)) {
      // Within glass the mirrored ray leaves by the way it came: it sees the sky, or what lies there.
      const vec3 worth = view.through * shares.mirrored;
      if (kReflection != kReflectionNone && max(worth.x, max(worth.y, worth.z)) > kLeastMirrored &&
          (i.outside || i.near == eye))
        mirrored = mirrored_radiance(
            i.t * ray,
            turned_back(face_point(uint(owner.block.x), i.face, i.t * ray + picture.fraction.xyz, i.plane, -direction),
                        i, direction),
            i.plane, direction, i.near);
      else
        mirrored = mirrored_sky(i.t * ray + picture.fraction.xyz, mirrored_direction(i, direction));
    }
    uint mask = 0u;
    if (kCoveragePattern != kCoverageExact && owner.matte.w == float(kSeeThroughCoverage)) {
      // The voxel entered, and the face, as StraightLayer has them.
      const int plane = picture.camera_voxel[i.face >> 1u] + i.plane;
      mask = coverage_mask(kCoveragePattern, owner.emitted.w, uint(pixel.x), uint(pixel.y), uint(plane * 6) + i.face);
    }
    if (kVeiled) {
      follow_veil(veil, i.t * metres);
      view = met_media(view, veil.view.value, veil.view.added);
    }
    view = met_interface(view, owner, shares, layer_block(i.near).absorption.xyz, i.t * metres, mirrored, matte,
                         i.outside, kCoveragePattern, mask);
    medium = i.far;
    last_block.absorption = layer_block(i.far).absorption;
    const bool opaque = all(lessThan(view.through, vec3(1e-6)));
    if (kRefraction != kRefractionNone && !opaque) {
      const float n_near = layer_block(i.near).absorption.w, n_far = layer_block(i.far).absorption.w;
      if (bend.found && !bend.left) bend.left = true, bend.t_out = i.t * metres;
      if (!bend.found && n_near != n_far) {
        bend.found = true;
        bend.at = i.t * ray;
        bend.t_in = i.t * metres;
        vec3 normal = vec3(0);
        normal[i.face >> 1u] = (i.face & 1u) != 0u ? 1.0 : -1.0;
        bend.direction = refracted_direction(-direction, normal, n_far / n_near);
        if (kRefraction == kRefractionTraced) {
          const FacePoint at = stepped_beyond(
              face_point(uint(owner.block.x), i.face, i.t * ray + picture.fraction.xyz, i.plane, -direction), i,
              direction);
          // Of media behind the bend nothing is known: they take what they take up to there.
          const vec3 behind = veil.view.value * followed_radiance(at.front, at.fraction, bend.direction, i.far, true);
          imageStore(colour_image, pixel, vec4(view.added + still_open(view, kCoveragePattern) * behind, 1));
          return;
        }
      }
    }
    --left;
    if (opaque || left == 0u) break;
  }

  if (kLayerBlocks && !any && !mirror && !in_absorber) return;

  // What lies behind has the media and clouds of all the way over it already.
  vec3 behind = imageLoad(colour_image, pixel).rgb;
  if (kVeiled) {
    follow_veil(veil, min(t_end * metres, kMediumFar));
    view = met_media(view, vec3(1), veil.view.added);
  }
  if (kRefraction == kRefractionScreen && bend.found && t_end * metres < 1e6) {
    // Where the bent ray would end if what lies there were as far as what lies straight behind.
    const float end = t_end * metres, within = (bend.left ? bend.t_out : end) - bend.t_in;
    const vec3 there = bend.at + within * bend.direction + (bend.left ? (end - bend.t_out) * direction : vec3(0));
    const vec3 at = projected(there);
    // What is nearer than the layer was never behind it.
    if (on_screen(at) && seen_depth(ivec2(at.xy)) > dot(picture.clip_w.xyz, bend.at))
      behind = imageLoad(behind_image, ivec2(at.xy)).rgb;
  }
  if (mirror) {
    const uint face = seen_face(seen.x), block = seen_block(seen.x);
    const int plane = seen_plane(seen, t_end * ray);
    const FacePoint at = face_point(block, face, t_end * ray + picture.fraction.xyz, plane, -direction);
    const Material material = material_of(block);
    const vec3 mirrored = mirrored_radiance(t_end * ray, at, plane, direction, medium);
    behind = veil.view.added + veil.view.value * (material.albedo * mirrored + material.emitted);
  }
  behind = max(behind - veil.view.added, vec3(0));
  const vec3 colour =
      end_of_view(view, last_block, eye_absorption().w, t_end * metres, behind, kCoveragePattern);
  imageStore(colour_image, pixel, vec4(colour, 1));
}
