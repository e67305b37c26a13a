// The buffer `lighting` (render/raster/lighting.shared.h) and how records are read from it.
#ifndef LOAM_RENDER_RASTER_SHADING_LIGHTING_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_LIGHTING_GLSL_H
#include "render/raster/lighting.shared.h"
#include "render/raster/shading/picture.glsl.h"

layout(constant_id = kSpecLuminaires) const bool kLuminaires = false;
layout(constant_id = kSpecLuminaireKinds) const uint kLuminaireKinds = 0u;
layout(constant_id = kSpecMedia) const bool kMedia = false;
layout(constant_id = kSpecBsdf) const bool kBsdf = false;
layout(binding = kBindLighting, std430) readonly buffer Lighting { uint lighting[]; };

float lighting_float(uint at) { return uintBitsToFloat(lighting[at]); }
vec3 lighting_vec3(uint at) { return vec3(lighting_float(at), lighting_float(at + 1u), lighting_float(at + 2u)); }
ivec3 lighting_ivec3(uint at) { return ivec3(int(lighting[at]), int(lighting[at + 1u]), int(lighting[at + 2u])); }

/// A point of the world, relative to a voxel, from the record of a place: voxel, then fraction.
vec3 lighting_place(uint at, ivec3 from) { return vec3(lighting_ivec3(at) - from) + lighting_vec3(at + 3u); }

#endif
