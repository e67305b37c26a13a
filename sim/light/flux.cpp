#include "sim/light/flux.h"

#include <cmath>

#include <fmt/format.h>

#include "sim/light/flux_sweep.h"
#include "world/base/jobs.h"

namespace sim {

namespace {

constexpr size_t kGrain = 4096;  // surfaces a sum's piece

struct Bands {
  double of[3] = {};
  friend Bands operator+(Bands a, const Bands& b) {
    for (int i = 0; i < 3; ++i) a.of[i] += b.of[i];
    return a;
  }
};

/// Sums body(i) over all quads, in an order of its own.
template <class Body>
Bands sum_of(size_t surfaces, Body body) {
  return world::ordered_reduce(
      surfaces, kGrain, Bands{},
      [&](size_t begin, size_t end) {
        Bands sum;
        for (size_t i = begin; i < end; ++i)
          for (int b = 0; b < 3; ++b) sum.of[b] += body(4 * i + b);
        return sum;
      },
      [](const Bands& a, const Bands& b) { return a + b; });
}

/// Calls body(index of float) for all bands of all surfaces.
template <class Body>
void for_all(size_t surfaces, Body body) {
  world::parallel_ranges(surfaces, kGrain, [&](size_t begin, size_t end) {
    for (size_t i = 4 * begin; i < 4 * end; ++i) body(i);
  });
}

bool all_zero(const AlignedFloats& values) {
  for (const float v : values)
    if (v != 0) return false;
  return true;
}

}  // namespace

struct Flux::State {
  FluxGrid grid;
  world::Environment environment;
  AlignedFloats exitance, albedo;  // [surfaces][4]
  AlignedFloats swept;             // of exitance, what leaves along ordinates
  AlignedFloats apart, direct;     // what arrives by rays, the same or empty: what pictures draw themselves; both kinds
  // [surfaces][4]: u of the head, what arrived last beside `direct`, what leaves.
  AlignedFloats scattered, arrived, leaving;
  bool solved = false, changed = true;
  FluxKnobs last;
  FluxReport report;
};

Flux::Flux(const world::Store& store, const world::VoxelBox& box, const world::Environment& environment)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.grid = make_flux_grid(store, box);
  s.environment = environment;
  const size_t n = s.grid.surfaces.size();
  for (AlignedFloats* a : {&s.exitance, &s.albedo, &s.scattered, &s.arrived, &s.leaving}) a->assign(4 * n, 0.0f);
  const world::BlockPalette& palette = store.palette();
  world::parallel_ranges(n, kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const world::Block& block = palette[s.grid.surfaces[i].block];
      // A block's emission is that of six square metres, whichever of its faces show.
      const float exitance[3] = {block.emission.r / 6, block.emission.g / 6, block.emission.b / 6};
      const float albedo[3] = {block.albedo.r, block.albedo.g, block.albedo.b};
      for (int b = 0; b < 3; ++b) s.exitance[4 * i + b] = exitance[b], s.albedo[4 * i + b] = albedo[b];
    }
  });
  s.swept = s.exitance;
}

Flux::~Flux() = default;
Flux::Flux(Flux&&) noexcept = default;
Flux& Flux::operator=(Flux&&) noexcept = default;

const FluxGrid& Flux::grid() const { return state_->grid; }

void Flux::set_direct(const std::vector<world::Irradiance3>& apart, const LampLight& lamps) {
  State& s = *state_;
  const size_t n = s.grid.surfaces.size();
  CHECK(apart.empty() || apart.size() == n);
  CHECK(lamps.irradiance.empty() || lamps.irradiance.size() == n);
  AlignedFloats drawn, all;
  const auto add = [n](AlignedFloats& to, const std::vector<world::Irradiance3>& what) {
    if (what.empty()) return;
    to.resize(4 * n, 0.0f);
    for (size_t i = 0; i < n; ++i) to[4 * i] += what[i].r, to[4 * i + 1] += what[i].g, to[4 * i + 2] += what[i].b;
  };
  add(drawn, apart);
  add(all, apart), add(all, lamps.irradiance);
  s.changed |= drawn != s.apart || all != s.direct;
  s.apart = std::move(drawn), s.direct = std::move(all);
  // What lamps send by rays doesn't travel along ordinates too.
  s.swept = s.exitance;
  for (const uint32_t i : lamps.glowing)
    for (int b = 0; b < 3; ++b) s.swept[size_t{4} * i + b] = 0;
}

