/* Layers of see-through blocks along a straight ray: what each adds to a pixel and what it lets through.
 *
 * A ray from the eye goes straight on. Where it passes from one block into another, or into or out of air, it meets an
 * interface, which belongs to one of the two blocks: to the one that isn't air, of two to the one with the larger id.
 * The owner's BSDF says what happens there:
 *
 *   dielectric   Fresnel's share is mirrored, the rest passes
 *   thin         a sheet: mirrored and passed by band as render/bsdf/thin.shared.h, the matte share is lit
 *   coverage     the part alpha of it is there and is lit; the rest is a hole
 *
 * Between interfaces a block absorbs: exp(-absorption d), d the exact length of the ray within it.
 *
 * Angles: the eye's direction is known in the eye's medium alone. Each interface is taken as parallel to all before it,
 * so that n sin(angle) is the same in all media (Snell's law through a pile of plates): exact for panes and still
 * water, seen from above and from below, up to total reflection.
 *
 * Media (fog) lie before, between and behind the interfaces: each stretch adds its own light and dims what lies beyond.
 *
 * error   what a straight ray leaves out: the shift by refraction, and light that is reflected more than once
 *         (pareto subject transparency_order: against the ray caster at light_transport=whitted); what media
 *         shine within a block that absorbs is dimmed as though all of it came from the block's far side
 * source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013,
 * sections 14.10.2, 14.10.3
 */
#ifndef LOAM_RENDER_SEE_THROUGH_SHARED_H
#define LOAM_RENDER_SEE_THROUGH_SHARED_H
#include "render/bsdf/fresnel.shared.h"
#include "render/bsdf/thin.shared.h"

SHARED_NAMESPACE(render)

SHARED_CONST uint kSeeThroughDielectric = 0u;
SHARED_CONST uint kSeeThroughThin = 1u;
SHARED_CONST uint kSeeThroughCoverage = 2u;

/* What rays need to know of a block; air is the one with everything at its start: indices of refraction are over that
 * of air. Members of 16 bytes, so that every layout rule places them alike. */
struct SeeThroughBlock {
  vec4 absorption SHARED_INIT(vec4(0, 0, 0, 1));   /* 1/m; w: index of refraction of the inside, 1 for sheets */
  vec4 matte SHARED_INIT(vec4(0));                 /* matte albedo of a sheet; w: kSeeThrough... */
  vec4 transmission SHARED_INIT(vec4(1, 1, 1, 1)); /* of a sheet, by band; w: its index of refraction */
  vec4 emitted SHARED_INIT(vec4(0));               /* radiance of a dielectric's outside; w: coverage */
  ivec4 block SHARED_INIT(ivec4(0));               /* x: its id */
};

/* What an interface does with a ray, by band. */
struct InterfaceShares {
  vec3 passed;   /* of what lies behind */
  vec3 mirrored; /* of what lies in the mirrored direction */
  float matte;   /* part of it that shows a matte surface of the owner */
};

/* exp(-absorption d), d in [0, infinity]: 1 where nothing absorbs, 0 where something does without end. */
SHARED vec3 absorbed_along(vec3 absorption, float d) {
  vec3 left = vec3(1.0f);
  for (int b = 0; b < 3; ++b)
    if (absorption[b] > 0.0f && d > 0.0f) left[b] = exp(-min(absorption[b] * d, 1e30f));
  return left;
}

/* Fresnel's reflectance of the interface from medium n_near into n_far, for a straight ray that starts in n_eye and
 * makes an angle of this cosine with the normal. */
SHARED float parallel_reflectance(float n_eye, float n_near, float n_far, float cosine) {
  if (n_near == n_far) return 0.0f;
  float scaled = n_eye / n_near;
  float squared = 1.0f - scaled * scaled * max((1.0f - cosine) * (1.0f + cosine), 0.0f);
  if (!(squared > 0.0f)) return 1.0f;
  return fresnel_reflectance(min(sqrt(squared), 1.0f), n_far / n_near);
}

SHARED InterfaceShares dielectric_shares(float n_eye, float n_near, float n_far, float cosine) {
  InterfaceShares shares;
  float r = parallel_reflectance(n_eye, n_near, n_far, cosine);
  shares.mirrored = vec3(r);
  shares.passed = vec3(1.0f - r);
  shares.matte = 0.0f;
  return shares;
}

