/// Convolution by a product of two short kernels, one along rows and one along columns, for error metrics. Works on a
/// strip of rows at a time, so memory stays small and strips are independent. Edges are replicated.
#pragma once

#include <cstddef>
#include <vector>

namespace render {

/// Taps at -radius .. radius.
struct Kernel {
  int radius = 0;
  std::vector<double> taps = {1};
};

/// exp(-x^2 / (2 sigma^2)) at whole x, scaled to a sum of 1.
Kernel gaussian_kernel(double sigma, int radius);

/// `rows` rows of one number a pixel. The row y of the picture is row y - first_row.
template <class Number>
struct Strip {
  int width = 0, first_row = 0, rows = 0;
  std::vector<Number> values;

  Strip(int w, int first, int count)
      : width(w), first_row(first), rows(count), values(static_cast<size_t>(w) * static_cast<size_t>(count)) {}
  Number* row(int y) { return values.data() + static_cast<size_t>(y - first_row) * static_cast<size_t>(width); }
  const Number* row(int y) const {
    return values.data() + static_cast<size_t>(y - first_row) * static_cast<size_t>(width);
  }
};

/// Along each row. Number is float or double.
template <class Number>
void convolve_rows(const Strip<Number>& in, const Kernel& kernel, Strip<Number>& out);
/// Row y of the result, from rows y - radius .. y + radius, which the strip must hold: strips reach beyond the picture
/// with replicated rows.
template <class Number>
void convolve_column(const Strip<Number>& in, int y, const Kernel& kernel, Number* out);

}  // namespace render
