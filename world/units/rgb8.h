/// Colours of 8 bits a band, as files and displays have them: sRGB, as 0xRRGGBB.
#pragma once

#include <cstdint>

#include "world/units/quantity.h"

namespace world {

/// source IEC 61966-2-1
Ratio3 linear_from_rgb8(uint32_t rgb);
/// The nearest; bands below 0 and above 1 become 0 and 255.
uint32_t rgb8_from_linear(const Ratio3& linear);

}  // namespace world
