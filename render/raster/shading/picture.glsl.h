// What every part of shading reads: the picture's constants, what it is compiled for, materials.
#ifndef LOAM_RENDER_RASTER_SHADING_PICTURE_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_PICTURE_GLSL_H
#include "render/raster/raster.shared.h"

layout(constant_id = kSpecSunShadow) const uint kSunShadow = 0u;
layout(constant_id = kSpecLight) const uint kLight = 0u;
layout(constant_id = kSpecInterpolation) const uint kInterpolation = 0u;
layout(constant_id = kSpecCornerOcclusion) const bool kCornerOcclusion = false;

layout(binding = kBindPicture) uniform Picture { PictureConstants picture; };
layout(binding = kBindMaterials) uniform samplerBuffer materials;

vec3 albedo_of(uint block) { return texelFetch(materials, int(2u * block)).rgb; }
vec3 emission_of(uint block) { return texelFetch(materials, int(2u * block + 1u)).rgb; }

#endif
