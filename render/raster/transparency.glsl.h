// An interface between see-through blocks, as the shaders of the transparency pass take it apart.
#ifndef LOAM_RENDER_RASTER_TRANSPARENCY_GLSL_H
#define LOAM_RENDER_RASTER_TRANSPARENCY_GLSL_H
#include "render/raster/shading/shape.glsl.h"
#include "render/raster/shading/surface.glsl.h"
#include "render/raster/shading/veil.glsl.h"
#include "render/raster/transparency.shared.h"
#include "render/see_through.shared.h"

layout(constant_id = kSpecLayerMatte) const bool kLayerMatte = true;
layout(constant_id = kSpecLayerEmits) const bool kLayerEmits = true;
layout(constant_id = kSpecShapes) const bool kShapes = false;
layout(constant_id = kSpecEyeInAir) const bool kEyeInAir = false;
layout(binding = kBindLayerBlocks) uniform usamplerBuffer layer_blocks;
layout(binding = kBindLayerConstants) uniform Layers { LayerConstants layers; };

/// Of a kind. Software reads four words of one as fast as a single word of a storage buffer.
SeeThroughBlock layer_block(uint kind) {
  const int at = kLayerBlockTexels * int(kind);
  SeeThroughBlock b;
  b.absorption = uintBitsToFloat(texelFetch(layer_blocks, at));
  b.matte = kLayerMatte ? uintBitsToFloat(texelFetch(layer_blocks, at + 1)) : vec4(0);  // a dielectric
  b.transmission = uintBitsToFloat(texelFetch(layer_blocks, at + 2));
  b.emitted = kLayerMatte || kLayerEmits ? uintBitsToFloat(texelFetch(layer_blocks, at + 3)) : vec4(0);
  b.block = ivec4(texelFetch(layer_blocks, at + 4));
  return b;
}

/// What the eye is in: SeeThroughBlock::absorption.
vec4 eye_absorption() { return kEyeInAir ? vec4(0, 0, 0, 1) : layer_block(layers.eye.x).absorption; }

struct Interface {
  uint owner, near, far;  // kinds: whose it is, before and beyond it
  bool outside;           // the owner is what lies beyond
  uint face;              // the side that the eye sees
  int plane;              // relative to the camera's voxel
  uint level;             // sixteenths that a liquid's top is high in its voxel below the plane; 0: it is on it
  float t;                // of the pixel's ray, whose component along the camera's direction is 1
};

/// Of the pixel's ray where it ends on what `seen` says; 1e30 for the sky.
float seen_t(uvec2 seen, vec3 ray) {
  if (seen.x == 0u) return 1e30;
  if (kShapes && (seen.x & kSeenShape) != 0u) return shape_distance(seen, ray);
  if (kMeshes && (seen.x & kSeenNoFace) == kSeenMesh) return uintBitsToFloat(seen.y);
  return seen_cube_t(seen, ray);
}

Interface interface_of(uint packed, int plane, vec3 ray) {
  Interface i;
  const uint face = packed >> 13u & 7u, axis = face >> 1u, beyond = packed >> 16u & 0xfffu;
  i.owner = packed & 0xfffu;
  const bool up = ray[axis] > 0.0;
  i.outside = up != ((face & 1u) != 0u);
  i.near = i.outside ? beyond : i.owner;
  i.far = i.outside ? i.owner : beyond;
  i.face = 2u * axis + (up ? 0u : 1u);
  i.plane = plane;
  i.level = interface_level(packed);
  i.t = level_plane_t(axis, plane, i.level, ray);
  return i;
}

vec3 pixel_ray(vec2 pixel) { return picture.corner.xyz + pixel.x * picture.step_x.xyz + pixel.y * picture.step_y.xyz; }

/// What an interface does, and what it shows by itself: `mirrored` is the radiance from the mirrored direction.
InterfaceShares shares_of(Interface i, vec3 direction) {
  const float n_eye = eye_absorption().w, n_near = layer_block(i.near).absorption.w,
              n_far = layer_block(i.far).absorption.w, cosine = abs(direction[i.face >> 1u]);
  if (kLayerMatte) return interface_shares(layer_block(i.owner), n_eye, n_near, n_far, cosine);
  return dielectric_shares(n_eye, n_near, n_far, cosine);
}

/// Of a point in the voxel before the interface's face: where the ray comes into what lies beyond.
FacePoint stepped_beyond(FacePoint at, Interface i, vec3 direction) {
  const uint axis = i.face >> 1u;
  const bool up = direction[axis] > 0.0;
  at.front[axis] += up ? 1 : -1;
  at.fraction[axis] = 1.0 - at.fraction[axis];
  if (kLiquidLevels && i.level != 0u) {
    if (up) --at.front.y;
    at.fraction.y = float(i.level) / 16.0;
  }
  return at;
}
/// And where a ray that turns back there starts.
FacePoint turned_back(FacePoint at, Interface i, vec3 direction) {
  if (kLiquidLevels && i.level != 0u) {
    if (direction.y < 0.0) --at.front.y;
    at.fraction.y = float(i.level) / 16.0;
  }
  return at;
}

vec3 mirrored_direction(Interface i, vec3 direction) {
  direction[i.face >> 1u] = -direction[i.face >> 1u];
  return direction;
}

/// Radiance of the owner's matte surface.
vec3 matte_radiance(Interface i, vec3 ray, vec3 direction) {
  if (!kLayerMatte) return vec3(0);
  FacePoint p =
      face_point(uint(layer_block(i.owner).block.x), i.face, i.t * ray + picture.fraction.xyz, i.plane, -direction);
  p.layer = true;
  p.bare = !i.outside;
  p.level = i.level;
  if (kTextures != kTextureOff) {
    p.step_x = texture_step(i.t * ray, ray, picture.step_x.xyz, int(i.face >> 1u));
    p.step_y = texture_step(i.t * ray, ray, picture.step_y.xyz, int(i.face >> 1u));
  }
  return face_radiance(p);
}

/// m to where the ray of a pixel that sees this ends in fog.
float fog_end(uvec2 seen, vec3 ray) {
  const float t = seen_t(seen, ray), inverse_length = inversesqrt(dot(ray, ray));
  return t <= picture.sun.w * inverse_length ? t / inverse_length : kMediumFar;
}
VeilWalk begin_pixel_veil(uvec2 seen, vec3 ray, vec3 direction) {
  return begin_veil(direction, kFogShafts ? fog_end(seen, ray) : 0.0);
}

/// What it mirrors of the sky, scatters and emits, times `scale`: radiance beside it, before what lies nearer scales
/// it. Media and clouds take their share of it and, of the light that they add to what lies behind, leave what they add
/// before it; `passed`: of what lies behind, by what follows; `seen`: what that is.
vec3 shown_radiance(Interface i, InterfaceShares shares, float scale, vec3 passed, vec3 ray, vec3 direction,
                    uvec2 seen) {
  vec3 shown = vec3(0);
  if (shares.mirrored != vec3(0))
    shown = shares.mirrored * mirrored_sky(i.t * ray + picture.fraction.xyz, mirrored_direction(i, direction));
  if (kLayerMatte && shares.matte > 0.0)
    shown += shares.matte * matte_radiance(i, ray, direction);
  else if (i.outside)
    shown += layer_block(i.owner).emitted.xyz;
  shown *= scale;
  if (kVeiled) {
    VeilWalk veil = begin_pixel_veil(seen, ray, direction);
    follow_veil(veil, i.t * length(ray));
    shown = veil.view.value * shown + veil.view.added * (vec3(1) - passed);
  }
  return shown;
}

#endif
