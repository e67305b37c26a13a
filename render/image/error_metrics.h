/// How far a picture is from a reference of the same size.
///
/// Two kinds of numbers:
///   of the values themselves: mse, rel_mse, trimmed_rel_mse, smape, bias, worst. The values are linear radiance, or
///   for
///     8-bit pictures code / 255.
///   as shown on a display: psnr, ssim, flip, fraction_within_1. Radiance is first turned into 8 bits by display_image
///   at
///     0 EV.
/// Means run over all pixels and channels. Pixels where either picture is infinite or NaN are counted in not_finite and
/// left out of the first kind, except of `worst`.
/// The same numbers for any count of threads.
#pragma once

#include <array>
#include <cstdint>

#include "render/image/flip.h"
#include "render/image/image.h"

namespace render {

struct WorstPixel {
  int x = 0, y = 0;
  std::array<float, 3> a{}, b{};  // radiance, or codes 0..255
  double difference = 0;  // the largest of the three channels, in the same unit; infinite where one is not finite
};

/// a is judged, b is the reference.
struct ErrorMetrics {
  double mse = 0;                // mean (a-b)^2
  double rel_mse = 0;            // mean (a-b)^2 / (b^2 + e), e = 0.01 (mean b)^2; NaN where b is black
  double trimmed_rel_mse = 0;    // the same without the largest hundredth of the pixels: fireflies don't count
  double smape = 0;              // mean 2 |a-b| / (|a| + |b|), 0 where both are 0; 0..2
  double bias = 0;               // (mean a - mean b) / mean b; NaN where b is black
  double psnr = 0;               // dB, 10 log10(1 / mse of code / 255); infinite for equal codes
  double ssim = 0;               // structural similarity, 1 = equal
  double flip = 0;               // mean of flip_map, 0 = equal .. 1
  WorstPixel worst;              // the first of the largest, in row order
  double fraction_within_1 = 0;  // pixels whose codes all differ by at most 1
  bool equal = false;            // the same values everywhere; NaN equals NaN, -0 equals 0
  uint64_t not_finite = 0;       // pixels
};

/// With the map that `flip` is the mean of.
struct ImageComparison {
  ErrorMetrics metrics;
  FlipMap flip;
};

/// Both pictures have the same size, at least one pixel.
ImageComparison compare_images(const Image& a, const Image& b, FlipViewing viewing = {});
ImageComparison compare_images(const Image8& a, const Image8& b, FlipViewing viewing = {});

/// Structural similarity of the luma 0.2126 R + 0.7152 G + 0.0722 B of the codes, mean over all pixels whose window of
/// 11x11 (Gaussian, sigma 1.5) lies inside; over all pixels with replicated edges where no window fits.
/// source: Zhou Wang, Alan Bovik, Hamid Sheikh, Eero Simoncelli. Image Quality Assessment: From Error Visibility to
///         Structural Similarity. 2004; K1 = 0.01, K2 = 0.03
double structural_similarity(const Image8& a, const Image8& b);

}  // namespace render
