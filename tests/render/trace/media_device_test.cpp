/// The same media on the processor, in double, and on the device, in float: the shared headers, compiled into a compute
/// shader, answer what C++ answers.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/render/gpu/compute.h"
#include "world/media/medium.h"
#include "world/media/medium.shared.h"

#include "every_medium.comp.spv.h"

namespace render {
namespace {

using world::Medium;
using world::Vec3d;
using world::Vec3f;

/// As in every_medium.comp.glsl.
struct Question {
  Vec3f half_extent;
  float scale_height;
  Vec3f normal;
  uint32_t kind;
  Vec3f origin;
  float t0;
  Vec3f direction;
  float t1;
};
static_assert(sizeof(Question) == 64);
using Answer = std::array<float, 4>;  // density, depth, reach of half the depth, exponentials

Medium medium_of(const Question& q, const std::string& kind) {
  Medium m;
  m.kind = kind, m.half_extent = q.half_extent, m.normal = q.normal, m.scale_height = q.scale_height;
  return m;
}

TEST(EveryMediumOnTheDevice, AnswersAsOnTheProcessor) {
  std::vector<std::string> kinds = world::medium_kinds();
  std::erase(kinds, "density_grid");  // no closed form, so not in the list of numbers
  std::mt19937 bits(1);
  const auto in = [&](double low, double high) {
    return static_cast<float>(std::uniform_real_distribution<double>(low, high)(bits));
  };
  const auto in_cube = [&](double size) {
    const float x = in(-size, size), y = in(-size, size), z = in(-size, size);
    return Vec3f(x, y, z);
  };
  std::vector<Question> asked;
  for (uint32_t kind = 0; kind < kinds.size(); ++kind)
    for (int i = 0; i < 4000; ++i) {
      Question q{};
      q.half_extent = Vec3f(3, 5, 2);
      q.scale_height = in(1, 20);
      q.normal = Vec3f(glm::normalize(Vec3d(in_cube(1))));
      q.kind = kind;
      q.origin = in_cube(8);
      q.direction = Vec3f(glm::normalize(Vec3d(in_cube(1))));
      if (i % 10 == 0) q.direction = Vec3f(1, 0, 0);
      if (i % 10 == 1) q.direction.y = i % 4 == 0 ? 1e-5f : -1e-5f;
      q.t0 = in(0, 4), q.t1 = q.t0 + in(0, 12);
      asked.push_back(q);
    }
  auto device = gpu::Device::make({.validation = true});
  ASSERT_TRUE(device.ok()) << device.error().message;
  const std::vector<Answer> answers = compute_answers<Answer>(**device, every_medium_comp_spv, asked);
  std::vector<int> elsewhere(kinds.size());
  for (size_t i = 0; i < asked.size(); ++i) {
    const Question& q = asked[i];
    const Medium m = medium_of(q, kinds[q.kind]);
    const Vec3d origin(q.origin), direction(q.direction);
    const auto shown = [&] { return testing::Message() << kinds[q.kind] << ", question " << i; };
    const double density = world::medium_density(m, origin),
                 depth = world::medium_depth(m, origin, direction, q.t0, q.t1);
    // exp's argument is at most 10 and off by 3 ulp of a float; ends of a span are off by 8 ulp of 20 m.
    const double off_depth = 4e-6 * depth + 2e-5;
    // Rays that graze an ellipsoid, and points on a face, may fall to the other side.
    if (std::abs(answers[i][1] - depth) > off_depth || std::abs(answers[i][0] - density) > 4e-6 * density) {
      ++elsewhere[q.kind];
      EXPECT_NE(q.kind, static_cast<uint32_t>(std::find(kinds.begin(), kinds.end(), "height_fog") - kinds.begin()))
          << shown();
      continue;
    }
    const double seen = double{answers[i][1]};
    const double exponentials = world::shared::beer_lambert(0.25, seen) + world::shared::opacity(0.25 * seen) +
                                world::shared::mean_transmittance(seen);
    EXPECT_NEAR(answers[i][3], exponentials, 1e-6) << shown();
    if (depth < 1e-3) continue;
    const double reach = world::medium_reach(m, origin, direction, q.t0, q.t1, 0.5 * seen);
    if (std::isinf(reach)) continue;
    // t moves by the error of a depth over the density there.
    const double there = world::medium_density(m, origin + reach * direction);
    EXPECT_NEAR(answers[i][2], reach, 2e-5 + 2 * off_depth / there) << shown();
  }
  for (size_t kind = 0; kind < kinds.size(); ++kind) EXPECT_LE(elsewhere[kind], 4) << kinds[kind];
  EXPECT_EQ((*device)->messages(), std::vector<std::string>{});
}

}  // namespace
}  // namespace render
