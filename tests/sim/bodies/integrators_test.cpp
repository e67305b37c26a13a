// Integrators against closed forms: free fall, a projectile, a spring, and their orders.
#include "sim/bodies/integrators.h"

#include <gtest/gtest.h>

#include "world/space/world_point.h"

namespace sim {
namespace {

using world::Vec3d;

constexpr Integrator kAll[] = {Integrator::explicit_euler, Integrator::symplectic_euler, Integrator::velocity_verlet,
                               Integrator::runge_kutta_4};

/// The error of a spring with omega = 1 after 10 s, in steps of dt.
double spring_error(Integrator integrator, int steps) {
  const double dt = 10.0 / steps;
  Motion<double> m{1, 0};
  for (int i = 0; i < steps; ++i) m = integrate(integrator, m, dt, [](double x, double) { return -x; });
  return std::abs(m.position - std::cos(10.0));
}

/// Where drag slows it: v' = -v.
double drag_error(Integrator integrator, int steps) {
  Motion<double> m{0, 1};
  for (int i = 0; i < steps; ++i) m = integrate(integrator, m, 1.0 / steps, [](double, double v) { return -v; });
  return std::abs(m.velocity - std::exp(-1.0));
}

TEST(Integrators, HaveTheOrdersThatTheirNamesPromise) {
  const double orders[] = {1, 1, 2, 4};
  for (const Integrator integrator : kAll) {
    const double order = orders[static_cast<int>(integrator)];
    for (const auto& error : {spring_error, drag_error}) {
      const double coarse = error(integrator, 400), fine = error(integrator, 800);
      EXPECT_NEAR(std::log2(coarse / fine), order, 0.1) << knob_choices(integrator)[static_cast<size_t>(integrator)];
    }
  }
}

TEST(Integrators, TakeVectorsAsNumbers) {
  for (const Integrator integrator : kAll) {
    Motion<Vec3d> v{{1, 2, 3}, {0, 0, 1}};
    Motion<double> x{1, 0};
    for (int i = 0; i < 10; ++i) {
      v = integrate(integrator, v, 0.1, [](Vec3d p, Vec3d) { return -p; });
      x = integrate(integrator, x, 0.1, [](double p, double) { return -p; });
    }
    EXPECT_EQ(v.position.x, x.position);
    EXPECT_EQ(v.velocity.x, x.velocity);
  }
}

TEST(Integrators, SubstepsAreRaisedToWhatIsStable) {
  EXPECT_EQ(stable_substeps(10, 1.0 / 60, 1), 1);
  EXPECT_EQ(stable_substeps(10, 1.0 / 60, 4), 4);
  EXPECT_EQ(stable_substeps(150, 1.0 / 60, 1), 3);
  EXPECT_EQ(stable_substeps(1e9, 1.0 / 60, 1), kMostSubsteps);
  EXPECT_EQ(stable_substeps(std::nan(""), 1.0 / 60, 1), kMostSubsteps);
  EXPECT_EQ(stable_substeps(0, 1.0 / 60, 0), 1);
}

}  // namespace
}  // namespace sim
