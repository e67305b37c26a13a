/// The same luminaires on the processor, in double, and on the device, in float: the shared headers, compiled into a
/// compute shader, answer what C++ answers.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/render/gpu/compute.h"
#include "world/base/random.h"
#include "world/luminaires/every_luminaire.shared.h"
#include "world/luminaires/kinds.h"

#include "every_luminaire.comp.spv.h"

namespace render {
namespace {

using world::Luminaire;
using world::Vec2f;
using world::Vec3d;
using world::Vec3f;
using world::shared::Emitter;

/// As in emitter.shared.h, in float.
struct DeviceEmitter {
  alignas(16) Vec3f axis;
  alignas(16) Vec3f up;
  alignas(16) Vec3f right;
  alignas(8) Vec2f extent;
  float radius, cone, inner_cone, tan_half_angle;
  alignas(16) Vec3f attenuation;
  alignas(16) Vec3f corner;
  alignas(16) Vec3f edge1;
  alignas(16) Vec3f edge2;
  uint32_t at_infinity, whole_sphere, uniform_area;
};
static_assert(offsetof(DeviceEmitter, extent) == 48 && offsetof(DeviceEmitter, edge2) == 128 &&
              sizeof(DeviceEmitter) == 160);

/// As in every_luminaire.comp.glsl.
struct Question {
  DeviceEmitter emitter;
  Vec3f receiver;
  uint32_t kind;
  Vec3f direction;
  float reserved;
  Vec2f u, v;
};
static_assert(sizeof(Question) == 208);

using Answer = std::array<float, 16>;
struct Field {
  const char* name;
  size_t first, count;
};
constexpr Field kFields[] = {{"sample: direction", 0, 3}, {"sample: distance", 3, 1}, {"sample: biradiance", 4, 1},
                             {"sample: pdf", 5, 1},       {"meet: distance", 6, 1},   {"meet: radiance", 7, 1},
                             {"meet: pdf", 8, 1},         {"emit: origin", 9, 3},     {"emit: direction", 12, 3},
                             {"emit: power", 15, 1}};

DeviceEmitter device_from(const Emitter& e) {
  DeviceEmitter d{};
  d.axis = e.axis, d.up = e.up, d.right = e.right, d.extent = e.extent;
  d.radius = float(e.radius), d.cone = float(e.cone), d.inner_cone = float(e.inner_cone);
  d.tan_half_angle = float(e.tan_half_angle);
  d.attenuation = e.attenuation, d.corner = e.corner, d.edge1 = e.edge1, d.edge2 = e.edge2;
  d.at_infinity = e.at_infinity, d.whole_sphere = e.whole_sphere, d.uniform_area = e.uniform_area;
  return d;
}
/// The floats of the device again, so that both start from the same numbers.
Emitter emitter_from(const DeviceEmitter& d) {
  Emitter e{};
  e.axis = d.axis, e.up = d.up, e.right = d.right, e.extent = d.extent;
  e.radius = d.radius, e.cone = d.cone, e.inner_cone = d.inner_cone, e.tan_half_angle = d.tan_half_angle;
  e.attenuation = d.attenuation, e.corner = d.corner, e.edge1 = d.edge1, e.edge2 = d.edge2;
  e.at_infinity = d.at_infinity, e.whole_sphere = d.whole_sphere, e.uniform_area = d.uniform_area;
  return e;
}

Answer answer(const Question& q) {
  const Emitter e = emitter_from(q.emitter);
  Answer answers;
  size_t at = 0;
  const auto put = [&](double value) { answers[at++] = static_cast<float>(std::min(value, 3e38)); };
  const auto put3 = [&](const Vec3d& v) { put(v.x), put(v.y), put(v.z); };
  const auto drawn = world::shared::luminaire_sample(q.kind, e, q.receiver, q.u);
  put3(drawn.direction), put(drawn.distance), put(drawn.biradiance), put(drawn.pdf);
  const auto hit = world::shared::luminaire_meet(q.kind, e, q.receiver, q.direction);
  put(hit.distance), put(hit.radiance), put(hit.pdf);
  const auto photon = world::shared::luminaire_emit(q.kind, e, q.u, q.v, q.receiver, 2.0);
  put3(photon.origin), put3(photon.direction), put(photon.power);
  return answers;
}

/// Receivers where lamps of a metre are seen large, so that double and float sample them in the same way.
std::vector<Question> questions() {
  std::vector<Question> all;
  int64_t count = 0;
  const auto unit = [&] { return world::uniform01(world::random_bits(12, ++count, 0, 0)); };
  const auto direction = [&] {
    const float z = 2 * unit() - 1, turn = 6.2831853f * unit(), r = std::sqrt(1 - z * z);
    return glm::normalize(Vec3f(r * std::cos(turn), r * std::sin(turn), z));
  };
  const auto kinds = world::luminaire_members();
  for (uint32_t kind = 0; kind < kinds.size(); ++kind)
    for (int i = 0; i < 3000; ++i) {
      Luminaire l;
      l.kind = kinds[kind].name;
      l.axis = direction();
      l.up = glm::normalize(glm::cross(l.axis, direction()));
      l.extent = {1 + unit(), 1 + unit()}, l.radius = 0.5f + unit();
      l.half_angle = 0.2f + 1.2f * unit(), l.inner_half_angle = l.half_angle * unit() * 1.5f;
      l.attenuation = {0.1f + unit(), unit(), unit()};
      l.at_infinity = i % 4 == 0, l.whole_sphere = i % 2, l.uniform_area = i % 3 == 0;
      Question q{};
      Emitter e = world::emitter_from(l);
      // A triangle that faces its axis, as the sampler makes it.
      e.corner = -0.5 * (e.up + e.right), e.edge1 = 1.5 * e.up, e.edge2 = 1.5 * e.right;
      e.axis = kinds[kind].keys & world::shared::kKeyFile ? glm::normalize(glm::cross(e.edge1, e.edge2)) : e.axis;
      q.emitter = device_from(e);
      q.kind = kind;
      q.receiver = (0.3f + unit()) * Vec3f(e.axis) + 0.7f * direction();
      q.u = {unit(), unit()}, q.v = {unit(), unit()};
      q.direction =
          i % 3 ? Vec3f(world::shared::luminaire_sample(kind, emitter_from(q.emitter), q.receiver, q.v).direction)
                : direction();
      all.push_back(q);
    }
  return all;
}

TEST(EveryLuminaireOnTheDevice, AnswersAsOnTheProcessor) {
  auto device = gpu::Device::make({.validation = true});
  ASSERT_TRUE(device.ok()) << device.error().message;
  const std::vector<Question> asked = questions();
  const std::vector<Answer> answers = compute_answers<Answer>(**device, every_luminaire_comp_spv, asked);
  const auto kinds = world::luminaire_members();
  for (uint32_t kind = 0; kind < kinds.size(); ++kind)
    for (const Field& field : kFields) {
      int compared = 0, other_choice = 0;
      double worst = 0;  // in parts of 1e-4, and 1e-5 for what is near 0: measured at most 0.6
      for (size_t i = 0; i < asked.size(); ++i) {
        if (asked[i].kind != kind) continue;
        const Answer here = answer(asked[i]);
        double off = 0;
        for (size_t k = field.first; k < field.first + field.count; ++k) {
          ASSERT_TRUE(std::isfinite(answers[i][k])) << kinds[kind].name << ", " << field.name;
          off = std::max(off, std::abs(double{answers[i][k]} - here[k]) / (1e-5 + 1e-4 * std::abs(here[k])));
        }
        ++compared;
        // At a cone's, panel's or horizon's border rounding may choose the other side.
        if (off > 10)
          ++other_choice;
        else
          worst = std::max(worst, off);
      }
      EXPECT_LE(worst, 1) << kinds[kind].name << ", " << field.name;
      EXPECT_LE(other_choice, compared / 300) << kinds[kind].name << ", " << field.name;
    }
  EXPECT_EQ((*device)->messages(), std::vector<std::string>{});
}

}  // namespace
}  // namespace render
