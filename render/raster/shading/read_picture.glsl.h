// The picture's constants, read before all else. Software reads a number of a uniform buffer lane by lane, some 24
// instructions each, in a fragment shader and behind any branch of a compute shader; at a compute shader's start it is
// one. A triangle over the whole picture brings those that every pixel reads with its vertices, as flat inputs.
// A shader that defines PICTURE_FROM_VERTICES or PICTURE_READ_FIRST calls read_picture() first of all.
#ifndef LOAM_RENDER_RASTER_SHADING_READ_PICTURE_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_READ_PICTURE_GLSL_H
#include "render/raster/raster.shared.h"

layout(binding = kBindPicture) uniform Picture { PictureConstants picture_arrays; };

#if defined(PICTURE_TO_FRAGMENTS) || defined(PICTURE_FROM_VERTICES)
#ifdef PICTURE_TO_FRAGMENTS
#define FLAT_PICTURE flat out
#else
#define FLAT_PICTURE flat in
#endif
layout(location = 0) FLAT_PICTURE vec4 flat_corner;
layout(location = 1) FLAT_PICTURE vec4 flat_step_x;
layout(location = 2) FLAT_PICTURE vec4 flat_step_y;
layout(location = 3) FLAT_PICTURE vec4 flat_fraction;
layout(location = 4) FLAT_PICTURE vec4 flat_fraction_rest;
layout(location = 5) FLAT_PICTURE vec4 flat_sun;
layout(location = 6) FLAT_PICTURE vec4 flat_sky_zenith;
layout(location = 7) FLAT_PICTURE vec4 flat_sky_horizon;
layout(location = 8) FLAT_PICTURE vec4 flat_sky_ground;
layout(location = 9) FLAT_PICTURE ivec4 flat_camera_voxel;
layout(location = 10) FLAT_PICTURE ivec4 flat_region_min;
layout(location = 11) FLAT_PICTURE ivec4 flat_region_max;
layout(location = 12) FLAT_PICTURE ivec4 flat_sun_cells;
layout(location = 13) FLAT_PICTURE ivec4 flat_sun_base;
layout(location = 14) FLAT_PICTURE vec4 flat_sun_u;
layout(location = 15) FLAT_PICTURE vec4 flat_sun_v;
layout(location = 16) FLAT_PICTURE vec4 flat_screen;
#endif

#ifdef PICTURE_TO_FRAGMENTS
void write_picture() {
  flat_corner = picture_arrays.corner;
  flat_step_x = picture_arrays.step_x;
  flat_step_y = picture_arrays.step_y;
  flat_fraction = picture_arrays.fraction;
  flat_fraction_rest = picture_arrays.fraction_rest;
  flat_sun = picture_arrays.sun;
  flat_sky_zenith = picture_arrays.sky_zenith;
  flat_sky_horizon = picture_arrays.sky_horizon;
  flat_sky_ground = picture_arrays.sky_ground;
  flat_camera_voxel = picture_arrays.camera_voxel;
  flat_region_min = picture_arrays.region_min;
  flat_region_max = picture_arrays.region_max;
  flat_sun_cells = picture_arrays.sun_cells;
  flat_sun_base = picture_arrays.sun_base;
  flat_sun_u = picture_arrays.sun_u;
  flat_sun_v = picture_arrays.sun_v;
  flat_screen = picture_arrays.screen;
}
#else
/// But for its arrays, whose place isn't known beforehand: picture_arrays.
PictureConstants picture;

void read_picture() {
  picture.corner = picture_arrays.corner;
  picture.step_x = picture_arrays.step_x;
  picture.step_y = picture_arrays.step_y;
  picture.clip_x = picture_arrays.clip_x;
  picture.clip_y = picture_arrays.clip_y;
  picture.clip_w = picture_arrays.clip_w;
  picture.fraction = picture_arrays.fraction;
  picture.fraction_rest = picture_arrays.fraction_rest;
  picture.sun = picture_arrays.sun;
  picture.sky_zenith = picture_arrays.sky_zenith;
  picture.sky_horizon = picture_arrays.sky_horizon;
  picture.sky_ground = picture_arrays.sky_ground;
  picture.camera_voxel = picture_arrays.camera_voxel;
  picture.region_min = picture_arrays.region_min;
  picture.region_max = picture_arrays.region_max;
  picture.map_u = picture_arrays.map_u;
  picture.map_v = picture_arrays.map_v;
  picture.map_w = picture_arrays.map_w;
  picture.map_low = picture_arrays.map_low;
  picture.map_size = picture_arrays.map_size;
  picture.light = picture_arrays.light;
  picture.luminaires = picture_arrays.luminaires;
  picture.luminaires_seen = picture_arrays.luminaires_seen;
  picture.light_cells = picture_arrays.light_cells;
  picture.media = picture_arrays.media;
  picture.light_samples = picture_arrays.light_samples;
  picture.sun_irradiance = picture_arrays.sun_irradiance;
  picture.eye_absorption = picture_arrays.eye_absorption;
  picture.sky = picture_arrays.sky;
  picture.clouds = picture_arrays.clouds;
  picture.sun_cells = picture_arrays.sun_cells;
  picture.sun_base = picture_arrays.sun_base;
  picture.sun_u = picture_arrays.sun_u;
  picture.sun_v = picture_arrays.sun_v;
  picture.meshes = picture_arrays.meshes;
  picture.mesh_base = picture_arrays.mesh_base;
  picture.voxel_light = picture_arrays.voxel_light;
  picture.screen = picture_arrays.screen;
#ifdef PICTURE_FROM_VERTICES
  picture.corner = flat_corner;
  picture.step_x = flat_step_x;
  picture.step_y = flat_step_y;
  picture.fraction = flat_fraction;
  picture.fraction_rest = flat_fraction_rest;
  picture.sun = flat_sun;
  picture.sky_zenith = flat_sky_zenith;
  picture.sky_horizon = flat_sky_horizon;
  picture.sky_ground = flat_sky_ground;
  picture.camera_voxel = flat_camera_voxel;
  picture.region_min = flat_region_min;
  picture.region_max = flat_region_max;
  picture.sun_cells = flat_sun_cells;
  picture.sun_base = flat_sun_base;
  picture.sun_u = flat_sun_u;
  picture.sun_v = flat_sun_v;
  picture.screen = flat_screen;
#endif
}
#endif

#endif
