#include "render/image/error_metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "render/image/convolve.h"
#include "render/image/display.h"
#include "world/base/errors.h"
#include "world/base/jobs.h"

namespace render {
namespace {

constexpr size_t kGrain = 1 << 15;  // pixels in one partial sum: fixed, so that sums don't depend on threads
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Pixel = std::array<float, 3>;

/// Sums over pixels; doubles hold the sums of 2^27 pixels to 1e-15 of their size a term.
struct Sums {
  double a = 0, b = 0, squared = 0, relative = 0, smape = 0;
  uint64_t finite = 0;
  bool equal = true;
  WorstPixel worst;
  size_t worst_index = 0;

  friend Sums operator+(Sums x, const Sums& y) {
    x.a += y.a, x.b += y.b, x.squared += y.squared, x.relative += y.relative, x.smape += y.smape;
    x.finite += y.finite, x.equal = x.equal && y.equal;
    if (y.worst.difference > x.worst.difference) x.worst = y.worst, x.worst_index = y.worst_index;
    return x;
  }
};

bool is_finite(const Pixel& p) { return std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]); }
bool same(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

double largest_difference(const Pixel& a, const Pixel& b) {
  double largest = 0;
  for (size_t c = 0; c < 3; ++c) {
    if (same(a[c], b[c])) continue;
    const double d = std::abs(static_cast<double>(a[c]) - b[c]);
    largest = std::max(largest, std::isnan(d) ? kInfinity : d);
  }
  return largest;
}

/// The metrics of the values; `pixel(image, i)` gives the three channels.
template <class Picture, class PixelOf>
void compare_values(const Picture& a, const Picture& b, PixelOf pixel, ErrorMetrics& out) {
  const size_t count = static_cast<size_t>(a.width) * static_cast<size_t>(a.height);
  const auto add = [](const Sums& x, const Sums& y) { return x + y; };

  // First the plain sums: the mean of the reference is needed for the relative error.
  const Sums plain = world::ordered_reduce(
      count, kGrain, Sums{},
      [&](size_t begin, size_t end) {
        Sums s;
        for (size_t i = begin; i < end; ++i) {
          const Pixel x = pixel(a, i), y = pixel(b, i);
          const double difference = largest_difference(x, y);
          s.equal = s.equal && difference == 0;
          if (difference > s.worst.difference) s.worst.difference = difference, s.worst_index = i;
          if (!is_finite(x) || !is_finite(y)) continue;
          ++s.finite;
          for (size_t c = 0; c < 3; ++c) {
            const double u = x[c], v = y[c], d = u - v, size = std::abs(u) + std::abs(v);
            s.a += u, s.b += v, s.squared += d * d;
            s.smape += size > 0 ? 2 * std::abs(d) / size : 0;
          }
        }
        return s;
      },
      add);

  const double values = 3 * static_cast<double>(plain.finite);
  out.equal = plain.equal;
  out.not_finite = count - plain.finite;
  out.mse = plain.squared / values;
  out.smape = plain.smape / values;
  out.bias = plain.b != 0 ? (plain.a - plain.b) / plain.b : kNan;
  out.worst = plain.worst;
  out.worst.x = static_cast<int>(plain.worst_index % static_cast<size_t>(a.width));
  out.worst.y = static_cast<int>(plain.worst_index / static_cast<size_t>(a.width));
  out.worst.a = pixel(a, plain.worst_index), out.worst.b = pixel(b, plain.worst_index);

  const double mean_b = plain.b / values;
  const double offset = 0.01 * mean_b * mean_b;
  if (!(offset > 0)) {
    out.rel_mse = out.trimmed_rel_mse = kNan;
    return;
  }
  std::vector<double> relative(count);
  const Sums sums = world::ordered_reduce(
      count, kGrain, Sums{},
      [&](size_t begin, size_t end) {
        Sums s;
        for (size_t i = begin; i < end; ++i) {
          const Pixel x = pixel(a, i), y = pixel(b, i);
          if (!is_finite(x) || !is_finite(y)) continue;
          double of_pixel = 0;
          for (size_t c = 0; c < 3; ++c) {
            const double v = y[c], d = x[c] - v;
            of_pixel += d * d / (v * v + offset);
          }
          relative[i] = of_pixel / 3;
          s.relative += of_pixel;
        }
        return s;
      },
      add);
  out.rel_mse = sums.relative / values;

  // Pixels that are not finite hold 0 and stay among those kept, so they must not count.
  const size_t dropped = plain.finite / 100, kept = count - dropped;
  if (dropped > 0) {
    std::nth_element(relative.begin(), relative.begin() + static_cast<std::ptrdiff_t>(kept), relative.end());
  }
  double sum = 0;
  for (size_t i = 0; i < kept; ++i) sum += relative[i];
  out.trimmed_rel_mse = sum / static_cast<double>(plain.finite - dropped);
}

/// The metrics of what a display shows.
FlipMap compare_shown(const Image8& a, const Image8& b, FlipViewing viewing, ErrorMetrics& out) {
  uint64_t squared = 0;  // exact
  size_t within = 0;
  for (size_t i = 0; i < a.pixels.size(); i += 3) {
    int largest = 0;
    for (size_t c = 0; c < 3; ++c) {
      const int d = std::abs(a.pixels[i + c] - b.pixels[i + c]);
      squared += static_cast<uint64_t>(d * d);
      largest = std::max(largest, d);
    }
    within += largest <= 1 ? 1 : 0;
  }
  const double mse = static_cast<double>(squared) / (255.0 * 255.0 * static_cast<double>(a.pixels.size()));
  out.psnr = squared ? -10 * std::log10(mse) : kInfinity;
  out.fraction_within_1 = static_cast<double>(within) / static_cast<double>(a.pixels.size() / 3);
  out.ssim = structural_similarity(a, b);
  FlipMap flip = flip_map(a, b, viewing);
  out.flip = flip.mean;
  return flip;
}

template <class Picture>
void check_sizes(const Picture& a, const Picture& b) {
  CHECK_EQ(a.width, b.width);
  CHECK_EQ(a.height, b.height);
  CHECK(a.width > 0 && a.height > 0 && a.pixels.size() == b.pixels.size());
}

}  // namespace

