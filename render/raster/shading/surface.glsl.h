// Radiance of a point of a surface: the formula of render/shading.h. Whoever finds a surface, by the first pass, by a
// layer of glass or by a ray, describes it as a FacePoint and calls face_radiance().
#ifndef LOAM_RENDER_RASTER_SHADING_SURFACE_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_SURFACE_GLSL_H
#include "render/raster/shading/direct.glsl.h"
#include "render/raster/shading/face_light.glsl.h"
#include "render/raster/shading/sun.glsl.h"
#include "render/raster/shading/sun_blockers.glsl.h"
#include "render/raster/shading/textures.glsl.h"

struct FacePoint {
  uint block, face;
  ivec3 front;          // the voxel in front of the face, of the world
  vec3 fraction;        // the place in it, exactly on the face
  vec3 to_eye;          // unit
  vec3 step_x, step_y;  // on the face's plane to what the next pixels see, m; 0 where that isn't known
  bool layer;           // of a see-through block: the part of it that is there, however much that is
  bool bare;            // seen from within its block, where no texture is
  uint level;           // sixteenths that a liquid's top is high in the voxel behind the face; 0: it is on the face
};

/// The point where a ray from the camera's voxel meets a face: `hit` relative to that voxel, `plane` the face's own
/// coordinate. No rounding moves it off its face.
FacePoint face_point(uint block, uint face, vec3 hit, int plane, vec3 to_eye) {
  FacePoint p;
  p.block = block;
  p.face = face;
  p.to_eye = to_eye;
  p.step_x = p.step_y = vec3(0.0);
  p.layer = p.bare = false;
  p.level = 0u;
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

layout(constant_id = kSpecSkyRays) const uint kSkyRays = 0u;

/// A coarser level's face may lie within what it stands for: from there to the voxel before it, `most` at most.
void lift_point(inout FacePoint p, int most) {
  if (kSunShadow != kSunShadowRay && !kBsdf && kSkyRays == 0u) return;
  ivec3 step = ivec3(0);
  step[p.face >> 1] = (p.face & 1u) == 1u ? 1 : -1;
  for (int i = 0; i < most && !is_clear(p.front); ++i) p.front += step;
}

/// The part of the sky that rays find open, as render/trace/direct.cpp casts them.
float open_sky(const LitPoint p) {
  const float side = p.normal.z >= 0.0 ? 1.0 : -1.0, k = -1.0 / (side + p.normal.z), xy = p.normal.x * p.normal.y * k;
  const vec3 a = vec3(1.0 + side * p.normal.x * p.normal.x * k, side * xy, -side * p.normal.x);
  const vec3 b = vec3(xy, side + p.normal.y * p.normal.y * k, -p.normal.y);
  uint open = 0u;
  for (uint i = 0u; i < kSkyRays; ++i) {
    const vec2 u = sampler_two(kVertexDimension + kOcclusion, i, picture.light_samples.y == 0u);
    const float r = sqrt(u.x), angle = 2.0 * 3.14159265 * u.y;
    const vec3 direction = r * cos(angle) * a + r * sin(angle) * b + sqrt(1.0 - u.x) * p.normal;
    if (nothing_between(p.voxel, p.fraction + p.lift * p.normal, direction, picture.sun_irradiance.w, p.triangle))
      ++open;
  }
  return float(open) / float(kSkyRays);
}

/// Of the sky (`lit`: radiance of an albedo of 1 under it), the sun as far as it arrives, and luminaires.
vec3 scattered_light(const LitPoint p, const Scatterer s, vec3 lit, vec3 sun) {
  vec3 radiance = s.albedo * lit;
  if (largest_band(sun) > 0.0) {
    vec3 arrives = sun * picture.sun_irradiance.rgb * scattered_share(s, 0u, picture.sun.xyz, p.to_eye, p.normal);
    if (kMedia) arrives *= media_transmittance(p.voxel, p.fraction, picture.sun.xyz, kMediumFar);
    radiance += arrives;
  }
  if (kLuminaires) radiance += luminaires_at(p, s);
  return radiance;
}

vec3 face_radiance(const FacePoint p) {
  const uint face = p.face, axis = face >> 1;
  const bool positive = (face & 1u) == 1u;
  // Where rays to lights start.
  ivec3 start = p.front;
  vec3 place = p.fraction;
  if (kLiquidLevels && p.level != 0u && face == 3u) {
    --start.y;
    place.y = float(p.level) / 16.0;
  }
  const vec4 in_sun = sun_lit(face);
  bool visible = in_sun.w != 0.0;
  if (kSunShadow == kSunShadowRay && visible) visible = sun_visible(start, place, kNoTriangle);
  vec3 lit = sky_lit(face);
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
  vec3 sun = vec3(visible ? 1.0 : 0.0);
  if (kSunShadow == kSunShadowMap && visible) sun = vec3(sun_by_map(start, place, axis, kNoTriangle));
  if (kSunBlockers) {  // one condition each: specialised, it takes all that it holds out of the shader
    if (visible) sun *= sun_let_through(start, place);
  }
  if (kCloudShadows && visible) sun *= sun_through_clouds(start, place);
  LitPoint at;
  at.voxel = start;
  at.fraction = place;
  at.normal = vec3(0.0);
  at.normal[axis] = positive ? 1.0 : -1.0;
  at.to_eye = p.to_eye;
  at.side = at.normal;
  at.triangle = kNoTriangle;
  at.lift = 0.0;
  if (kSkyRays > 0u) lit *= open_sky(at);
  const Material material = material_of(p.block);
  float factor = 1.0;
  if (kTextures != kTextureOff && !p.bare) {
    ivec3 voxel = p.front;
    voxel[axis] -= positive ? 1 : -1;
    factor = texture_factor(material, voxel, face, p.fraction, p.step_x, p.step_y);
    if (kNormalDetail != 0.0)
      at.normal = textured_normal(material, voxel, face, p.fraction, p.step_x, p.step_y, at.normal);
  }
  if (!kBsdf) {
    vec3 albedo = material.albedo;
    if (kTextures != kTextureOff) albedo *= factor;
    vec3 of_sun = in_sun.rgb;
    if (kTextures != kTextureOff && kNormalDetail != 0.0)
      of_sun *= max(dot(at.normal, picture.sun.xyz), 0.0) / max(abs(picture.sun[axis]), 1e-6);
    return albedo * (lit + sun * of_sun) + material.emitted;
  }
  Scatterer scatterer = scatterer_of(p.block);
  if (p.layer) scatterer.parameters.coverage = 1.0;
  if (kTextures != kTextureOff) {
    scatterer.albedo *= factor;
    scatterer.parameters.lambertian *= factor;
  }
  return material.emitted + scattered_light(at, scatterer, lit, sun);
}

#endif
