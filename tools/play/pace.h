/// How large pictures are drawn, and how simply, so that they come often enough on this machine.
///
/// First with fewer pixels, down to half of the window's along each axis; then by cheaper knobs, those first that win
/// most time for what is seen of them; then with fewer pixels again, and at last without shadows of the sun. Sizes come
/// back when there is time for them, knobs don't: what flickers between two looks is worse than either.
///
/// measured on the valley at 640x360, two cores without a GPU, 2026-11-26, ms a picture: as usual 114; without shadows
///          of the sun 75; and without their filters for textures 70; light by faces 50; edges by the rasterizer 45
#pragma once

#include "render/knobs.h"

namespace tools {

constexpr double kPictureAimMs = 33, kSlowMs = 50;

class Pace {
 public:
  double scale() const { return scale_; }
  void set_scale(double scale) { scale_ = scale; }  // chosen by hand
  /// After each picture. True where a step was taken: the next pictures should be drawn by simplify().
  bool took(double ms);
  int steps() const { return steps_; }
  /// By all steps so far. A knob that isn't as usual was chosen, and stays.
  void simplify(render::RenderKnobs& knobs) const;

 private:
  double scale_ = 0.6;
  int steps_ = 0, slow_ = 0;
};

}  // namespace tools
