/* Automatic exposure: the mean of the logarithm of luminance is shown as a middle grey. Over all pixels (log_mean), or
 * over those that are neither among the darkest nor the brightest tenth (histogram), so that a lamp or a dark corner
 * doesn't matter.
 *
 * Pixels are counted by luminance in 320 buckets, eight an octave from 2^-24 to 2^16 W/(m^2 sr), ground under stars to
 * the sun; counts are integers, so that the answer is the same in any order. What is darker than that is not metered.
 *
 * knobs   exposure_mode; exposure_key: the grey; exposure_least, exposure_most: bounds of the stops, which stand in the
 *         place of `exposure`, whatever that is
 * error   a bucket's pixels count at its middle: at most 1/16 octave off each, at most 0.003 where luminance is spread
 * fails   never: no pixel with light adds 0 EV
 * source  Erik Reinhard, Michael Stark, Peter Shirley, James Ferwerda. Photographic Tone Reproduction for Digital
 *         Images. 2002, equations 1, 2, with their key of 0.18 */
#ifndef LOAM_RENDER_EFFECTS_EXPOSURE_SHARED_H
#define LOAM_RENDER_EFFECTS_EXPOSURE_SHARED_H
#include "render/effects/effect.shared.h"

SHARED_NAMESPACE(render)

/* -1: not metered. */
SHARED int meter_bucket(vec3 colour) {
  float bright = luminance(colour);
  /* The bits of a float are its logarithm in pieces; a negative one's and a NaN's are sorted out before. */
  int bucket = bright > 0.0f ? int(float_bits(bright) >> 20u) - ((127 + kDarkestMetered) << 3) : -1;
  return min(max(bucket, -1), kMeterBuckets - 1);
}

SHARED float bucket_log2(int bucket) {
  return float((bucket >> 3) + kDarkestMetered) + log2(1.0f + (float(bucket & 7) + 0.5f) / 8.0f);
}

/* Mean over the buckets, of which each counts with the part of its pixels between the two shares. */
struct MeterSum {
  float seen;   /* pixels in the buckets before */
  float weight; /* of those that count */
  float sum;    /* of their logarithms */
};

SHARED MeterSum meter_add(EFFECT_FRAME MeterSum m, float all, int bucket, float count) {
  float low = max(m.seen, f.meter.x * all), high = min(m.seen + count, (1.0f - f.meter.x) * all);
  float part = max(high - low, 0.0f);
  m.seen += count, m.weight += part, m.sum += part * bucket_log2(bucket);
  return m;
}

/* EV to add. */
SHARED float metered_ev(EFFECT_FRAME MeterSum m) {
  if (!(m.weight > 0.0f)) return 0.0f;
  return min(max(f.meter.y - m.sum / m.weight, f.meter.z), f.meter.w);
}

SHARED vec3 exposure_at(EFFECT_SOURCE EFFECT_UNUSED ivec2 pixel, vec3 colour) { return colour * exp2(EFFECT_METERED); }

SHARED_NAMESPACE_END
#endif
