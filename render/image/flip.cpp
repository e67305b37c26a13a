#include "render/image/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/image/convolve.h"
#include "render/image/display.h"
#include "world/base/errors.h"
#include "world/base/jobs.h"

namespace render {
namespace {

using Vector3 = std::array<float, 3>;
using Matrix3 = std::array<Vector3, 3>;

// CIE XYZ of linear sRGB, and back. source: IEC 61966-2-1:1999, from its primaries and white D65 (0.3127, 0.3290)
constexpr Matrix3 kXyzFromRgb = {{{0.41239080f, 0.35758434f, 0.18048079f},
                                  {0.21263901f, 0.71516868f, 0.07219232f},
                                  {0.01933082f, 0.11919478f, 0.95053215f}}};
constexpr Matrix3 kRgbFromXyz = {{{3.24096994f, -1.53738318f, -0.49861076f},
                                  {-0.96924364f, 1.87596750f, 0.04155506f},
                                  {0.05563008f, -0.20397696f, 1.05697151f}}};
constexpr float row_sum(int i) {
  const Vector3& r = kXyzFromRgb[static_cast<size_t>(i)];
  return r[0] + r[1] + r[2];
}
constexpr Vector3 kWhite = {row_sum(0), row_sum(1), row_sum(2)};

// Contrast sensitivity: sums of a sqrt(pi / b) exp(-pi^2 x^2 / b), x in degrees. Paper, table 1.
struct Term {
  double a, b;
};
constexpr Term kLuminanceTerm = {1, 0.0047}, kRedGreenTerm = {1, 0.0053};
constexpr std::array<Term, 2> kBlueYellowTerms = {{{34.1, 0.04}, {13.5, 0.025}}};
// Colour difference: exponent, and the bend of its map to [0, 1]. Paper, sections 4.1.3 and 5.
constexpr float kColourExponent = 0.7f, kBendAt = 0.4f, kBendTo = 0.95f;
// Feature difference: exponent, and the width of the detector in degrees. Paper, section 4.2.
constexpr float kFeatureExponent = 0.5f;
constexpr double kFeatureDegrees = 0.082;

constexpr int kStripRows = 48;

Vector3 multiply(const Matrix3& m, const Vector3& v) {
  const auto dot = [&](const Vector3& r) { return r[0] * v[0] + r[1] * v[1] + r[2] * v[2]; };
  return {dot(m[0]), dot(m[1]), dot(m[2])};
}

/// All kernels for one viewing distance.
struct Kernels {
  Kernel luminance, red_green;
  std::array<Kernel, 2> blue_yellow;
  std::array<float, 2> blue_yellow_weight;
  Kernel gauss, edge, point;
  int reach = 0;  // the largest radius

  explicit Kernels(double pixels_per_degree) {
    const auto sigma = [&](double b) { return std::sqrt(b / 2) / std::numbers::pi * pixels_per_degree; };
    // Beyond 3 sigma of the widest term the paper cuts all kernels; beyond 7 of their own nothing is left in a float.
    const int cut = static_cast<int>(std::ceil(3 * sigma(kBlueYellowTerms[0].b)));
    const auto kernel = [&](double b) {
      return gaussian_kernel(sigma(b), std::min(cut, static_cast<int>(std::ceil(7 * sigma(b)))));
    };
    luminance = kernel(kLuminanceTerm.b), red_green = kernel(kRedGreenTerm.b);
    double total = 0;
    std::array<double, 2> weight{};
    for (size_t i = 0; i < 2; ++i) {
      const Term& term = kBlueYellowTerms[i];
      blue_yellow[i] = kernel(term.b);
      // The two-dimensional sum of the term: gaussian_kernel has divided by it.
      double sum = 0;
      for (int x = -cut; x <= cut; ++x) sum += std::exp(-0.5 * x * x / (sigma(term.b) * sigma(term.b)));
      weight[i] = term.a * std::sqrt(std::numbers::pi / term.b) * sum * sum;
      total += weight[i];
    }
    for (size_t i = 0; i < 2; ++i) blue_yellow_weight[i] = static_cast<float>(weight[i] / total);

    const double feature_sigma = 0.5 * kFeatureDegrees * pixels_per_degree;
    const int radius = static_cast<int>(std::ceil(3 * feature_sigma));
    gauss = gaussian_kernel(feature_sigma, radius);
    edge = detector(feature_sigma, radius, [](double x) { return -x; });
    point = detector(feature_sigma, radius, [](double x) { return x * x - 1; });
    reach = std::max(cut, radius);
  }