void Flux::continue_from(const Flux& other) {
  State& s = *state_;
  const State& from = *other.state_;
  if (!from.solved) return;
  world::parallel_ranges(s.grid.surfaces.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const uint32_t there = from.grid.surface(s.grid.surfaces[i].voxel, s.grid.surfaces[i].face);
      if (there == UINT32_MAX) continue;
      for (int b = 0; b < 4; ++b) s.scattered[4 * i + b] = from.scattered[size_t{4} * there + b];
    }
  });
}

world::Result<FluxReport> Flux::solve(const FluxKnobs& knobs) {
  State& s = *state_;
  if (!(knobs.residual > 0) || !std::isfinite(knobs.residual))
    return world::usage_error(fmt::format("flux_residual: {} isn't above 0", knobs.residual));
  const auto set = ordinates(knobs.directions);
  if (!set) return set.error();
  if (s.solved && !s.changed && s.last.directions == knobs.directions && s.report.residual <= knobs.residual) {
    s.report.sweeps = 0;
    return s.report;
  }
  const size_t n = s.grid.surfaces.size();
  FluxSweep sweep(s.grid, *set, s.environment);
  FluxReport report;
  report.surfaces = n;
  const float per_exitance = static_cast<float>(1 / set->half_range);
  AlignedFloats radiance(4 * n), first(4 * n), answer(4 * n), residual(4 * n), direction(4 * n), root(4 * n);
  for_all(n, [&](size_t i) { root[i] = std::sqrt(s.albedo[i]); });
  // (1 - sqrt(rho) K sqrt(rho)) v
  const auto apply = [&](const AlignedFloats& v, AlignedFloats& to) {
    for_all(n, [&](size_t i) { radiance[i] = root[i] * v[i] * per_exitance; });
    sweep.run(radiance.data(), to.data(), false);
    for_all(n, [&](size_t i) { to[i] = v[i] - root[i] * to[i]; });
    ++report.sweeps;
  };

  // Let exitance, sky and media light the surfaces for the first time.
  for_all(n, [&](size_t i) { radiance[i] = s.swept[i] * per_exitance; });
  sweep.run(radiance.data(), first.data(), true);
  ++report.sweeps;
  if (!s.direct.empty()) for_all(n, [&](size_t i) { first[i] += s.direct[i]; });

  // Solve for what surfaces scatter, from what is known.
  AlignedFloats& u = s.scattered;
  if (all_zero(u)) {
    for_all(n, [&](size_t i) { residual[i] = root[i] * first[i]; });
  } else {
    apply(u, answer);
    for_all(n, [&](size_t i) { residual[i] = root[i] * first[i] - answer[i]; });
  }
  // The mean over lit surfaces of |M + rho E - B| / B: dark caves count as much as the bright land above them.
  const auto left_over = [&] {
    const auto of_surface = [&](size_t i) {
      const double left = double(root[i]) * residual[i], all = double(s.exitance[i]) + double(root[i]) * u[i] + left;
      return all > 0 ? std::min(std::abs(left) / all, 1.0) : 0.0;
    };
    const Bands left = sum_of(n, of_surface);
    const Bands lit = sum_of(n, [&](size_t i) { return of_surface(i) > 0 || u[i] > 0 ? 1.0 : 0.0; });
    double worst = 0;
    for (int b = 0; b < 3; ++b)
      if (lit.of[b] > 0) worst = std::max(worst, left.of[b] / lit.of[b]);
    return worst;
  };
  direction = residual;
  Bands size = sum_of(n, [&](size_t i) { return double(residual[i]) * residual[i]; });
  report.residual = left_over();
  while (report.residual > knobs.residual) {
    if (report.sweeps + 1 >= knobs.most_sweeps) {
      report.converged = false;
      break;
    }
    apply(direction, answer);
    const Bands energy = sum_of(n, [&](size_t i) { return double(direction[i]) * answer[i]; });
    float step[4] = {};
    for (int b = 0; b < 3; ++b) step[b] = energy.of[b] > 0 ? static_cast<float>(size.of[b] / energy.of[b]) : 0;
    for_all(n, [&](size_t i) {
      u[i] += step[i & 3] * direction[i];
      residual[i] -= step[i & 3] * answer[i];
    });
    const Bands next = sum_of(n, [&](size_t i) { return double(residual[i]) * residual[i]; });
    float keep[4] = {};
    for (int b = 0; b < 3; ++b) keep[b] = size.of[b] > 0 ? static_cast<float>(next.of[b] / size.of[b]) : 0;
    for_all(n, [&](size_t i) { direction[i] = residual[i] + keep[i & 3] * direction[i]; });
    size = next;
    report.residual = left_over();
  }

  // Send everything once more, and keep the books.
  for_all(n, [&](size_t i) {
    s.leaving[i] = s.exitance[i] + root[i] * u[i];
    radiance[i] = (s.swept[i] + root[i] * u[i]) * per_exitance;
  });
  FluxTotals totals;
  sweep.run(radiance.data(), s.arrived.data(), true, &totals);
  ++report.sweeps;
  const Bands emitted =
      sum_of(n, [&](size_t i) { return double(s.swept[i]) + (s.direct.empty() ? 0.0 : s.direct[i]); });
  const auto all_of = [&](size_t i) { return double(s.arrived[i]) + (s.direct.empty() ? 0.0 : double(s.direct[i])); };
  const Bands absorbed = sum_of(n, [&](size_t i) { return (1 - double(s.albedo[i])) * all_of(i); });
  const Bands stored =
      sum_of(n, [&](size_t i) { return double(s.exitance[i]) + double(s.albedo[i]) * all_of(i) - s.leaving[i]; });
  for (int b = 0; b < 3; ++b) {
    report.books.emitted[b] = emitted.of[b] + totals.sky[b] + s.grid.medium_emission[b];
    report.books.absorbed[b] = absorbed.of[b] + totals.absorbed[b];
    report.books.escaped[b] = totals.escaped[b];
    report.books.stored[b] = stored.of[b];
  }
  report.bytes = s.grid.bytes() + sweep.bytes() + 11 * 4 * n * sizeof(float);
  s.solved = true, s.changed = false, s.last = knobs, s.report = report;
  return report;
}