/* cosine: of the ray with the interface's normal, in [0, 1]. */
SHARED InterfaceShares interface_shares(SHARED_IN(SeeThroughBlock) owner, float n_eye, float n_near, float n_far,
                                        float cosine) {
  if (owner.matte.w == float(kSeeThroughDielectric)) return dielectric_shares(n_eye, n_near, n_far, cosine);
  InterfaceShares shares;
  if (owner.matte.w == float(kSeeThroughThin)) {
    BsdfParameters sheet;
    sheet.lambertian = vec3(owner.matte.x, owner.matte.y, owner.matte.z);
    sheet.transmission = vec3(owner.transmission.x, owner.transmission.y, owner.transmission.z);
    sheet.eta = owner.transmission.w;
    ThinShares thin = thin_shares(sheet, vec3(0.0f, cosine, 0.0f), vec3(0.0f, 1.0f, 0.0f));
    shares.mirrored = thin.mirrored;
    shares.passed = thin.passed;
    shares.matte = 1.0f;
    return shares;
  }
  shares.mirrored = vec3(0.0f);
  shares.passed = vec3(1.0f - owner.emitted.w);
  shares.matte = owner.emitted.w;
  return shares;
}

/* --- partial coverage as a mask of samples ------------------------------------------------------------------------
 * A pixel has kCoverageSamples samples. A surface that is there by the part alpha covers about alpha of them, and light
 * from behind comes through those that are left. Which samples:
 *
 *   correlated   the first ones, a pattern that alpha alone fixes, as alpha to coverage of OpenGL 3 and Direct3D 10:
 *                equal surfaces cover the same samples, so two of them hide no more than one
 *   hashed       by a hash of place and depth: surfaces are independent, right in the mean, with noise
 *
 * source  Eric Enderton, Erik Sintorn, Peter Shirley, David Luebke. Stochastic Transparency. 2011; section 14.10.2
 */
SHARED_CONST uint kCoverageExact = 0u;
SHARED_CONST uint kCoverageHashed = 1u;
SHARED_CONST uint kCoverageCorrelated = 2u;
SHARED_CONST uint kCoverageSamples = 16u;
SHARED_CONST uint kCoverageAll = (1u << 16u) - 1u;

SHARED uint coverage_hash(uint a, uint b, uint c) {
  uint h = a * 0x9e3779b1u ^ (b * 0x85ebca6bu + 0x7f4a7c15u) ^ (c * 0xc2b2ae35u + 0x165667b1u);
  h ^= h >> 15u;
  h *= 0x2c1b3c6du;
  h ^= h >> 12u;
  h *= 0x297a2d39u;
  return h ^ (h >> 15u);
}

SHARED uint set_samples(uint mask) {
  uint count = 0u;
  for (uint i = 0u; i < kCoverageSamples; ++i) count += mask >> i & 1u;
  return count;
}

/* Which samples a surface covers. layer: a number of the surface's depth, an integer plane of the grid. */
SHARED uint coverage_mask(uint pattern, float alpha, uint pixel_x, uint pixel_y, uint layer) {
  uint random = coverage_hash(pixel_x, pixel_y, layer);
  float wanted = alpha * float(kCoverageSamples);
  if (pattern == kCoverageCorrelated) {
    uint count = uint(clamp(floor(wanted + 0.5f), 0.0f, float(kCoverageSamples)));
    return (1u << count) - 1u;
  }
  /* The fraction of a sample by chance, so that the mean is alpha. */
  uint count = min(uint(max(floor(wanted + float(random >> 8u) * (1.0f / 16777216.0f)), 0.0f)), kCoverageSamples);
  /* Of all sets of `count` samples one by chance: Floyd's draw. */
  uint mask = 0u;
  for (uint j = kCoverageSamples - count; j < kCoverageSamples; ++j) {
    random = coverage_hash(random, j, 0x51ed270bu);
    uint pick = random % (j + 1u);
    mask |= (mask >> pick & 1u) != 0u ? 1u << j : 1u << pick;
  }
  return mask;
}