  /// polynomial(x / sigma) times the Gaussian; what is positive sums to 1, what is negative to -1.
  static Kernel detector(double sigma, int radius, double (*polynomial)(double)) {
    std::vector<double> values;
    double positive = 0, negative = 0;
    for (int x = -radius; x <= radius; ++x) {
      const double v = polynomial(x / sigma) * std::exp(-0.5 * x * x / (sigma * sigma));
      values.push_back(v);
      (v > 0 ? positive : negative) += v;
    }
    Kernel kernel{radius, {}};
    for (const double v : values) kernel.taps.push_back(v > 0 ? v / positive : -v / negative);
    return kernel;
  }
};

/// CIELab of n = XYZ / white, with a and b scaled by 0.01 L: the Hunt effect.
Vector3 hunt_lab(const Vector3& n) {
  const auto f = [](float t) {
    constexpr float kDelta = 6.0f / 29.0f;
    return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0f / 29.0f;
  };
  const float fx = f(n[0]), fy = f(n[1]), fz = f(n[2]);
  const float lightness = 116 * fy - 16;
  return {lightness, 0.01f * lightness * 500 * (fx - fy), 0.01f * lightness * 200 * (fy - fz)};
}

Vector3 hunt_lab_of_rgb(const Vector3& rgb) {
  const Vector3 xyz = multiply(kXyzFromRgb, rgb);
  return hunt_lab({xyz[0] / kWhite[0], xyz[1] / kWhite[1], xyz[2] / kWhite[2]});
}

float hyab_power(const Vector3& a, const Vector3& b) {
  const float da = a[1] - b[1], db = a[2] - b[2];
  return std::pow(std::abs(a[0] - b[0]) + std::sqrt(da * da + db * db), kColourExponent);
}

float largest_colour_difference() { return hyab_power(hunt_lab_of_rgb({0, 1, 0}), hunt_lab_of_rgb({0, 0, 1})); }

/// What one picture contributes to one row.
struct RowResult {
  std::vector<Vector3> lab;
  std::vector<float> edge, point;  // lengths of the gradients
};

/// One picture in a strip of rows, filtered along rows.
///
/// With n = XYZ / white, Y Cx Cz are 116 n_y - 16, 500 (n_x - n_y), 200 (n_y - n_z). Filters that sum to 1 commute with
/// these factors and offsets, so n_y, n_x - n_y and n_y - n_z are filtered instead.
class FilteredStrip {
 public:
  FilteredStrip(const Image8& image, const Kernels& kernels, const std::array<float, 256>& linear, int first, int rows)
      : kernels_(kernels), width_(image.width) {
    const auto strip = [&] { return Strip<float>(image.width, first, rows); };
    Strip<float> y = strip(), x_minus_y = strip(), y_minus_z = strip();
    for (int r = first; r < first + rows; ++r) {
      const int source_row = std::clamp(r, 0, image.height - 1);
      const unsigned char* p = image.pixels.data() + static_cast<size_t>(source_row) * static_cast<size_t>(width_) * 3;
      float *out_y = y.row(r), *out_x = x_minus_y.row(r), *out_z = y_minus_z.row(r);
      for (int i = 0; i < width_; ++i, p += 3) {
        const Vector3 xyz = multiply(kXyzFromRgb, {linear[p[0]], linear[p[1]], linear[p[2]]});
        const float n_y = xyz[1] / kWhite[1];
        out_y[i] = n_y, out_x[i] = xyz[0] / kWhite[0] - n_y, out_z[i] = n_y - xyz[2] / kWhite[2];
      }
    }
    const auto filter = [&](const Strip<float>& in, const Kernel& kernel) {
      Strip<float> out = strip();
      convolve_rows(in, kernel, out);
      return out;
    };
    strips_ = {filter(y, kernels.luminance),
               filter(x_minus_y, kernels.red_green),
               filter(y_minus_z, kernels.blue_yellow[0]),
               filter(y_minus_z, kernels.blue_yellow[1]),
               filter(y, kernels.gauss),
               filter(y, kernels.edge),
               filter(y, kernels.point)};
    for (auto& c : columns_) c.resize(static_cast<size_t>(width_));
  }

