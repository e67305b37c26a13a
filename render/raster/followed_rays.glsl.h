// What a bent or mirrored ray shows.
#ifndef LOAM_RENDER_RASTER_FOLLOWED_RAYS_GLSL_H
#define LOAM_RENDER_RASTER_FOLLOWED_RAYS_GLSL_H
#include "render/bsdf/directions.shared.h"
#include "render/raster/block_grid.glsl.h"
#include "render/raster/bodies.glsl.h"
#include "render/raster/shading/mesh_first.glsl.h"
#include "render/raster/shape_quads.glsl.h"

/// What ends a straight part of a ray, but opaque blocks.
const uint kEndsOnSky = 0u, kEndsOnMesh = 1u, kEndsOnBody = 2u, kEndsOnShape = 3u;
struct StraightEnd {
  float t;  // 1e30: the sky
  uint what, index;
  vec3 radiance;  // of a body
};

/// A shape may begin in the very plane in which a ray comes into its voxel, m.
const float kFlush = 1e-4;

/// Of what isn't found voxel by voxel.
StraightEnd straight_end(BlockWalk w) {
  StraightEnd end;
  end.t = 1e30;
  end.what = kEndsOnSky;
  if (kMeshes) {  // one condition each: specialised, it takes all that it holds out of the shader
    end.index = first_mesh(w.start, w.fraction, w.direction, end.t);
    if (end.index != kNoTriangle) end.what = kEndsOnMesh;
  }
  if (kBodies) {
    const BodyMet body = first_body(w.start, w.fraction, w.direction);
    if (body.t < end.t) {
      end.t = body.t;
      end.what = kEndsOnBody;
      end.radiance = body.radiance;
    }
  }
  return end;
}
vec3 end_radiance(StraightEnd end, BlockWalk w) {
  if (kShapeCodes) {
    if (end.what == kEndsOnShape)
      return shape_radiance_at(end.index, w.voxel,
                               clamp(w.fraction + end.t * w.direction - vec3(w.voxel - w.start), vec3(0), vec3(1)),
                               w.direction);
  }
  if (kMeshes) {
    if (end.what == kEndsOnMesh) return first_mesh_radiance(end.index, w.start, w.fraction, w.direction, end.t);
  }
  return end.radiance;
}
/// Of the sky along a direction from where the walk is.
vec3 walk_sky(BlockWalk w, vec3 direction) {
  return mirrored_sky(vec3(w.start - picture.camera_voxel.xyz) + w.fraction + w.t * w.direction, direction);
}

/// A share of the picture below which a mirrored ray is not worth its cost.
const float kLeastMirrored = 0.004;
/// Rays of a pixel that are followed one after the other.
const int kMostFollowed = 64;

/// Where a ray starts, and how much of what it shows comes to the eye; 0: there is none.
struct FollowedRay {
  ivec3 voxel;
  vec3 fraction, direction, through;
  uint medium;
};

/// What a walk finds where it is.
struct Found {
  uint block, kind, shape, level;  // shape: its first quad, or kNoQuad
  int size;                        // of the cube around that is all of it
  LiquidTop top;
};
Found found_by(BlockWalk w) {
  Found found;
  uint code = block_at(w.voxel, w.place, found.size);
  found.shape = kNoQuad;
  if (kShapeCodes && code >= kShapeCode) {
    found.shape = code - kShapeCode;
    code = 0u;
    found.size = 1;
  }
  found.block = code_block(code);
  found.level = code_level(code);
  found.kind = code_kind(code);
  found.top.ahead = false;
  if (kLiquidLevels && found.level < 16u) {
    found.top = liquid_top(w, found.level);
    if (!found.top.liquid) found.kind = 0u;
    found.size = 1;
  }
  return found;
}

/// On through the medium, up to what isn't it, or may end the ray. False: out of all regions. Software runs all of a
/// loop's body at each step, so this is all that there is in it.
bool walk_through(inout BlockWalk w, uint medium, float end, out Found found) {
  bool met = false, inside = true;
  for (int regions = 0; inside && !met && regions < 4096; ++regions) {
    for (int steps = 0; steps < 4096; ++steps) {
      found = found_by(w);
      met = found.kind != medium || (kShapeCodes && found.shape != kNoQuad) || ((kMeshes || kBodies) && end <= w.t);
      if (met) break;
      if (kLiquidLevels && cross_top(w, found.top, found.level)) continue;
      leave_cube(w, found.size);
      if (left_region(w)) break;
    }
    if (!met) inside = enter_region(w);
  }
  return met;
}

