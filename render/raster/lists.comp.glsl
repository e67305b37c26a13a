#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
// Puts the layers of each pixel in order and adds them to what was seen behind them. The order is that of (t, axis), as
// a ray crosses the planes of the grid; the next in order is sought anew each time, so that lists may be of any length
// and no pixel needs room of its own.
#define PICTURE_READ_FIRST
#include "render/raster/reflection.glsl.h"

layout(local_size_x = 8, local_size_y = 8) in;
layout(constant_id = kSpecCoveragePattern) const uint kCoveragePattern = 0u;
layout(binding = kBindColour, rgba32f) uniform image2D colour_image;
layout(binding = kBindLayerHeads, r32ui) uniform uimage2D heads;
layout(binding = kBindLayerNodes) uniform usamplerBuffer nodes;
layout(binding = kBindLayerOwnNodes) uniform utexture2D own_nodes;
layout(constant_id = kSpecListedTiles) const bool kListedTiles = false;
layout(binding = kBindLayerTiles) uniform usamplerBuffer tiles;
layout(push_constant) uniform Slice { uvec2 first_group; };  // x: of the listed tiles

uvec2 own_node = uvec2(0);  // of the pixel
/// Of a node the interface and its plane; and the node before it, 0: none.
uvec2 interface_in(uint node) {
  if (node == kOwnNode) return own_node;
  return texelFetch(nodes, int(node - kFirstNode)).yz;
}
uint node_before(uint node) { return node == kOwnNode ? 0u : texelFetch(nodes, int(node - kFirstNode)).x; }

/// t of the node's plane, and of equal ones by axis.
vec2 order_of(uint node, vec3 ray) {
  const uvec2 of = interface_in(node);
  const uint axis = of.x >> 14u & 3u;
  return vec2(level_plane_t(axis, int(of.y), interface_level(of.x), ray), float(axis));
}
bool before(vec2 a, vec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); }

/// The first layer that bends a ray, and where the ray goes on straight behind the next one.
struct Bend {
  bool found, left;
  vec3 at, direction;  // relative to the camera; unit
  float t_in, t_out;   // m
};

void main() {
  read_picture();
  ivec2 pixel = ivec2(8u * first_group + gl_GlobalInvocationID.xy);
  if (kListedTiles) {
    const uint place = texelFetch(tiles, int(first_group.x + gl_WorkGroupID.x)).r;
    pixel = 8 * ivec2(place & 0xffffu, place >> 16) + ivec2(gl_LocalInvocationID.xy);
  }
  if (any(greaterThanEqual(pixel, ivec2(picture.screen.xy)))) return;
  const uint head = imageLoad(heads, pixel).x, eye = uint(layers.eye.x);
  // The next picture finds it empty.
  if (head != 0u) imageStore(heads, pixel, uvec4(0));
  if (head != 0u) own_node = texelFetch(own_nodes, pixel, 0).xy;
  const uvec2 seen = texelFetch(seen_image, pixel, 0).xy;
  bool mirror = kReflection != kReflectionNone && seen.x != 0u && (seen.x & kSeenNoFace) == 0u &&
                      (block_kinds[2u * seen_block(seen.x) + 1u] & 1u) != 0u;
  if (head == 0u && !mirror && eye_absorption().xyz == vec3(0)) return;
  if (kFogShafts) fog_shift = fog_shaft_shift(float(pixel.x), float(pixel.y));
  const vec3 ray = pixel_ray(vec2(pixel) + 0.5);
  const float inverse_length = inversesqrt(dot(ray, ray)), metres = dot(ray, ray) * inverse_length;
  const vec3 direction = ray * inverse_length;
  float t_end = min(picture.sun.w * inverse_length, seen_t(seen, ray));
  const float on_body = body_t(pixel, t_end);
  mirror = mirror && on_body == t_end;
  t_end = on_body;

  StraightView view = start_of_view();
  uint medium = eye;
  vec2 last = vec2(0, -1);
  Bend bend;
  bend.found = bend.left = false;
  VeilWalk veil = begin_pixel_veil(seen, ray, direction);
  for (bool more = true; more;) {
    more = head != kOwnNode;  // which is alone
    vec2 nearest = vec2(t_end, 4);
    uint next = 0u;
    for (uint node = head; node != 0u; node = node_before(node)) {
      const vec2 order = order_of(node, ray);
      if (before(last, order) && before(order, nearest)) nearest = order, next = node;
    }
    if (next == 0u || nearest.x >= t_end) break;
    last = nearest;
    const uvec2 of = interface_in(next);
    const Interface i = interface_of(of.x, int(of.y), ray);
    const SeeThroughBlock owner = layer_block(i.owner);
    const InterfaceShares shares = shares_of(i, direction);
    const vec3 matte = kLayerMatte && shares.matte > 0.0 ? matte_radiance(i, ray, direction) : vec3(0);
    vec3 mirrored = vec3(0);
    if (shares.mirrored != vec3(0)) {
      // Within glass the mirrored ray leaves by the way it came: it sees the sky, or what lies there.
      const vec3 worth = view.through * shares.mirrored;
      if (kReflection != kReflectionNone && max(worth.x, max(worth.y, worth.z)) > kLeastMirrored &&
          (i.outside || i.near == eye))
        mirrored = mirrored_radiance(i.t * ray,
                                     turned_back(face_point(uint(owner.block.x), i.face,
                                                            i.t * ray + picture.fraction.xyz, i.plane, -direction),
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
    if (all(lessThan(view.through, vec3(1e-6)))) break;
    if (kRefraction == kRefractionNone) continue;
    const float n_near = layer_block(i.near).absorption.w, n_far = layer_block(i.far).absorption.w;
    if (bend.found && !bend.left) bend.left = true, bend.t_out = i.t * metres;
    if (bend.found || n_near == n_far) continue;
    bend.found = true;
    bend.at = i.t * ray;
    bend.t_in = i.t * metres;
    vec3 normal = vec3(0);
    normal[i.face >> 1u] = (i.face & 1u) != 0u ? 1.0 : -1.0;
    bend.direction = refracted_direction(-direction, normal, n_far / n_near);
    if (kRefraction == kRefractionTraced) {
      const FacePoint at = stepped_beyond(
          face_point(uint(owner.block.x), i.face, i.t * ray + picture.fraction.xyz, i.plane, -direction), i, direction);
      // Of media behind the bend nothing is known: they take what they take up to there.
      const vec3 behind = veil.view.value * followed_radiance(at.front, at.fraction, bend.direction, i.far, true);
      imageStore(colour_image, pixel, vec4(view.added + still_open(view, kCoveragePattern) * behind, 1));
      return;
    }
  }

  // What lies behind has the media and clouds of all the way over it already.
  vec3 behind = imageLoad(colour_image, pixel).rgb;
  if (kVeiled) {
    follow_veil(veil, min(t_end * metres, kMediumFar));
    view = met_media(view, vec3(1), veil.view.added);
  }
  if (kRefraction == kRefractionScreen && bend.found && t_end * metres < 1e6) {
    // Where the bent ray would end if what lies there were as far as what lies straight behind.
    const float end = t_end * metres, within = (bend.left ? bend.t_out : end) - bend.t_in;
    const vec3 there =
        bend.at + within * bend.direction + (bend.left ? (end - bend.t_out) * direction : vec3(0));
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
      end_of_view(view, layer_block(medium), eye_absorption().w, t_end * metres, behind, kCoveragePattern);
  imageStore(colour_image, pixel, vec4(colour, 1));
}
