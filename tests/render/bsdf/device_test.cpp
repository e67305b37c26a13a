/// The same BSDFs on the processor and on the device: the shared headers, compiled into a compute shader, answer what
/// the C++ table answers.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "render/bsdf/blinn_phong.shared.h"
#include "render/bsdf/bsdf.h"
#include "tests/render/gpu/compute.h"
#include "world/base/random.h"

#include "every_bsdf.comp.spv.h"

namespace render {
namespace {

/// As in every_bsdf.comp.glsl.
struct Question {
  BsdfParameters parameters;
  Vec3f wi;
  uint32_t bsdf;
  Vec3f wo;
  float reserved0 = 0;
  Vec3f n;
  float reserved1 = 0;
  Vec3f u;
  float reserved2 = 0;
};
static_assert(sizeof(Question) == 128);
static_assert(offsetof(BsdfParameters, gloss) == 60 && offsetof(Question, bsdf) == 76);

constexpr size_t kAnswers = 52;
using Answer = std::array<float, kAnswers>;

struct Field {
  const char* name;
  size_t first, count;
};
constexpr size_t kDrawnIn = 36;
constexpr Field kFields[] = {{"finite density", 0, 3},      {"pdf", 3, 1},
                             {"probability in", 4, 3},      {"probability out", 7, 3},
                             {"incoming impulses", 10, 13}, {"outgoing impulses", 23, 13},
                             {"scatter in", kDrawnIn, 8},   {"scatter out", 44, 8}};

Answer answer(const Question& q) {
  const Bsdf& bsdf = bsdfs()[q.bsdf];
  Answer answers;
  size_t at = 0;
  const auto put = [&](float value) { answers[at++] = value; };
  const auto put3 = [&](Vec3f v) { put(v.x), put(v.y), put(v.z); };
  put3(bsdf.finite_density(q.parameters, q.wi, q.wo, q.n));
  put(bsdf.pdf(q.parameters, q.wi, q.wo, q.n));
  put3(bsdf.probability_in(q.parameters, q.wo, q.n));
  put3(bsdf.probability_out(q.parameters, q.wi, q.n));
  for (const Impulses& impulses :
       {bsdf.incoming_impulses(q.parameters, q.wo, q.n), bsdf.outgoing_impulses(q.parameters, q.wi, q.n)}) {
    put(static_cast<float>(impulses.count));
    for (const Impulse& impulse : impulses.impulse) put3(impulse.direction), put3(impulse.magnitude);
  }
  for (const BsdfSample& drawn :
       {bsdf.scatter_in(q.parameters, q.wo, q.n, q.u), bsdf.scatter_out(q.parameters, q.wi, q.n, q.u)})
    put3(drawn.direction), put3(drawn.weight), put(drawn.pdf), put(drawn.impulse ? 1.0f : 0.0f);
  EXPECT_EQ(at, kAnswers);
  return answers;
}

std::vector<Question> questions() {
  std::vector<Question> all;
  int64_t count = 0;
  const auto unit = [&] { return world::uniform01(world::random_bits(11, ++count, 0, 0)); };
  const auto direction = [&] {
    const float z = 2 * unit() - 1, turn = 6.2831853f * unit(), r = std::sqrt(1 - z * z);
    return glm::normalize(Vec3f(r * std::cos(turn), r * std::sin(turn), z));
  };
  for (uint32_t bsdf = 0; bsdf < bsdfs().size(); ++bsdf)
    for (int i = 0; i < 3000; ++i) {
      Question q{};
      q.bsdf = bsdf;
      BsdfParameters& p = q.parameters;
      p.lambertian = 0.6f * Vec3f(unit(), unit(), unit());
      p.glossy = unit() * (Vec3f(1) - p.lambertian);
      p.smoothness = shared::smoothness_from_shininess(unit());
      p.eta = i % 3 == 0 ? 1.0f : 0.5f + 1.5f * unit();
      p.transmission = unit() * (Vec3f(1) - p.lambertian);
      p.coverage = unit();
      p.gloss = static_cast<uint32_t>(i % 3);
      q.n = i % 2 ? direction() : Vec3f(0, i % 4 ? 1 : -1, 0);
      const auto side = [&](Vec3f w) { return dot(w, q.n) < 0 ? -w : w; };
      q.wo = side(direction());
      // By turns: anywhere, on its side, in the lobe.
      q.wi = i % 5 == 0 ? direction() : side(direction());
      if (i % 5 > 2) q.wi = side(glm::normalize(shared::reflected_direction(q.wo, q.n) + 0.05f * direction()));
      q.u = {unit(), unit(), unit()};
      all.push_back(q);
    }
  return all;
}

TEST(EveryBsdfOnTheDevice, AnswersAsOnTheProcessor) {
  auto device = gpu::Device::make({.validation = true});
  ASSERT_TRUE(device.ok()) << device.error().message;
  const std::vector<Question> asked = questions();
  const std::vector<Answer> answers = compute_answers<Answer>(**device, every_bsdf_comp_spv, asked);
  for (uint32_t bsdf = 0; bsdf < bsdfs().size(); ++bsdf)
    for (const Field& field : kFields) {
      int compared = 0, other_choice = 0;
      double worst = 0;
      std::string where;
      for (size_t i = 0; i < asked.size(); ++i) {
        if (asked[i].bsdf != bsdf) continue;
        const Answer here = answer(asked[i]);
        // Exponentials on the device: (3 + 2 |x|) ulp for e^x, and x up to -88 counts; roots and quotients 3 ulp.
        // Directions' rounding is magnified by a lobe's slope, sqrt(s) for those drawn; and turns the half vector by
        // as much over the length of the two directions' sum, which is short where both graze the surface.
        double sum = 1;
        if (const bool impulse = here[field.first + 7] != 0; field.first >= kDrawnIn && !impulse) {
          const Vec3f drawn{here[field.first], here[field.first + 1], here[field.first + 2]};
          sum = std::min(1.0, 0.5 * length(drawn + (field.first == kDrawnIn ? asked[i].wo : asked[i].wi)));
        }
        const double share = 1e-5 + 1e-6 * std::sqrt(asked[i].parameters.smoothness) / sum;
        double off = 0;
        size_t furthest = field.first;
        for (size_t k = field.first; k < field.first + field.count; ++k) {
          ASSERT_TRUE(std::isfinite(answers[i][k])) << bsdfs()[bsdf].name << ", " << field.name;
          const double off_here = std::abs(double{answers[i][k]} - here[k]) / (1e-5 + share * std::abs(here[k]));
          if (off_here > off) off = off_here, furthest = k;
        }
        ++compared;
        // Where a random number meets a threshold, or eta the critical angle, rounding may choose the other way.
        if (off > 100) {
          ++other_choice;
        } else if (off > worst) {
          worst = off;
          where = "question " + std::to_string(i) + ", value " + std::to_string(furthest - field.first) + ": " +
                  std::to_string(here[furthest]) + " here, " + std::to_string(answers[i][furthest]) +
                  " there; exponent " + std::to_string(asked[i].parameters.smoothness) + ", n . wo " +
                  std::to_string(dot(asked[i].n, asked[i].wo));
        }
      }
      printf("  %-12s %-18s worst %.2f of the bound, %d of %d another choice\n", bsdfs()[bsdf].name.data(), field.name,
             worst, other_choice, compared);
      EXPECT_LE(worst, 1) << bsdfs()[bsdf].name << ", " << field.name << "; " << where;
      EXPECT_LE(other_choice, compared / 1000) << bsdfs()[bsdf].name << ", " << field.name;
    }
  EXPECT_EQ((*device)->messages(), std::vector<std::string>{});
}

}  // namespace
}  // namespace render
