/// From radiance to the display: exposure, then sRGB in 8 bits. One function for every backend.
#pragma once

#include "render/image/image.h"

namespace render {

/// Radiance that maps to display value 1 at 0 EV: chosen so that a sunlit white wall (albedo 0.8, 560 W/m^2) sits just
/// below white.
constexpr float kWhiteRadiance = 150.0f;

/// sRGB encoding of a linear value; clamps to [0, 1], NaN gives 0. source: IEC 61966-2-1:1999
float srgb_from_linear(float linear);
float linear_from_srgb(float srgb);
/// floor(x * 255 + 1/2) of the encoded value.
Image8 display_image(const Image& image, float exposure_ev);

}  // namespace render