/// What one ray shows; `mirrored_ray`: the first part of it that is mirrored where it bends, if that is worth it.
vec3 ray_radiance(FollowedRay ray, bool bends, inout int interfaces, out FollowedRay mirrored_ray) {
  mirrored_ray.through = vec3(0);
  vec3 added = vec3(0), through = ray.through;
  uint medium = ray.medium;
  const float n_eye = layer_block(medium).absorption.w;
  float last = 0.0;
  BlockWalk w = begin_walk(ray.voxel, ray.fraction, ray.direction);
  StraightEnd end = straight_end(w);
  bool solid = false;
  Found found;
  for (int parts = 0; parts < 4096; ++parts) {
    if (!walk_through(w, medium, end.t, found)) break;
    if (kMeshes || kBodies) {
      if (end.t <= w.t) break;
    }
    const uint kind = found.kind;
    if (kind != medium && w.axis < 0) {
      // The start is rounded into another block: nothing lies between.
      if (kind == kKindSolid) return added;
      medium = kind;
    } else if (kind != medium) {
      through *= absorbed_along(layer_block(medium).absorption.xyz, w.t - last);
      last = w.t;
      if (kind == kKindSolid) {
        solid = true;
        break;
      }
      const uint owner = max(kind, medium);  // kinds are in the order of ids
      const SeeThroughBlock of = layer_block(owner);
      const float n_near = layer_block(medium).absorption.w, n_far = layer_block(kind).absorption.w;
      const InterfaceShares shares =
          interface_shares(of, bends ? n_near : n_eye, n_near, n_far, abs(w.direction[w.axis]));
      vec3 mirrored = w.direction;
      mirrored[w.axis] = -mirrored[w.axis];
      const bool total =
          bends && n_near != n_far && of.matte.w == float(kSeeThroughDielectric) && shares.passed == vec3(0);
      const vec3 to_mirrored = through * shares.mirrored;
      const bool follows = bends && n_near != n_far && !total && mirrored_ray.through == vec3(0) &&
                           max(to_mirrored.x, max(to_mirrored.y, to_mirrored.z)) > kLeastMirrored;
      if (!total && !follows) added += to_mirrored * walk_sky(w, mirrored);
      if (kLayerMatte && shares.matte > 0.0)
        added += through * shares.matte * face_radiance(crossed_point(w, uint(of.block.x)));
      else if (owner == kind)
        added += through * of.emitted.xyz;
      if (++interfaces > 32) return added;
      if (bends && n_near != n_far) {
        const FacePoint at = crossed_point(w, found.block);
        vec3 normal = vec3(0);
        normal[w.axis] = w.direction[w.axis] >= 0.0 ? -1.0 : 1.0;
        ivec3 before = at.front, beyond = w.voxel;
        vec3 place = at.fraction;
        place[w.axis] = 1.0 - place[w.axis];
        vec3 place_before = at.fraction;
        if (kLiquidLevels && w.level != 0u) {
          before = beyond;
          place.y = place_before.y = float(w.level) / 16.0;
        }
        if (follows) mirrored_ray = FollowedRay(before, place_before, mirrored, to_mirrored, medium);
        if (total) {
          w = begin_walk(before, place_before, mirrored);
        } else {
          const vec3 bent = refracted_direction(-w.direction, normal, n_far / n_near);
          w = begin_walk(beyond, place, bent);
          through *= shares.passed;
          medium = kind;
        }
        last = 0.0;
        end = straight_end(w);
        continue;
      }
      through *= shares.passed;
      medium = kind;
      if (all(lessThan(through, vec3(1e-3)))) return added;
    }
    if (kShapeCodes) {
      if (found.shape != kNoQuad) {
        const uint quad = nearest_face(found.shape, faces_of_shape(found.shape), vec3(w.voxel - w.start) - w.fraction,
                                       w.direction, -kFlush, end.t);
        if (quad != kNoQuad) {
          end.what = kEndsOnShape;
          end.index = quad;
          break;
        }
      }
    }
    if (kLiquidLevels && cross_top(w, found.top, found.level)) continue;
    leave_cube(w, found.size);
    if (left_region(w) && !enter_region(w)) break;
  }
  if (solid)
    return added + through * radiance_scale(eye_absorption().w, layer_block(medium).absorption.w) *
                       face_radiance(crossed_point(w, found.block));
  if (end.what != kEndsOnSky)
    return added + through * absorbed_along(layer_block(medium).absorption.xyz, end.t - last) *
                       radiance_scale(eye_absorption().w, layer_block(medium).absorption.w) * end_radiance(end, w);
  through *= absorbed_along(layer_block(medium).absorption.xyz, 1e30);
  return added +
         through * radiance_scale(eye_absorption().w, layer_block(medium).absorption.w) * walk_sky(w, w.direction);
}

/// What a ray shows that starts in a medium, as the eye sees it: surfaces shaded by face_radiance(), layers before them
/// straight on, or with `bends` refracted by Snell's law. What layers mirror is the sky, but where a ray bends first:
/// what that mirrors is followed as the ray is. Shapes of blocks, triangles of meshes and bodies end rays as surfaces
/// do; particles don't.
vec3 followed_radiance(ivec3 voxel, vec3 fraction, vec3 direction, uint medium, bool bends) {
  FollowedRay ray = FollowedRay(voxel, fraction, direction, vec3(1), medium);
  vec3 seen = vec3(0);
  int interfaces = 0;
  for (int rays = 0; rays < kMostFollowed && ray.through != vec3(0); ++rays) {
    FollowedRay mirrored_ray;
    seen += ray_radiance(ray, bends, interfaces, mirrored_ray);
    ray = mirrored_ray;
  }
  return seen;
}

#endif