  /// Finishes the filters along columns and leaves colours and features of row y.
  void row(int y, RowResult& out) {
    const auto column = [&](int strip, const Kernel& kernel, int target) {
      convolve_column(strips_[static_cast<size_t>(strip)], y, kernel, columns_[static_cast<size_t>(target)].data());
    };
    column(0, kernels_.luminance, 0);
    column(1, kernels_.red_green, 1);
    column(2, kernels_.blue_yellow[0], 2);
    column(3, kernels_.blue_yellow[1], 3);
    column(5, kernels_.gauss, 4);  // edges across rows
    column(4, kernels_.edge, 5);   // and across columns
    column(6, kernels_.gauss, 6);  // points
    column(4, kernels_.point, 7);
    const auto width = static_cast<size_t>(width_);
    out.lab.resize(width), out.edge.resize(width), out.point.resize(width);
    const auto [w0, w1] = kernels_.blue_yellow_weight;
    for (size_t i = 0; i < width; ++i) {
      const float n_y = columns_[0][i];
      const float n_x = n_y + columns_[1][i];
      const float n_z = n_y - (w0 * columns_[2][i] + w1 * columns_[3][i]);
      Vector3 rgb = multiply(kRgbFromXyz, {n_x * kWhite[0], n_y * kWhite[1], n_z * kWhite[2]});
      for (float& c : rgb) c = std::clamp(c, 0.0f, 1.0f);
      out.lab[i] = hunt_lab_of_rgb(rgb);
      out.edge[i] = std::sqrt(columns_[4][i] * columns_[4][i] + columns_[5][i] * columns_[5][i]);
      out.point[i] = std::sqrt(columns_[6][i] * columns_[6][i] + columns_[7][i] * columns_[7][i]);
    }
  }

 private:
  const Kernels& kernels_;
  int width_;
  std::vector<Strip<float>> strips_;
  std::array<std::vector<float>, 8> columns_;
};

float flip_of_pixel(const RowResult& a, const RowResult& b, size_t i, float largest) {
  const float colour = hyab_power(a.lab[i], b.lab[i]);
  const float bend = kBendAt * largest;
  const float colour_error =
      colour < bend ? kBendTo / bend * colour : kBendTo + (colour - bend) / (largest - bend) * (1 - kBendTo);
  const float feature = std::max(std::abs(a.edge[i] - b.edge[i]), std::abs(a.point[i] - b.point[i]));
  const float feature_error = std::pow(feature / std::numbers::sqrt2_v<float>, kFeatureExponent);
  return std::pow(std::min(colour_error, 1.0f), 1 - std::min(feature_error, 1.0f));
}

}  // namespace

FlipMap flip_map(const Image8& a, const Image8& b, FlipViewing viewing) {
  CHECK_EQ(a.width, b.width);
  CHECK_EQ(a.height, b.height);
  FlipMap map{a.width, a.height, std::vector<float>(a.pixels.size() / 3), 0};
  if (map.values.empty()) return map;
  const Kernels kernels(viewing.pixels_per_degree);
  const float largest = largest_colour_difference();
  std::array<float, 256> linear;
  for (int c = 0; c < 256; ++c) linear[static_cast<size_t>(c)] = linear_from_srgb(static_cast<float>(c) / 255.0f);

  const int strips = (a.height + kStripRows - 1) / kStripRows;
  std::vector<double> sums(static_cast<size_t>(strips));
  world::parallel_for(static_cast<size_t>(strips), [&](size_t s) {
    const int first = static_cast<int>(s) * kStripRows, last = std::min(first + kStripRows, a.height);
    const int reach_first = first - kernels.reach, reach_rows = last - first + 2 * kernels.reach;
    FilteredStrip strip_a(a, kernels, linear, reach_first, reach_rows);
    FilteredStrip strip_b(b, kernels, linear, reach_first, reach_rows);
    RowResult row_a, row_b;
    for (int y = first; y < last; ++y) {
      strip_a.row(y, row_a), strip_b.row(y, row_b);
      float* out = map.values.data() + static_cast<size_t>(y) * static_cast<size_t>(a.width);
      for (size_t x = 0; x < static_cast<size_t>(a.width); ++x) {
        out[x] = flip_of_pixel(row_a, row_b, x, largest);
        sums[s] += out[x];
      }
    }
  });
  for (const double s : sums) map.mean += s;
  map.mean /= static_cast<double>(map.values.size());
  return map;
}

Image8 heat_picture(const FlipMap& map) {
  constexpr std::array<Vector3, 6> kStops = {
      {{0, 0, 0}, {0, 0, 255}, {255, 0, 0}, {255, 255, 0}, {255, 255, 255}, {255, 255, 255}}};
  Image8 picture{map.width, map.height, std::vector<unsigned char>(map.values.size() * 3)};
  for (size_t i = 0; i < map.values.size(); ++i) {
    const float position = std::clamp(map.values[i], 0.0f, 1.0f) * 4;
    const auto stop = static_cast<size_t>(position);
    const float part = position - static_cast<float>(stop);
    for (size_t c = 0; c < 3; ++c) {
      const float v = kStops[stop][c] + (kStops[stop + 1][c] - kStops[stop][c]) * part;
      picture.pixels[3 * i + c] = static_cast<unsigned char>(v + 0.5f);
    }
  }
  return picture;
}

}  // namespace render