/* --- a pixel, front to back -------------------------------------------------------------------------------------- */
struct StraightView {
  vec3 added SHARED_INIT(vec3(0));    /* radiance of the layers so far */
  vec3 through SHARED_INIT(vec3(1));  /* what they let through of the rest */
  uint open SHARED_INIT(0xffffu);     /* samples that no partial coverage hides, where coverage is by samples */
  float t SHARED_INIT(0.0f);          /* m, where the last interface lies */
  vec3 of_media SHARED_INIT(vec3(0)); /* radiance of the media between the eye and the place at hand, if seen alone */
  vec3 counted SHARED_INIT(vec3(0));  /* the part of that before the last interface */
  vec3 arrives SHARED_INIT(vec3(1));  /* share of what is shown at that place that those media let through to the eye */
};

SHARED StraightView start_of_view() {
  StraightView v;
  v.added = vec3(0.0f);
  v.through = vec3(1.0f);
  v.open = kCoverageAll;
  v.t = 0.0f;
  v.of_media = v.counted = vec3(0.0f);
  v.arrives = vec3(1.0f);
  return v;
}

/* What a view has still to see, by band: of all samples. */
SHARED vec3 still_open(SHARED_IN(StraightView) v, uint pattern) {
  return pattern == kCoverageExact || v.open == kCoverageAll
             ? v.through
             : v.through * (float(set_samples(v.open)) * (1.0f / float(kCoverageSamples)));
}

/* The media up to the next interface or to the end: `value` and `added` are what they let through and what they shine
 * of themselves over all of the way from the eye. Before what is met there is told. */
SHARED StraightView met_media(StraightView v, vec3 value, vec3 added) {
  v.of_media = added;
  v.arrives = value;
  return v;
}

/* On to t metres: the block and the media on the way take and add their share. */
SHARED StraightView passed_stretch(StraightView v, vec3 absorption, float t, uint pattern) {
  v.through *= absorbed_along(absorption, t - v.t);
  v.t = t;
  v.added += still_open(v, pattern) * (v.of_media - v.counted);
  v.counted = v.of_media;
  return v;
}

/* Meets an interface at t metres, after absorption in the medium before it.
 *   mirrored   radiance from the mirrored direction
 *   surface    radiance of a matte surface of the owner there, with what it emits
 *   outside    the interface is seen from outside its owner
 *   mask       coverage_mask(), where coverage is by samples */
SHARED StraightView met_interface(StraightView v, SHARED_IN(SeeThroughBlock) owner, InterfaceShares shares,
                                  vec3 absorption, float t, vec3 mirrored, vec3 surface, bool outside, uint pattern,
                                  uint mask) {
  v = passed_stretch(v, absorption, t, pattern);
  vec3 shown = shares.mirrored * mirrored + shares.matte * surface;
  float there = owner.emitted.w;
  if (outside && shares.matte == 0.0f) shown += vec3(owner.emitted.x, owner.emitted.y, owner.emitted.z);
  shown *= v.arrives;
  if (pattern != kCoverageExact && owner.matte.w == float(kSeeThroughCoverage)) {
    uint covered = v.open & mask;
    if (there > 0.0f)
      v.added += v.through * shown * (float(set_samples(covered)) * (1.0f / float(kCoverageSamples)) / there);
    v.open &= ~mask;
    return v;
  }
  v.added += still_open(v, pattern) * shown;
  v.through *= shares.passed;
  return v;
}

/* Radiance that enters a denser medium is spread over a smaller solid angle: what ends a ray in n_end is seen from
 * n_eye by this factor (Veach 1997, section 5.2; the factors of the interfaces between cancel). */
SHARED float radiance_scale(float n_eye, float n_end) { return n_eye * n_eye / (n_end * n_end); }

/* All of the pixel: `behind` is the radiance of what ends the ray at t, in the medium `last`. */
SHARED vec3 end_of_view(StraightView v, SHARED_IN(SeeThroughBlock) last, float n_eye, float t, vec3 behind,
                        uint pattern) {
  v = passed_stretch(v, vec3(last.absorption.x, last.absorption.y, last.absorption.z), t, pattern);
  return v.added + still_open(v, pattern) * (behind * v.arrives * radiance_scale(n_eye, last.absorption.w));
}

SHARED_NAMESPACE_END

#endif
