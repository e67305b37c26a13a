/// How well a depth buffer knows distances: 16, 24 bits of fixed point or a float, with depth as it is usually
/// projected (far plane at 10 km) and reversed with an infinite far plane, which is what the rasterizer has. Near plane
/// 0.05 m. Distances from 1 m to 8 km, evenly in the logarithm; each is projected in float as a vertex shader does,
/// stored, and taken back in double. source  Nathan Reed. Depth Precision Visualized. 2015
#include <cmath>

#include <fmt/format.h>

#include "render/image/framebuffer.h"
#include "tools/bench/benchmark.h"

namespace tools {

void add_subject_depth_format(Registry& registry) {
  Subject subject{.question = "how well does a depth buffer know distances?",
                  .reference = "the distances themselves, in double",
                  .metrics = {"worst error of a distance (relative)", "error at 1 km (m)", "error at 5 km (m)"},
                  .work_unit = "distances",
                  .knob_unit = "bits",
                  .threads = 1};
  subject.settings = [](BenchContext&) -> Result<std::vector<Setting>> {
    using render::PixelBuffer, render::PixelFormat;
    constexpr float kNear = 0.05f, kFar = 1e4f;
    constexpr int kDistances = 4096;
    std::vector<Setting> settings;
    for (const bool reversed : {true, false})
      for (const int bits : {16, 24, 32}) {
        const PixelFormat format = bits == 16 ? PixelFormat::d16 : bits == 24 ? PixelFormat::d24s8 : PixelFormat::d32;
        const auto through = [=](double distance) {
          PixelBuffer buffer(format, 1, 1);
          const auto z = static_cast<float>(distance);
          buffer.set_depth(0, 0, reversed ? kNear / z : kFar / (kFar - kNear) - kFar * kNear / (kFar - kNear) / z);
          const double depth = static_cast<double>(buffer.depth(0, 0));
          const double near = static_cast<double>(kNear), far = static_cast<double>(kFar);
          return reversed ? near / depth : far * near / (far - depth * (far - near));
        };
        const auto distance = [](int i) { return std::pow(8000.0, i / (kDistances - 1.0)); };
        const char* method = reversed ? "reversed" : "usual";
        Setting s{.method = method, .setting = fmt::format("{}@{}", method, bits)};
        s.knob = bits;
        s.is_default = reversed && bits == 32;
        // Depth that is stored as 0 is infinitely far: as wrong as can be, but a number.
        const auto off = [](double got, double is) { return std::isfinite(got) ? std::abs(got - is) : 1e9; };
        s.measure = [=](uint64_t) {
          double worst = 0;
          double at[2] = {};
          for (int i = 0; i < kDistances; ++i) {
            const double d = distance(i);
            worst = std::max(worst, off(through(d), d) / d);
            // The largest around a distance, since one value may fall on a step.
            for (int k = 0; k < 2; ++k)
              if (const double centre = k == 0 ? 1000 : 5000; std::abs(d - centre) < 0.02 * centre)
                at[k] = std::max(at[k], off(through(d), d));
          }
          return ErrorSample{{worst, at[0], at[1]}, 0};
        };
        s.run = [=] {
          double sum = 0;
          for (int i = 0; i < kDistances; ++i) sum += through(distance(i));
          keep(sum);
          return double{kDistances};
        };
        settings.push_back(std::move(s));
      }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
