/// How a point moves on under an acceleration, a step at a time: a ladder of four methods, for bodies and particles.
///
///   explicit_euler     x += h v;  v += h a               order 1; an oscillation gains energy
///   symplectic_euler   v += h a;  x += h v               order 1; the energy of an oscillation stays near its own
///   velocity_verlet    x += h v + h^2/2 a;  v += h/2 (a + a')     order 2; one more a, exact where a is constant
///   runge_kutta_4      order 4; four a
///
/// Positions may be counted from anywhere: where the step starts from 0, the result doesn't know where the world's
/// origin is.
/// source Ernst Hairer, Christian Lubich, Gerhard Wanner. Geometric Numerical Integration. 2006, chapter I
#pragma once

#include <array>
#include <cmath>
#include <string_view>

namespace sim {

enum class Integrator { explicit_euler, symplectic_euler, velocity_verlet, runge_kutta_4 };
constexpr auto knob_choices(Integrator) {
  return std::array<std::string_view, 4>{"explicit_euler", "symplectic_euler", "velocity_verlet", "runge_kutta_4"};
}
constexpr int kIntegrators = 4;

/// Vector: double or Vec3d, in m and m/s.
template <class Vector>
struct Motion {
  Vector position, velocity;
};

/// One step of dt seconds; acceleration(position, velocity) in m/s^2.
template <class Vector, class Acceleration>
Motion<Vector> integrate(Integrator integrator, Motion<Vector> m, double dt, const Acceleration& acceleration) {
  Vector &x = m.position, &v = m.velocity;
  switch (integrator) {
    case Integrator::explicit_euler: {
      const Vector a = acceleration(x, v);
      x += dt * v;
      v += dt * a;
      return m;
    }
    case Integrator::symplectic_euler: {
      v += dt * acceleration(x, v);
      x += dt * v;
      return m;
    }
    case Integrator::velocity_verlet: {
      const Vector a = acceleration(x, v);
      x += dt * v + (dt * dt / 2) * a;
      // Of a drag, which needs the speed at the end, the speed that the first acceleration leads to.
      v += (dt / 2) * (a + acceleration(x, v + dt * a));
      return m;
    }
    case Integrator::runge_kutta_4: {
      const Vector v1 = v, a1 = acceleration(x, v1);
      const Vector v2 = v + (dt / 2) * a1, a2 = acceleration(x + (dt / 2) * v1, v2);
      const Vector v3 = v + (dt / 2) * a2, a3 = acceleration(x + (dt / 2) * v2, v3);
      const Vector v4 = v + dt * a3, a4 = acceleration(x + dt * v3, v4);
      x += (dt / 6) * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
      v += (dt / 6) * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
      return m;
    }
  }
  return m;
}

constexpr int kMostSubsteps = 64;

/// Parts of a step in which something that swings or decays at `rate` (1/s) stays stable: `wished`, or more, so that
/// rate * dt is at most 1 a part: half of where these methods break (2; 2.8 for runge_kutta_4). At most kMostSubsteps;
/// a rate that isn't a number asks for as many.
inline int stable_substeps(double rate, double dt, int wished) {
  const double needed = rate * dt;
  int parts = wished < 1 ? 1 : wished > kMostSubsteps ? kMostSubsteps : wished;
  if (!(needed <= kMostSubsteps)) return kMostSubsteps;
  while (parts < needed) ++parts;
  return parts;
}

}  // namespace sim
