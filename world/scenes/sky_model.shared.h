/* The light of a clear sky along a direction, by day and night: written once for C++ and GLSL.
 *
 *   Perez   F(theta, gamma) = (1 + A exp(B / cos theta)) (1 + C exp(D gamma) + E cos^2 gamma)      [1] eq. 3
 *   each of Y, x, y is its value at the zenith times F(theta, gamma) / F(0, theta_sun)             [1] eq. 4
 * theta is the angle of the direction from the zenith, gamma that from the sun. Below the horizon the sky of the
 * horizon goes over into the ground's radiance as that of a linear sky does. Air glow and stars are added; disks of
 * the sun and the moon are what only an eye sees, since as sources they are directional lights.
 *
 * Directions are unit vectors, y is up. Radiances are W/(m^2 sr) by band, at most 1e9.
 * error   of the model itself against measured skies: [1] says a few tenths near the sun. GLSL: 1e-3 of C++ (acos).
 * source  [1] A. J. Preetham, Peter Shirley, Brian Smits. A Practical Analytic Model for Daylight. 1999 */
#ifndef LOAM_WORLD_SCENES_SKY_MODEL_SHARED_H
#define LOAM_WORLD_SCENES_SKY_MODEL_SHARED_H
#include "world/scenes/linear_sky.shared.h"

SHARED_NAMESPACE(world)

/* What C++ works out from the time of day (sky_light.cpp). Only members of 16 bytes. */
struct SkyModel {
  vec4 a, b, c, d, e; /* Perez's coefficients: of Y, x, y; w unused */
  vec4 zenith;        /* Y (W/(m^2 sr)), x, y over F(0, theta_sun) */
  vec4 sun;           /* towards the sun; w: 1 where its disk may be seen */
  vec4 sun_disk;      /* its radiance; w: chord of its radius, |direction - sun| at its edge */
  vec4 moon, moon_disk;
  vec4 glow;   /* radiance of the night's own air; w: radiance of the brightest star, 0: no stars */
  vec4 ground; /* radiance from far below the horizon */
  vec4 pole;   /* celestial frame: the pole, and two axes of the equator that turn with the hours */
  vec4 equator_a, equator_b;
};

/* Linear sRGB of CIE XYZ; bands that sRGB can't show become 0. source: IEC 61966-2-1 */
SHARED vec3 rgb_from_xyz(vec3 c) {
  return max(vec3(3.2404542f * c.x - 1.5371385f * c.y - 0.4985314f * c.z,
                  -0.9692660f * c.x + 1.8760108f * c.y + 0.0415560f * c.z,
                  0.0556434f * c.x - 0.2040259f * c.y + 1.0572252f * c.z),
             vec3(0.0f));
}
SHARED vec3 rgb_from_Yxy(vec3 c) {
  float y = max(c.z, 1e-3f);
  return rgb_from_xyz(vec3(c.y * c.x / y, c.x, max(1.0f - c.y - y, 0.0f) * c.x / y));
}

/* F of Y, x and y. */
SHARED vec3 sky_perez(SHARED_IN(SkyModel) m, float cos_theta, float gamma, float cos_gamma) {
  vec3 up = vec3(1.0f) + vec3(m.a) * exp(vec3(m.b) / max(cos_theta, 1e-3f));
  return up * (vec3(1.0f) + vec3(m.c) * exp(vec3(m.d) * gamma) + vec3(m.e) * (cos_gamma * cos_gamma));
}

/* Of the air alone, for a direction at or above the horizon. */
SHARED vec3 sky_above(SHARED_IN(SkyModel) m, vec3 direction) {
  float cos_gamma = clamp(dot(direction, vec3(m.sun)), -1.0f, 1.0f);
  vec3 c = vec3(m.zenith) * sky_perez(m, direction.y, acos(cos_gamma), cos_gamma);
  return rgb_from_Yxy(max(c, vec3(0.0f))) + vec3(m.glow);
}

