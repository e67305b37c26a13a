/// How an eye takes to the dark: the exposure of the window's pictures beside their knobs.
///
/// By day it does nothing. At night it opens as the darker half of the picture asks for, at most as far as the sky has
/// darkened since noon, and never so far that what lamps light is white: so lamps are seen as lamps, and turned away
/// from them the moon is enough.
///
/// source James Ferwerda, Sumanta Pattanaik, Peter Shirley, Donald Greenberg. A Model of Visual Adaptation for
///        Realistic Image Synthesis. 1996 (that it adapts within limits, and over time; the constants here are by eye,
///        on the valley at night, 2026-11-26)
#pragma once

#include "render/image/image.h"
#include "render/sky_view.h"

namespace tools {

/// Stops by which the sky lights a level surface less than a sun at noon, up to `most`; 0 by day, and where no time of
/// day is set.
double stops_of_night(const render::SkyView& sky, double most);

class Eye {
 public:
  /// Stops for a picture of that radiance; `exposure_ev` as the knob has it. Moves towards what it would like within a
  /// second or so, at once on the first picture.
  double adapt(const render::Image& image, double exposure_ev, double most_ev, double now_s);

 private:
  double ev_ = 0, last_s_ = -1;
};

}  // namespace tools
