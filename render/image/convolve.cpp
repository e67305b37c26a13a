#include "render/image/convolve.h"

#include <algorithm>
#include <cmath>

namespace render {
namespace {

constexpr int kBlock = 16;  // pixels summed in registers

}  // namespace

Kernel gaussian_kernel(double sigma, int radius) {
  std::vector<double> values;
  double sum = 0;
  for (int x = -radius; x <= radius; ++x) {
    values.push_back(std::exp(-0.5 * x * x / (sigma * sigma)));
    sum += values.back();
  }
  Kernel kernel{radius, {}};
  for (const double v : values) kernel.taps.push_back(v / sum);
  return kernel;
}

template <class Number>
void convolve_rows(const Strip<Number>& in, const Kernel& kernel, Strip<Number>& out) {
  const int radius = kernel.radius, taps = 2 * radius + 1;
  // One row with replicated ends, rounded up to whole blocks.
  const int blocks = (in.width + kBlock - 1) / kBlock;
  std::vector<Number> padded(static_cast<size_t>(blocks * kBlock + 2 * radius));
  for (int y = in.first_row; y < in.first_row + in.rows; ++y) {
    const Number* source = in.row(y);
    std::fill_n(padded.begin(), radius, source[0]);
    std::copy_n(source, in.width, padded.begin() + radius);
    std::fill(padded.begin() + radius + in.width, padded.end(), source[in.width - 1]);
    Number* target = out.row(y);
    for (int b = 0; b < blocks; ++b) {
      Number sums[kBlock] = {};
      for (int t = 0; t < taps; ++t) {
        const Number* p = padded.data() + b * kBlock + t;
        const auto k = static_cast<Number>(kernel.taps[static_cast<size_t>(t)]);
        for (int i = 0; i < kBlock; ++i) sums[i] += k * p[i];
      }
      std::copy_n(sums, std::min(kBlock, in.width - b * kBlock), target + b * kBlock);
    }
  }
}

template <class Number>
void convolve_column(const Strip<Number>& in, int y, const Kernel& kernel, Number* out) {
  const int taps = 2 * kernel.radius + 1;
  const auto stride = static_cast<size_t>(in.width);
  const Number* top = in.row(y - kernel.radius);
  int x = 0;
  for (; x + kBlock <= in.width; x += kBlock) {
    Number sums[kBlock] = {};
    for (int t = 0; t < taps; ++t) {
      const Number* p = top + static_cast<size_t>(t) * stride + x;
      const auto k = static_cast<Number>(kernel.taps[static_cast<size_t>(t)]);
      for (int i = 0; i < kBlock; ++i) sums[i] += k * p[i];
    }
    std::copy_n(sums, kBlock, out + x);
  }
  for (; x < in.width; ++x) {
    Number sum = 0;
    for (int t = 0; t < taps; ++t) {
      sum += static_cast<Number>(kernel.taps[static_cast<size_t>(t)]) * top[static_cast<size_t>(t) * stride + x];
    }
    out[x] = sum;
  }
}

template void convolve_rows(const Strip<float>&, const Kernel&, Strip<float>&);
template void convolve_rows(const Strip<double>&, const Kernel&, Strip<double>&);
template void convolve_column(const Strip<float>&, int, const Kernel&, float*);
template void convolve_column(const Strip<double>&, int, const Kernel&, double*);

}  // namespace render
