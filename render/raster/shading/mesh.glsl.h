// Radiance of a triangle that a pixel sees: direct_radiance() of render/trace/direct.cpp on a mesh. Both sides scatter,
// the front emits.
#ifndef LOAM_RENDER_RASTER_SHADING_MESH_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_MESH_GLSL_H
#include "render/raster/shading/mesh_rays.glsl.h"
#include "render/raster/shading/sky.glsl.h"
#include "render/raster/shading/surface.glsl.h"
#include "render/raster/shading/voxel_light.glsl.h"

layout(binding = kBindSkyTable) uniform samplerBuffer sky_table;

/// On a surface of any unit normal: sky_irradiance() of render/shading.h.
vec3 sky_irradiance(vec3 n) {
  const float pi = 3.14159265, polar = acos(clamp(n.y, -1.0, 1.0)), level = length(n.xz);
  if (!kSkyModel)
    return linear_sky_irradiance(picture.sky_zenith.rgb, picture.sky_horizon.rgb, picture.sky_ground.rgb, n.y);
  // Level, towards the sun's azimuth.
  const vec2 sun = picture.sky.sun.xz, aside = length(sun) > 1e-6 ? normalize(sun) : vec2(1, 0);
  const float azimuth = level > 1e-6 ? acos(clamp(dot(n.xz, aside) / level, -1.0, 1.0)) : 0.0;
  const vec2 at = vec2(polar, azimuth) / pi * float(kSkyAngles - 1);
  const ivec2 cell = min(ivec2(at), ivec2(kSkyAngles - 2));
  const vec2 part = at - vec2(cell);
  const int first = cell.x * kSkyAngles + cell.y;
  return mix(
      mix(texelFetch(sky_table, first).rgb, texelFetch(sky_table, first + 1).rgb, part.y),
      mix(texelFetch(sky_table, first + kSkyAngles).rgb, texelFetch(sky_table, first + kSkyAngles + 1).rgb, part.y),
      part.x);
}

struct MeshVertex {
  vec3 position, normal;  // position: relative to the camera
  vec2 checkers;
};
MeshVertex mesh_vertex(uint vertex) {
  MeshVertex v;
  v.position = mesh_corner(vertex, picture.camera_voxel.xyz, picture.fraction.xyz) - picture.fraction_rest.xyz;
  const int at = int(picture.meshes.z + 3u * vertex);
  const uvec4 second = texelFetch(meshes, at + 1), third = texelFetch(meshes, at + 2);
  v.normal = vec3(uintBitsToFloat(second.z), uintBitsToFloat(second.w), uintBitsToFloat(third.x));
  v.checkers = uintBitsToFloat(third.yz);
  return v;
}

/// hit: relative to the camera; ray: towards it, of any length.
vec3 mesh_radiance_at(uint triangle, vec3 hit, vec3 ray) {
  const uvec4 corners = mesh_triangle(triangle);
  const MeshVertex a = mesh_vertex(corners.x), b = mesh_vertex(corners.y), c = mesh_vertex(corners.z);
  const vec3 across = cross(b.position - a.position, c.position - a.position);
  const bool inside = dot(across, ray) > 0.0;
  const vec3 side = normalize(inside ? -across : across);

  // Where on the triangle.
  vec3 weight = vec3(dot(across, cross(b.position - hit, c.position - hit)),
                     dot(across, cross(c.position - hit, a.position - hit)), 0) /
                dot(across, across);
  weight.z = 1.0 - weight.x - weight.y;
  vec3 normal = weight.x * a.normal + weight.y * b.normal + weight.z * c.normal;
  normal = dot(normal, normal) > 0.0 ? normalize(inside ? -normal : normal) : side;
  if (!(dot(normal, ray) < 0.0)) normal = side;
  const vec2 square = floor(weight.x * a.checkers + weight.y * b.checkers + weight.z * c.checkers);
  const uvec4 material = texelFetch(meshes, int(picture.meshes.w + 2u * corners.w));
  const uint block = (int(square.x) + int(square.y) & 1) != 0 ? material.y : material.x;

  // Off the triangle by more than the hit is rounded by.
  const vec3 from = hit + side * (1e-6 + 4e-7 * length(hit)) + picture.fraction.xyz;
  LitPoint p;
  p.voxel = picture.camera_voxel.xyz + ivec3(floor(from));
  p.fraction = from - floor(from);
  p.normal = normal;
  // What rises less than this above a smooth surface that a ray leaves is the surface itself: kCrack of
  // world/store/contour_walk.h.
  const bool smooth_surface = material.z != 0u;
  p.lift = smooth_surface ? 0.25 : 0.0;
  p.side = smooth_surface ? normal : side;
  p.to_eye = -normalize(ray);
  p.triangle = triangle;
  vec3 light = sky_irradiance(normal) / 3.14159265;
  bool whole_sky = true;
  if (kLight != kLightNone) light = light_at_point(p.voxel, p.fraction + p.lift * normal, normal, light, whole_sky);
  if (kSkyRays > 0u) light *= open_sky(p);
  float sun = dot(p.side, picture.sun.xyz) > 0.0 && dot(normal, picture.sun.xyz) > 0.0 ? 1.0 : 0.0;
  if (kSunShadow == kSunShadowSkyLight && !whole_sky) sun = 0.0;
  if (kSunShadow == kSunShadowRay && sun > 0.0)
    sun = sun_visible(p.voxel, p.fraction + p.lift * normal, triangle) ? 1.0 : 0.0;
  if (kSunShadow == kSunShadowMap && sun > 0.0) {
    const vec3 size = abs(side);
    sun = sun_by_map(p.voxel, p.fraction,
                     size.x >= size.y && size.x >= size.z ? 0u
                     : size.y >= size.z                   ? 1u
                                                          : 2u,
                     triangle);
  }
  vec3 arrives = vec3(sun);
  if (kSunBlockers) {  // one condition each: specialised, it takes all that it holds out of the shader
    if (sun > 0.0) arrives *= sun_let_through(p.voxel, p.fraction + p.lift * normal);
  }
  if (kCloudShadows && sun > 0.0) arrives *= sun_through_clouds(p.voxel, p.fraction);
  const Material of_block = material_of(block);
  vec3 emitted = smooth_surface ? of_block.emitted : vec3(0);
  if (!inside) emitted += uintBitsToFloat(texelFetch(meshes, int(picture.meshes.w + 2u * corners.w + 1u)).xyz);
  if (kBsdf) return emitted + scattered_light(p, scatterer_of(block), light, arrives);
  return emitted +
         of_block.albedo * (light + arrives * dot(normal, picture.sun.xyz) / 3.14159265 * picture.sun_irradiance.rgb);
}

vec3 mesh_radiance(uvec2 seen, vec3 ray, float t) { return mesh_radiance_at(seen.x & ~kSeenMesh, t * ray, ray); }

#endif
