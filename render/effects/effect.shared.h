/* What every effect of the lens, the film and the screen shares: the constants of a picture, and how one pixel looks at
 * others. An effect is a gather: from what lies around a pixel to the pixel, so that order and threads change nothing.
 *
 *   SHARED vec3 <name>_at(EFFECT_SOURCE ivec2 pixel, vec3 colour)
 *
 * `colour` is what the members before it made of the pixel (render/effects/chain.shared.h), as radiance; so is what it
 * returns. What happens behind the lens is expressed as radiance too: shown at the exposure of the picture, it looks as
 * the effect says.
 *
 * EFFECT_SOURCE stands for what a pixel looks at and the constants `f`: first arguments in C++, passed on by
 * EFFECT_PASS; in GLSL nothing, since they are the shader's. EFFECT_FRAME, passed on by PASS_FRAME, for the constants
 * alone. */
#ifndef LOAM_RENDER_EFFECTS_EFFECT_SHARED_H
#define LOAM_RENDER_EFFECTS_EFFECT_SHARED_H
#include "world/base/shared.h"
#include "render/effects/device.shared.h"

#ifdef __cplusplus
#include <bit>
#endif

SHARED_NAMESPACE(render)

SHARED_CONST int kBloomLobes = 3;
SHARED_CONST int kMostFlareSpots = 8;
SHARED_CONST int kMostBlades = 8;

/* Only members of 16 bytes, so that every layout rule places them alike. */
struct EffectFrame {
  ivec4 size;     /* x, y: of the picture at hand; z, w: of the whole that it is a window of */
  vec4 window;    /* x, y: where it begins in the whole; z: display value of a radiance of 1; w: the inverse */
  vec4 lens;      /* x, y: tan of half the field of view of the whole; z: half its height in pixels; w: the inverse */
  vec4 strength;  /* x: vignette, y: chromatic aberration, z: bloom, w: grain */
  vec4 bloom;     /* x: radiance above which light blooms; y: weight of a lobe */
  vec4 lobe_map;  /* x: texels of what is blurred, unhalved, a pixel; y, z: pixels of it before the picture's first */
  ivec4 lobe[3];  /* of each lobe of bloom: x: its first number in `blurred`; y, z: its size; w: halvings */
  uvec4 grain;    /* x: seed */
  vec4 meter;     /* x: share left out at each end; y: EV for a mean of 1 W/(m^2 sr); z, w: fewest and most EV */
  uvec4 modes;    /* x: tone curve, y: spots of the flare, z: blades of the iris */
  vec4 blades[4]; /* normals of the sides of the iris, two each */
  vec4 spots[16]; /* two a spot: x, y: place in half heights from the middle of the whole; radiance of its flare */
};

/* Larger radiance is taken for this: 100 times that of the sun's disk. */
SHARED_CONST float kMostRadiance = 1e9f;

SHARED uint float_bits(float x) {
#ifdef __cplusplus
  return std::bit_cast<uint32_t>(x);
#else
  return floatBitsToUint(x);
#endif
}

SHARED bool is_finite(float x) { return (float_bits(x) & 0x7f800000u) != 0x7f800000u; }
/* By bits, since compilers may take it that there is no NaN. */
SHARED float finite_radiance(float x) {
  if (is_finite(x)) return min(max(x, -kMostRadiance), kMostRadiance);
  uint bits = float_bits(x);
  if ((bits & 0x007fffffu) != 0u) return 0.0f;
  return (bits & 0x80000000u) != 0u ? 0.0f : kMostRadiance;
}

/* source  ITU-R BT.709: luminance of linear bands */
SHARED float luminance(vec3 c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }

#ifdef __cplusplus
/* What a pixel looks at. */
struct EffectSource {
  const float* radiance; /* EffectFrame.modes.w a pixel of the picture */
  const float* blurred;  /* three a texel, EffectFrame.lobe says where */
  float metered;         /* EV that automatic exposure adds */
};
#define EFFECT_FRAME [[maybe_unused]] const EffectFrame &f,
#define PASS_FRAME f,
#define EFFECT_SOURCE [[maybe_unused]] const EffectSource &source, EFFECT_FRAME
#define EFFECT_PASS source, f,
#define EFFECT_UNUSED [[maybe_unused]]
#define EFFECT_RADIANCE(i) source.radiance[i]
#define EFFECT_BLURRED(i) source.blurred[i]
#define EFFECT_METERED source.metered
#else
layout(binding = kEffectBindFrame) uniform Frame { EffectFrame f; };
layout(binding = kEffectBindPicture, std430) readonly buffer Picture { float picture[]; };
layout(binding = kEffectBindBlurred, std430) buffer Blurred { float blurred[]; };
layout(binding = kEffectBindMeter, std430) buffer Meter { uint meter[]; };
#define EFFECT_FRAME
#define PASS_FRAME
#define EFFECT_SOURCE
#define EFFECT_PASS
#define EFFECT_UNUSED
#define EFFECT_RADIANCE(i) picture[i]
#define EFFECT_BLURRED(i) blurred[i]
#define EFFECT_METERED uintBitsToFloat(meter[kMeterEv])
#endif

/* A shader has these as constants of its pipeline. */
#ifndef EFFECT_TONE_CURVE
#define EFFECT_TONE_CURVE f.modes.x
#endif

/* A pixel of the picture, finite; beyond its edge that at the edge. */
SHARED vec3 texel(EFFECT_SOURCE int x, int y) {
  x = min(max(x, 0), f.size.x - 1), y = min(max(y, 0), f.size.y - 1);
  int at = int(f.modes.w) * (y * f.size.x + x);
  return vec3(finite_radiance(EFFECT_RADIANCE(at)), finite_radiance(EFFECT_RADIANCE(at + 1)),
              finite_radiance(EFFECT_RADIANCE(at + 2)));
}

/* The middle of a pixel from the middle of the whole picture, in half heights; y points down. */
SHARED vec2 from_middle(EFFECT_FRAME ivec2 pixel) {
  vec2 at = vec2(float(pixel.x) + f.window.x, float(pixel.y) + f.window.y) + vec2(0.5f);
  return (at - 0.5f * vec2(float(f.size.z), float(f.size.w))) * f.lens.w;
}

SHARED_NAMESPACE_END

#ifdef __cplusplus
static_assert(sizeof(render::shared::EffectFrame) == 16 * (6 + 3 + 3 + 4 + 16));
#endif
#endif
