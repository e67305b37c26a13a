/// FLIP: how strongly a person sees the difference when two pictures alternate on the screen.
///
/// source: Pontus Andersson, Jim Nilsson, Tomas Akenine-Moeller, Magnus Oskarsson, Kalle Astroem, Mark D. Fairchild.
///         FLIP: A Difference Evaluator for Alternating Images. 2020 (the LDR form)
///   colour   to Y Cx Cz, blurred by the eye's contrast sensitivity (a sum of Gaussians for each channel), to CIELab
///   with
///            the Hunt effect, HyAB distance to the power 0.7, mapped to [0, 1]: up to 0.4 of the largest possible
///            distance (green against blue) to [0, 0.95], the rest above
///   feature  edges and points of the luminance: first and second derivatives of a Gaussian, the larger difference
///   result   colour ^ (1 - feature), in [0, 1] for each pixel
/// Edges of the picture are replicated. Symmetric; 0 exactly where the surroundings are equal.
/// cost: 1280x720 in 0.1 to 0.2 s on two threads.
#pragma once

#include <vector>

#include "render/image/image.h"

namespace render {

struct FlipViewing {
  double pixels_per_degree =
      67.0206;  // the paper's: 0.7 m from a screen 0.7 m wide with 3840 pixels; 0.7*3840/0.7*pi/180
};

struct FlipMap {
  int width = 0, height = 0;
  std::vector<float> values;  // 0 = no visible difference .. 1, rows from the top
  double mean = 0;
};

/// Both pictures have the same size.
FlipMap flip_map(const Image8& a, const Image8& b, FlipViewing viewing = {});

/// As a picture: black, blue, red, yellow, white for 0, 1/4, 1/2, 3/4, 1.
Image8 heat_picture(const FlipMap& map);

}  // namespace render
