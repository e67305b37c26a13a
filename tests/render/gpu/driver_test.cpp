/// What Loam takes of a driver for granted: how near its functions are, and what a read beyond a buffer's end gives.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "render/gpu/device.h"
#include "tests/render/gpu/compute.h"
#include "tests/render/gpu/gpu_assisted.h"
#include "world/base/random.h"

#include "beyond.comp.spv.h"
#include "elementary.comp.spv.h"

namespace render {
namespace {

std::unique_ptr<gpu::Device> device() {
  auto made = gpu::Device::make({.validation = true});
  EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().message);
  return made.ok() ? std::move(*made) : nullptr;
}

// --- hard case R17 --------------------------------------------------------------------------------------------------

struct Asked {
  uint32_t function;
  float x, y = 1;
};

double ulp(double value) {
  const float size = std::max(std::abs(static_cast<float>(value)), std::numeric_limits<float>::min());
  return double{std::nextafter(size, std::numeric_limits<float>::infinity())} - double{size};
}
double log_bound(double value, double x) { return x >= 0.5 && x <= 2 ? std::exp2(-21) : 3 * ulp(value); }
double exp_bound(double value, double x) { return (3 + 2 * std::abs(x)) * ulp(value); }

/// A function of the device, what it is, and how far the specification lets it be from that.
/// source: Khronos Group. Vulkan 1.3 Specification, Precision and Operation of SPIR-V Instructions
struct Function {
  const char* name;
  double low, high;  // of x; where low > 0 they are spread by their logarithms
  bool takes_two;    // y from 0.25 to 4
  double (*exactly)(double x, double y);
  double (*bound)(double value, double x, double y);
};
const Function kFunctions[] = {
    {"x / y", 1e-6, 1e6, true, [](double x, double y) { return x / y; },
     [](double v, double, double) { return 2.5 * ulp(v); }},
    {"inversesqrt", 1e-6, 1e6, false, [](double x, double) { return 1 / std::sqrt(x); },
     [](double v, double, double) { return 2 * ulp(v); }},
    // As 1.0 / inversesqrt(): both errors, as parts of the value, where an ulp is at most twice another.
    {"sqrt", 1e-6, 1e6, false, [](double x, double) { return std::sqrt(x); },
     [](double v, double, double) { return (2 * 2 + 2.5) * ulp(v); }},
    {"exp", -20, 20, false, [](double x, double) { return std::exp(x); },
     [](double v, double x, double) { return exp_bound(v, x); }},
    {"exp2", -20, 20, false, [](double x, double) { return std::exp2(x); },
     [](double v, double x, double) { return exp_bound(v, x); }},
    {"log", 1e-6, 1e6, false, [](double x, double) { return std::log(x); },
     [](double v, double x, double) { return log_bound(v, x); }},
    {"log2", 1e-6, 1e6, false, [](double x, double) { return std::log2(x); },
     [](double v, double x, double) { return log_bound(v, x); }},
    // As exp2(y * log2(x)).
    {"pow", 1e-3, 1e3, true, [](double x, double y) { return std::pow(x, y); },
     [](double v, double x, double y) {
       const double exponent = y * std::log2(x);
       const double off = y * log_bound(std::log2(x), x) + 0.5 * ulp(exponent);
       return exp_bound(v, exponent) + v * (std::exp2(off) - 1);
     }},
    {"sin", -3.1415925, 3.1415925, false, [](double x, double) { return std::sin(x); },
     [](double, double, double) { return std::exp2(-11); }},
    {"cos", -3.1415925, 3.1415925, false, [](double x, double) { return std::cos(x); },
     [](double, double, double) { return std::exp2(-11); }},
};

TEST(HardCaseR17, FunctionsOfTheDeviceAreAsNearAsTheSpecificationPromises) {
  constexpr int kEach = 4096;
  std::vector<Asked> asked;
  for (uint32_t f = 0; f < std::size(kFunctions); ++f)
    for (uint64_t i = 0; i < kEach; ++i) {
      const Function& function = kFunctions[f];
      const double share = world::uniform01_double(world::hash_combine(f, 2 * i));
      const bool by_logarithm = function.low > 0;
      const double x = by_logarithm ? function.low * std::pow(function.high / function.low, share)
                                    : function.low + share * (function.high - function.low);
      const double y = 0.25 * std::pow(16, world::uniform01_double(world::hash_combine(f, 2 * i + 1)));
      asked.push_back({f, static_cast<float>(x), function.takes_two ? static_cast<float>(y) : 1});
    }
  const auto d = device();
  ASSERT_TRUE(d);
  const std::vector<float> answers = compute_answers<float>(*d, elementary_comp_spv, asked);
  double worst[std::size(kFunctions)] = {};
  for (size_t i = 0; i < asked.size(); ++i) {
    const Function& function = kFunctions[asked[i].function];
    const double x = asked[i].x, y = asked[i].y, exact = function.exactly(x, y);
    const double off = std::abs(double{answers[i]} - exact) / function.bound(exact, x, y);
    // The answer is a float: nearer than half a step there is none.
    EXPECT_LE(off, 1 + 0.5 * ulp(exact) / function.bound(exact, x, y)) << function.name << " of " << x << ", " << y;
    worst[asked[i].function] = std::max(worst[asked[i].function], off);
  }
  for (size_t f = 0; f < std::size(kFunctions); ++f)
    std::printf("  %-12s at worst %.3f of what it may be off\n", kFunctions[f].name, worst[f]);
  EXPECT_EQ(d->messages(), std::vector<std::string>{});
}

// --- hard case R15 --------------------------------------------------------------------------------------------------

/// 64 places, every other one beyond the end.
std::vector<uint32_t> places() {
  std::vector<uint32_t> all;
  for (uint32_t i = 0; i < 64; ++i) all.push_back(i % 2 ? i : 1000 + i);
  return all;
}

TEST(HardCaseR15, AReadBeyondABuffersEndIsZero) {
  const auto d = device();
  ASSERT_TRUE(d);
  const std::vector<uint32_t> asked = places();
  const std::vector<float> answers = compute_answers<float>(*d, beyond_comp_spv, asked);
  for (uint32_t i = 0; i < 64; ++i) EXPECT_EQ(answers[i], i % 2 ? static_cast<float>(i) : 0) << i;
}

TEST(HardCaseR15, GpuAssistedValidationHearsAReadBeyondABuffersEnd) {
  const GpuAssisted assisted;
  const auto d = device();
  ASSERT_TRUE(d);
  compute_answers<float>(*d, beyond_comp_spv, places());
  ASSERT_FALSE(d->messages().empty());
  EXPECT_NE(d->messages()[0].find("out of bounds"), std::string::npos) << d->messages()[0];
}

}  // namespace
}  // namespace render
