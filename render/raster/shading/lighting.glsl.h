// The buffer `lighting` (render/raster/lighting.shared.h) and how records are read from it.
#ifndef LOAM_RENDER_RASTER_SHADING_LIGHTING_GLSL_H
#define LOAM_RENDER_RASTER_SHADING_LIGHTING_GLSL_H
#include "render/raster/lighting.shared.h"
#include "render/raster/shading/picture.glsl.h"

layout(constant_id = kSpecLuminaires) const bool kLuminaires = false;
layout(constant_id = kSpecLuminaireKinds) const uint kLuminaireKinds = 0u;
layout(constant_id = kSpecMedia) const bool kMedia = false;
layout(constant_id = kSpecBsdf) const bool kBsdf = false;
layout(binding = kBindLighting) uniform usamplerBuffer lighting;

/// A texel: software gathers those for all lanes at once, and loops over lanes for words of storage.
uint lighting_word(uint at) { return texelFetch(lighting, int(at)).x; }

float lighting_float(uint at) { return uintBitsToFloat(lighting_word(at)); }
vec3 lighting_vec3(uint at) { return vec3(lighting_float(at), lighting_float(at + 1u), lighting_float(at + 2u)); }
ivec3 lighting_ivec3(uint at) {
  return ivec3(int(lighting_word(at)), int(lighting_word(at + 1u)), int(lighting_word(at + 2u)));
}

/// A point of the world, relative to a voxel, from the record of a place: voxel, then fraction.
vec3 lighting_place(uint at, ivec3 from) { return vec3(lighting_ivec3(at) - from) + lighting_vec3(at + 3u); }

#endif
