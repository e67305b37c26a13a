/// What ticks a second a thrown body needs: a stone in air with drag, a second and a half after it was thrown.
#include <cmath>

#include <fmt/format.h>

#include "sim/bodies/bodies.h"
#include "tools/bench/benchmark.h"

namespace tools {

namespace {

using sim::Bodies;
using sim::Integrator;
using world::Vec3d;

constexpr double kDensity = 60;  // light, so that drag counts

/// Where its corner is after 1.5 s, from where it was.
Vec3d thrown(const world::Store& store, Integrator integrator, int rate) {
  Bodies bodies(store);
  sim::BodyDescription d;
  d.size = Vec3d(0.25), d.density = kDensity, d.velocity = {20, 20, 0};
  const sim::BodyId id = *bodies.add(d);
  const sim::FixedVec3 start = bodies.find(id)->box.min;
  sim::BodySettings settings;
  settings.integrator = integrator, settings.tick = {1, rate};
  for (int i = 0; i < rate * 3 / 2; ++i) bodies.step(settings);
  return sim::from_fixed(bodies.find(id)->box.min - start);
}

/// The same by the fourth order at 30720 Hz in double.
Vec3d reference() {
  constexpr double kArea = 0.0625, kVolume = kArea * 0.25, kRate = 30720;
  const double drag = 0.5 * sim::kAirDensity * kArea / (kVolume * kDensity);
  sim::Motion<Vec3d> m{Vec3d(0), {20, 20, 0}};
  for (int i = 0; i < kRate * 3 / 2; ++i)
    m = sim::integrate(Integrator::runge_kutta_4, m, 1 / kRate,
                       [&](Vec3d, Vec3d v) { return Vec3d(0, -9.81, 0) - drag * std::sqrt(dot(v, v)) * v; });
  return m.position;
}

}  // namespace

void add_subject_body_time_step(Registry& registry) {
  Subject subject{.question = "how many ticks a second does a thrown body need?",
                  .reference = "the fourth order at 30720 Hz in double; floor: a body's places are rounded to 2^-32 m",
                  .metrics = {"distance from the true place (m)", "error of the height (m)"},
                  .work_unit = "ticks of a body",
                  .knob_unit = "ticks a second",
                  .noise_floor = 2e-8};
  subject.expected_slopes = {
      {"explicit_euler", {-1, 60}}, {"symplectic_euler", {-1, 60}}, {"velocity_verlet", {-2, 30}}};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    const auto air =
        context.shared<world::World>("body_time_step/air", [] { return std::make_shared<world::World>(); });
    const Vec3d right = reference();
    std::vector<Setting> settings;
    for (int i = 0; i < sim::kIntegrators; ++i)
      for (const int rate : {20, 30, 60, 120, 240}) {
        const Integrator integrator = static_cast<Integrator>(i);
        const std::string method(knob_choices(integrator)[static_cast<size_t>(i)]);
        Setting s{.method = method, .setting = fmt::format("{}@{}", method, rate)};
        s.knob = rate;
        s.is_default = integrator == sim::SimKnobs{}.body_integrator && rate == 60;
        s.measure = [=](uint64_t) {
          const Vec3d off = thrown(air->store, integrator, rate) - right;
          return ErrorSample{{std::sqrt(dot(off, off)), std::abs(off.y)}, off.y};
        };
        s.run = [=] {
          keep(thrown(air->store, integrator, rate).y);
          return rate * 1.5;
        };
        settings.push_back(std::move(s));
      }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
