/// What a better integrator buys: an oscillator and a body slowed by drag, by steps a second.
#include <cmath>

#include <fmt/format.h>

#include "sim/bodies/integrators.h"
#include "sim/knobs.h"
#include "tools/bench/benchmark.h"

namespace tools {

namespace {

using sim::Integrator;
using sim::Motion;

constexpr double kSeconds = 10;
constexpr int kRounds = 200;

Motion<double> swing(Integrator integrator, int rate) {
  Motion<double> m{1, 0};
  const int steps = static_cast<int>(kSeconds) * rate;
  for (int i = 0; i < steps; ++i) m = integrate(integrator, m, 1.0 / rate, [](double x, double) { return -x; });
  return m;
}

}  // namespace

void add_subject_integrators(Registry& registry) {
  Subject subject{.question = "which integrator, at how many steps a second?",
                  .reference = "closed form: x = cos t, after 10 s of an oscillator with 1 rad/s",
                  .metrics = {"error of x (m)", "relative error of the energy"},
                  .work_unit = "evaluations of the force; a call is 200 times 10 s",
                  .knob_unit = "steps a second"};
  subject.expected_slopes = {{"explicit_euler", {-1, 60}},
                             {"symplectic_euler", {-1, 60}},
                             {"velocity_verlet", {-2, 15}},
                             {"runge_kutta_4", {-4, 15}}};
  subject.settings = [](BenchContext&) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    for (int i = 0; i < sim::kIntegrators; ++i)
      for (const int rate : {15, 30, 60, 120, 240}) {
        const Integrator integrator = static_cast<Integrator>(i);
        const std::string method(knob_choices(integrator)[static_cast<size_t>(i)]);
        Setting s{.method = method, .setting = fmt::format("{}@{}", method, rate)};
        s.knob = rate;
        s.is_default = integrator == sim::SimKnobs{}.body_integrator && rate == 60;
        s.measure = [=](uint64_t) {
          const Motion<double> m = swing(integrator, rate);
          const double error = m.position - std::cos(kSeconds);
          const double energy = m.position * m.position + m.velocity * m.velocity - 1;
          return ErrorSample{{std::abs(error), std::abs(energy)}, error};
        };
        s.run = [=] {
          for (int round = 0; round < kRounds; ++round) keep(swing(integrator, rate).position);
          constexpr int kForces[] = {1, 1, 2, 4};
          return kRounds * kSeconds * rate * kForces[i];
        };
        settings.push_back(std::move(s));
      }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