world::Irradiance3 Flux::irradiance(uint32_t surface) const {
  const State& s = *state_;
  const float* e = s.arrived.data() + size_t{4} * surface;
  if (s.direct.empty()) return {e[0], e[1], e[2]};
  const float* d = s.direct.data() + size_t{4} * surface;
  return {e[0] + d[0], e[1] + d[1], e[2] + d[2]};
}

world::Irradiance3 Flux::radiosity(uint32_t surface) const {
  const float* e = state_->leaving.data() + size_t{4} * surface;
  return {e[0], e[1], e[2]};
}

world::SurfaceIrradiance Flux::surface_irradiance() const {
  const State& s = *state_;
  world::SurfaceIrradiance out;
  out.low = s.grid.low;
  for (size_t a = 0; a < 3; ++a) out.size[a] = s.grid.size[a];
  out.leaves.resize(s.grid.leaves.size());
  world::parallel_ranges(out.leaves.size(), 256, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i)
      for (size_t face = 0; face < world::kFaces; ++face) {
        out.leaves[i].wall[face] = s.grid.leaves[i].wall[face];
        std::copy_n(s.grid.leaves[i].first[face], 8, out.leaves[i].first[face].begin());
      }
  });
  out.values.resize(s.grid.surfaces.size());
  world::parallel_ranges(out.values.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      float e[3];
      for (size_t b = 0; b < 3; ++b) {
        e[b] = s.arrived[4 * i + b];
        if (!s.direct.empty()) e[b] += s.direct[4 * i + b] - (s.apart.empty() ? 0.0f : s.apart[4 * i + b]);
      }
      out.values[i] = {e[0], e[1], e[2]};
    }
  });
  return out;
}

}  // namespace sim
