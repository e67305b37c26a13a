/* Bindings and constants of the shaders that make effects: render/effects/device_chain.h. */
#ifndef LOAM_RENDER_EFFECTS_DEVICE_SHARED_H
#define LOAM_RENDER_EFFECTS_DEVICE_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(render)

SHARED_CONST uint kEffectBindFrame = 0u;   /* uniform EffectFrame */
SHARED_CONST uint kEffectBindPicture = 1u; /* float[] radiance, three of EffectFrame.modes.w numbers a pixel */
SHARED_CONST uint kEffectBindBlurred = 2u; /* float[] levels and lobes of bloom */
SHARED_CONST uint kEffectBindMeter = 3u;   /* uint[kMeterWords] pixels by bucket; bits of the EV; how many not finite */
SHARED_CONST uint kEffectBindFinished = 4u; /* uint[] after all effects: three floats a pixel, or packed */
SHARED_CONST uint kEffectBindings = 5u;

/* Metering: eight buckets an octave of luminance from 2^kDarkestMetered on, ... */
SHARED_CONST int kDarkestMetered = -24, kMeterBuckets = 320;
/* ... and behind their counts: */
SHARED_CONST uint kMeterEv = 320u, kMeterNotFinite = 321u, kMeterWords = 322u;

/* Specialisation constants: of the last pass its effects, tone curve and format (formats.shared.h), of bloom a step's
 * kind, of metering whether it counts or ends. */
SHARED_CONST uint kSpecEffects = 0u, kSpecToneCurve = 1u, kSpecFormat = 2u, kSpecStep = 0u, kSpecResolve = 0u;

/* What the pass that adds a picture to a sum is told. */
struct AddSample {
  uint numbers; /* that it adds, three a pixel */
  uint stride;  /* numbers of a pixel in the picture */
  uint first;   /* 1: the sum begins */
  float weight;
};

SHARED_CONST uint kEffectGroup = 8u; /* squares of 8 x 8 pixels */

SHARED_NAMESPACE_END
#endif
