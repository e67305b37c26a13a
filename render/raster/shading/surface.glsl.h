// Radiance of a point of a surface: the formula of render/shading.h. Whoever finds a surface, by the first pass, by a
// layer of glass or by a ray, describes it as a FacePoint and calls face_radiance().
#ifndef LOAM_RENDER_RASTER_SHADING_SURFACE_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_SURFACE_GLSL_H
#include "render/raster/shading/face_light.glsl.h"
#include "render/raster/shading/sun.glsl.h"

struct FacePoint {
  uint block, face;
  ivec3 front;    // the voxel in front of the face, of the world
  vec3 fraction;  // the place in it, exactly on the face
  vec3 to_eye;    // unit
};

/// The point where a ray from the camera's voxel meets a face: `hit` relative to that voxel, `plane` the face's own
/// coordinate. No rounding moves it off its face.
FacePoint face_point(uint block, uint face, vec3 hit, int plane, vec3 to_eye) {
  FacePoint p;
  p.block = block;
  p.face = face;
  p.to_eye = to_eye;
  ivec3 start = ivec3(floor(hit));
  vec3 fraction = hit - vec3(start);
  const uint axis = face >> 1;
  const bool positive = (face & 1u) == 1u;
  const bvec3 own = bvec3(axis == 0u, axis == 1u, axis == 2u);
  start = mix(start, ivec3(positive ? plane : plane - 1), own);
  p.fraction = mix(fraction, vec3(positive ? 0.0 : 1.0), own);
  p.front = picture.camera_voxel.xyz + start;
  return p;
}

/// A coarser level's face may lie within what it stands for: from there to the voxel before it, `most` at most.
void lift_point(inout FacePoint p, int most) {
  if (kSunShadow != kSunShadowRay) return;
  ivec3 step = ivec3(0);
  step[p.face >> 1] = (p.face & 1u) == 1u ? 1 : -1;
  for (int i = 0; i < most && clear_cube(p.front, find_region(p.front >> 7)) == 0; ++i) p.front += step;
}

vec3 face_radiance(const FacePoint p) {
  const uint face = p.face, axis = face >> 1;
  const bool positive = (face & 1u) == 1u;
  bool visible = picture.sun_lit[face].w != 0.0;
  if (kSunShadow == kSunShadowRay && visible) visible = sun_visible(p.front, p.fraction);
  vec3 lit = picture.sky_lit[face].rgb;
  if (kLight != kLightNone || kCornerOcclusion) {
    ivec3 voxel = p.front;
    voxel[axis] -= positive ? 1 : -1;
    const ivec2 axes = light_axes(int(axis));
    vec2 at = vec2(p.fraction[axes.x], p.fraction[axes.y]);
    uint code = kLightUnknown;
    if (kLight != kLightNone) {
      code = light_code(voxel, face);
      if (code == kLightUnknown) {
        // Rounding may have put the place beyond an edge: the face across the nearest edge is the one that is seen.
        const vec2 inward = abs(at - 0.5);
        const int nearest = inward.x > inward.y ? 0 : 1;
        const int side = at[nearest] < 0.5 ? -1 : 1;
        ivec3 beside = voxel;
        beside[axes[nearest]] += side;
        const uint other = light_code(beside, face);
        if (other != kLightUnknown && inward[nearest] > 0.499) {
          code = other;
          voxel = beside;
          at[nearest] = side < 0 ? 1.0 : 0.0;
        }
      }
    }
    if (kSunShadow == kSunShadowSkyLight) visible = visible && sees_whole_sky(code);
    lit = light_on_face(voxel, face, at, code);
  }
  float sun = visible ? 1.0 : 0.0;
  if (kSunShadow == kSunShadowMap && visible) sun = sun_map_at(p.front, p.fraction, axis);
  lit += sun * picture.sun_lit[face].rgb;
  return materials[2u * p.block].rgb * lit + materials[2u * p.block + 1u].rgb;
}

#endif