double structural_similarity(const Image8& a, const Image8& b) {
  constexpr int kRadius = 5, kStripRows = 64;
  constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;
  check_sizes(a, b);
  const Kernel kernel = gaussian_kernel(1.5, kRadius);
  const bool fits = a.width > 2 * kRadius && a.height > 2 * kRadius;
  const int margin = fits ? kRadius : 0;

  const int strips = (a.height + kStripRows - 1) / kStripRows;
  std::vector<double> sums(static_cast<size_t>(strips));
  world::parallel_for(static_cast<size_t>(strips), [&](size_t s) {
    const int first = static_cast<int>(s) * kStripRows, last = std::min(first + kStripRows, a.height);
    const auto strip = [&] { return Strip<double>(a.width, first - kRadius, last - first + 2 * kRadius); };
    // The five moments: a, b, a^2, b^2, ab; in double, because variances are small differences of them.
    std::vector<Strip<double>> moments(5, strip()), filtered(5, strip());
    for (int y = first - kRadius; y < last + kRadius; ++y) {
      const size_t row = static_cast<size_t>(std::clamp(y, 0, a.height - 1)) * static_cast<size_t>(a.width) * 3;
      for (int x = 0; x < a.width; ++x) {
        const auto luma = [&](const Image8& image) {
          const unsigned char* p = image.pixels.data() + row + static_cast<size_t>(x) * 3;
          return (0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]) / 255;
        };
        const double u = luma(a), v = luma(b);
        moments[0].row(y)[x] = u, moments[1].row(y)[x] = v;
        moments[2].row(y)[x] = u * u, moments[3].row(y)[x] = v * v, moments[4].row(y)[x] = u * v;
      }
    }
    std::array<std::vector<double>, 5> m;
    for (size_t i = 0; i < 5; ++i) {
      convolve_rows(moments[i], kernel, filtered[i]);
      m[i].resize(static_cast<size_t>(a.width));
    }
    for (int y = std::max(first, margin); y < std::min(last, a.height - margin); ++y) {
      for (size_t i = 0; i < 5; ++i) convolve_column(filtered[i], y, kernel, m[i].data());
      for (auto x = static_cast<size_t>(margin); x < static_cast<size_t>(a.width - margin); ++x) {
        const double aa = m[0][x] * m[0][x], bb = m[1][x] * m[1][x], ab = m[0][x] * m[1][x];
        const double variances = (m[2][x] - aa) + (m[3][x] - bb), covariance = m[4][x] - ab;
        sums[s] += ((2 * ab + kC1) * (2 * covariance + kC2)) / ((aa + bb + kC1) * (variances + kC2));
      }
    }
  });
  double sum = 0;
  for (const double s : sums) sum += s;
  return sum / (static_cast<double>(a.width - 2 * margin) * (a.height - 2 * margin));
}

ImageComparison compare_images(const Image& a, const Image& b, FlipViewing viewing) {
  check_sizes(a, b);
  ImageComparison result;
  const auto pixel = [](const Image& image, size_t i) {
    return Pixel{image.pixels[i].r, image.pixels[i].g, image.pixels[i].b};
  };
  compare_values(a, b, pixel, result.metrics);
  result.flip = compare_shown(display_image(a, 0), display_image(b, 0), viewing, result.metrics);
  return result;
}

ImageComparison compare_images(const Image8& a, const Image8& b, FlipViewing viewing) {
  check_sizes(a, b);
  ImageComparison result;
  const auto pixel = [](const Image8& image, size_t i) {
    const unsigned char* p = image.pixels.data() + 3 * i;
    return Pixel{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
  };
  // Codes are exact in float; dividing the results is the same as dividing the codes, but exact where they are equal.
  compare_values(a, b, pixel, result.metrics);
  result.metrics.mse /= 255.0 * 255.0;
  result.flip = compare_shown(a, b, viewing, result.metrics);
  return result;
}

}  // namespace render