/* What lights surfaces: the air, and the ground below the horizon. */
SHARED vec3 sky_model_radiance(SHARED_IN(SkyModel) m, vec3 direction) {
  if (direction.y >= 0.0f) return sky_above(m, direction);
  vec3 level = vec3(direction.x, 0.0f, direction.z);
  float square = dot(level, level);
  vec3 haze = square > 1e-12f ? sky_above(m, level / sqrt(square)) : vec3(m.ground);
  return mix(haze, vec3(m.ground), sky_ground_share(direction.y));
}

/* source: Mark Jarzynski, Marc Olano. Hash Functions for GPU Rendering. 2020 (pcg) */
SHARED uint sky_hash(uint v) {
  uint state = v * 747796405u + 2891336453u;
  uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
  return (word >> 22u) ^ word;
}

/* Stars, of which each cell of a cube around the sky has one at most; 1 for the brightest. Their number grows fourfold
 * with each halving of brightness, near what a uniform space would show; each fills 1.6 mrad with a smooth spot. */
SHARED float sky_stars(vec3 q) {
  const float kCells = 56.0f, kRadius = 1.6e-3f;
  vec3 size = abs(q);
  int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
  float depth = size[axis];
  vec2 at = vec2(q[axis == 0 ? 1 : 0], q[axis == 2 ? 1 : 2]) / depth;
  vec2 cell = floor((at + 1.0f) * (0.5f * kCells));
  uint face = uint(axis) * 2u + (q[axis] > 0.0f ? 1u : 0u);
  uint h = sky_hash(uint(cell.x) + 64u * (uint(cell.y) + 64u * face));
  float rank = float(h & 0xffffu) / 65536.0f;
  if (rank > 0.4f) return 0.0f;
  uint g = sky_hash(h);
  vec2 within = vec2(float(g & 0xffffu), float(g >> 16)) / 65536.0f * 0.6f + 0.2f;
  vec2 star = (cell + within) * (2.0f / kCells) - 1.0f;
  vec3 towards = vec3(0.0f);
  towards[axis] = q[axis] > 0.0f ? 1.0f : -1.0f;
  towards[axis == 0 ? 1 : 0] = star.x;
  towards[axis == 2 ? 1 : 2] = star.y;
  vec3 off = q - normalize(towards);
  float distance = dot(off, off) / (kRadius * kRadius);
  if (distance >= 1.0f) return 0.0f;
  float spot = 1.0f - distance;
  /* N(> b) grows as b^-3/2; the brightest of some 7500 is 1. */
  float bright = min(pow(7500.0f * rank / 0.4f + 1.0f, -0.6667f), 1.0f);
  return bright * spot * spot;
}

/* Disk of a radius (a chord) around a direction, darker towards its limb by `darkening`. */
SHARED float sky_disk(vec3 direction, vec3 towards, float chord, float darkening) {
  vec3 off = direction - towards;
  float r2 = dot(off, off) / (chord * chord);
  return r2 < 1.0f ? 1.0f - darkening * (1.0f - sqrt(1.0f - r2)) : 0.0f;
}

/* What an eye sees beside sky_model_radiance: stars, and the disks of the sun and the moon. */
SHARED vec3 sky_model_disks(SHARED_IN(SkyModel) m, vec3 direction) {
  vec3 seen = vec3(0.0f);
  if (!(direction.y > 0.0f)) return seen;
  float clear = min(direction.y * 5.0f, 1.0f); /* haze hides what is low */
  if (m.glow.w > 0.0f)
    seen += vec3(m.glow.w * clear *
                 sky_stars(vec3(dot(direction, vec3(m.pole)), dot(direction, vec3(m.equator_a)),
                                dot(direction, vec3(m.equator_b)))));
  /* The limb's darkening of the sun in visible light is 0.6 (Allen. Astrophysical Quantities. 1973). */
  if (m.sun.w > 0.0f) seen += vec3(m.sun_disk) * sky_disk(direction, vec3(m.sun), m.sun_disk.w, 0.6f);
  if (m.moon.w > 0.0f) seen += vec3(m.moon_disk) * sky_disk(direction, vec3(m.moon), m.moon_disk.w, 0.0f);
  return seen;
}

SHARED_NAMESPACE_END
#endif
