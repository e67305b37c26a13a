/// heat: conduction through faces, with each block's conductivity and capacity. The fluxes: sim/matter/heat_kernel.h;
/// the unit and what melts: sim/matter/thermal.h; steps: sim/matter/heat_plan.h.
///
/// Radiation and convection aren't here: flames radiate by the rule of fire, and warm gases move by that of gas. What
/// lies outside of the world's border, or isn't loaded, exchanges nothing. A page sleeps while nothing can flow
/// through a face of its voxels; so what sleeps and is at the same temperature as its neighbours exchanges nothing.
///
/// A page that is new among the awake looks across its sides, and takes in those through which something may flow:
/// both pages of such a face are always stepped together, and no heat is lost.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

#include "sim/matter/heat_kernel.h"
#include "sim/matter/heat_plan.h"
#include "sim/matter/matter.h"
#include "world/base/jobs.h"
#include "world/store/leaf_shifts.h"

namespace sim {

namespace {

using world::BlockId;

constexpr size_t kPagesATask = 16;
constexpr float kNoLimit = 1e6f;    // of a share
constexpr double kLeftOver = 1e-4;  // of the implicit scheme's error, after its sweeps
constexpr int kMostSweeps = 256;
constexpr size_t kFacePage[6] = {around_index(-1, 0, 0), around_index(1, 0, 0),  around_index(0, -1, 0),
                                 around_index(0, 1, 0),  around_index(0, 0, -1), around_index(0, 0, 1)};

/// What the rule knows of a page.
struct HeatPage {
  uint64_t stepped = 0;            // the last step that it took part in
  uint32_t content = 0, heat = 0;  // the page's counters then, or when arrays were made
  bool ready = false, listed = false;
  ThermalVoxel all;
  std::unique_ptr<ThermalArrays> arrays;
};

class Heat final : public Rule {
 public:
  explicit Heat(size_t rule) : rule_(rule) {}
  RuleReport step(Cells& cells, const Tick& tick) override;

 private:
  void step_once(Cells& cells, const HeatStep& step, bool implicit, RuleReport& report);
  void find_pages(Cells& cells, const HeatStep& step);
  void prepare(const Cells& cells, PageId p);
  bool is_stale(const Cells& cells, PageId p) const {
    return !pages_[p].ready || pages_[p].content != cells.content_changes(p);
  }
  HeatSource source(const Cells& cells, PageId p) const;
  void sources_around(const Cells& cells, PageId p, HeatSource* sides) const;
  void conduct_explicit(Cells& cells, const HeatStep& step);
  void conduct_implicit(Cells& cells, const HeatStep& step);
  void write(Cells& cells, RuleReport& report);

  const size_t rule_;  // its awake set
  uint64_t steps_ = 1;
  std::unique_ptr<ThermalTraits> thermal_;
  std::vector<HeatPage> pages_;
  std::vector<PageId> list_, stale_;                  // pages of this step
  std::vector<std::unique_ptr<Cells::Heats>> heats_;  // by list_: after the step
  std::vector<HeatResult> results_;
  std::vector<uint32_t> sides_changed_;  // by list_: bit face
  // The implicit scheme's: four temperatures for each page.
  struct Sweep {
    alignas(64) float old[world::kLeafVoxels], before[world::kLeafVoxels], now[world::kLeafVoxels],
        next[world::kLeafVoxels];
  };
  std::vector<std::unique_ptr<Sweep>> sweeps_;  // by list_
  std::vector<int32_t> place_;                  // by page: in list_, or -1
};

void Heat::prepare(const Cells& cells, PageId p) {
  HeatPage& page = pages_[p];
  page.ready = true;
  page.content = cells.content_changes(p);
  std::array<BlockId, world::kLeafVoxels> ids;
  cells.ids(p, ids);
  const uint16_t* amounts = cells.find_amounts(p);
  const bool uniform = !amounts && std::all_of(ids.begin(), ids.end(), [&](BlockId id) { return id == ids[0]; });
  page.all = thermal_->voxel(ids[0]);
  if (uniform) {
    page.arrays.reset();
    return;
  }
  if (!page.arrays) page.arrays = std::make_unique<ThermalArrays>();
  ThermalArrays& a = *page.arrays;
  ThermalVoxel v = page.all;
  BlockId of = ids[0];
  for (size_t i = 0; i < ids.size(); ++i) {
    const int amount = amounts && cells.is_fluid(ids[i]) ? amounts[i] : kFullVoxel;
    if (ids[i] != of || amount != kFullVoxel) v = thermal_->voxel(ids[i], amount);
    of = amount == kFullVoxel ? ids[i] : static_cast<BlockId>(~ids[i]);
    a.inverse[i] = v.inverse, a.born[i] = v.born, a.low[i] = v.low, a.high[i] = v.high;
    a.resistance[i] = v.resistance, a.share[i] = v.share;
  }
}

HeatSource Heat::source(const Cells& cells, PageId p) const {
  HeatSource s;
  s.closed = p == kClosedPage;
  if (s.closed) return s;
  s.heat = cells.find_heats(p);
  s.arrays = pages_[p].arrays.get();
  s.all = pages_[p].all;
  return s;
}

void Heat::sources_around(const Cells& cells, PageId p, HeatSource* sides) const {
  for (size_t f = 0; f < 6; ++f) sides[f] = source(cells, cells.around(p)[kFacePage[f]]);
}

/// Awake pages, and those through whose sides something flows into or out of them.
void Heat::find_pages(Cells& cells, const HeatStep& step) {
  AwakeSet& set = cells.awake(rule_);
  set.begin();
  list_.clear();
  const auto grow = [&] {
    if (pages_.size() < cells.page_limit()) pages_.resize(cells.page_limit());
  };
  const auto list = [&](PageId p) {
    cells.open_around(p);
    grow();
    pages_[p].listed = true;
    list_.push_back(p);
  };
  for (const PageId p : set.now()) list(p);
  for (size_t n = 0; n < list_.size(); ++n) {
    const PageId p = list_[n];
    const bool known =
        pages_[p].stepped + 1 == steps_ && !is_stale(cells, p) && pages_[p].heat == cells.heat_changes(p);
    if (known) continue;
    if (is_stale(cells, p)) prepare(cells, p);
    for (int face = 0; face < 6; ++face) {
      const PageId other = cells.around(p)[kFacePage[face]];
      if (other == kClosedPage || pages_[other].listed) continue;
      if (is_stale(cells, other)) prepare(cells, other);
      if (side_is_live(source(cells, p), source(cells, other), face, step)) list(other);
    }
  }
  // What is beside them is looked at too.
  stale_.clear();
  for (const PageId p : list_)
    for (const size_t around : kFacePage) {
      const PageId other = cells.around(p)[around];
      if (other == kClosedPage || pages_[other].listed || !is_stale(cells, other)) continue;
      pages_[other].listed = true;
      stale_.push_back(other);
    }
  for (const PageId p : list_)
    if (is_stale(cells, p)) stale_.push_back(p);
  world::parallel_ranges(stale_.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) prepare(cells, stale_[n]);
  });
  for (const PageId p : list_) pages_[p].listed = false;
  for (const PageId p : stale_) pages_[p].listed = false;
}

void Heat::conduct_explicit(Cells& cells, const HeatStep& step) {
  world::parallel_ranges(list_.size(), kPagesATask, [&](size_t begin, size_t end) {
    HeatSource sides[6];
    for (size_t n = begin; n < end; ++n) {
      sources_around(cells, list_[n], sides);
      results_[n] = conduct(source(cells, list_[n]), sides, step, heats_[n]->data());
    }
  });
}

/// Backward Euler on the pages in which something may flow, and those around; what is further exchanges nothing in this
/// step. Solved by Chebyshev's semi-iteration of Jacobi's method; the fluxes are those of the solution, in integers, so
/// that energy is exact however far the sweeps went.
/// source Gene Golub, Richard Varga. Chebyshev semi-iterative methods, successive overrelaxation iterative methods, and
///        second order Richardson iterative methods. 1961
void Heat::conduct_implicit(Cells& cells, const HeatStep& step) {
  conduct_explicit(cells, step);  // for its answer to what is live
  std::vector<PageId> pages;
  place_.assign(cells.page_limit(), -1);
  for (size_t n = 0; n < list_.size(); ++n) {
    if (!results_[n].live) continue;
    for (const PageId p : cells.around(list_[n])) {
      if (p == kClosedPage || place_[p] >= 0) continue;
      place_[p] = static_cast<int32_t>(pages.size());
      pages.push_back(p);
    }
  }
  list_.swap(pages);
  while (heats_.size() < list_.size()) heats_.push_back(std::make_unique<Cells::Heats>());
  for (size_t n = 0; n < list_.size(); ++n)
    if (!heats_[n]) heats_[n] = std::make_unique<Cells::Heats>();
  results_.assign(list_.size(), {});
  while (sweeps_.size() < list_.size()) sweeps_.push_back(std::make_unique<Sweep>());
  double most = 0;
  for (size_t n = 0; n < list_.size(); ++n) {
    if (is_stale(cells, list_[n])) prepare(cells, list_[n]);
    const HeatSource s = source(cells, list_[n]);
    temperatures(s, sweeps_[n]->old);
    std::memcpy(sweeps_[n]->now, sweeps_[n]->old, sizeof sweeps_[n]->now);
    std::memcpy(sweeps_[n]->before, sweeps_[n]->old, sizeof sweeps_[n]->now);
    const auto ratio = [&](float resistance, float share) {
      most = std::max(most,
                      static_cast<double>(step.scale) / (static_cast<double>(resistance) * static_cast<double>(share)));
    };
    if (!s.arrays) ratio(s.all.resistance, s.all.share);
    for (size_t i = 0; s.arrays && i < world::kLeafVoxels; ++i) ratio(s.arrays->resistance[i], s.arrays->share[i]);
  }
  const auto solved = [&](PageId p, const float* (*which)(const Sweep&)) {
    HeatSource s = source(cells, p);
    if (s.closed || place_[p] < 0) return HeatSource{.closed = true};
    s.temperature = which(*sweeps_[static_cast<size_t>(place_[p])]);
    return s;
  };
  const auto now = [](const Sweep& s) { return static_cast<const float*>(s.now); };
  const double radius = most / (1 + most), c = radius / (1 + std::sqrt(1 - radius * radius));
  const int sweeps =
      most == 0 ? 0 : std::clamp(static_cast<int>(std::ceil(std::log(2 / kLeftOver) / -std::log(c))), 1, kMostSweeps);
  double weight = 1;
  for (int k = 0; k < sweeps; ++k) {
    if (k == 1) weight = 1 / (1 - radius * radius / 2);
    if (k > 1) weight = 1 / (1 - radius * radius * weight / 4);
    world::parallel_ranges(list_.size(), kPagesATask, [&](size_t begin, size_t end) {
      HeatSource sides[6];
      for (size_t n = begin; n < end; ++n) {
        for (size_t f = 0; f < 6; ++f) sides[f] = solved(cells.around(list_[n])[kFacePage[f]], now);
        Sweep& s = *sweeps_[n];
        relax(solved(list_[n], now), sides, step, s.old, s.before, static_cast<float>(weight), s.next);
      }
    });
    for (size_t n = 0; n < list_.size(); ++n) {
      Sweep& s = *sweeps_[n];
      std::memcpy(s.before, s.now, sizeof s.now);
      std::memcpy(s.now, s.next, sizeof s.now);
    }
  }
  HeatStep last = step;
  last.limit = kNoLimit;
  world::parallel_ranges(list_.size(), kPagesATask, [&](size_t begin, size_t end) {
    HeatSource sides[6];
    for (size_t n = begin; n < end; ++n) {
      for (size_t f = 0; f < 6; ++f) sides[f] = solved(cells.around(list_[n])[kFacePage[f]], now);
      results_[n] = conduct(solved(list_[n], now), sides, last, heats_[n]->data());
      results_[n].live = results_[n].flows;  // else the next step finds out
    }
  });
}

/// Puts the new heats in place, and tells who has to look again.
void Heat::write(Cells& cells, RuleReport& report) {
  sides_changed_.assign(list_.size(), 0);
  std::atomic<uint64_t> changed{0};
  world::parallel_ranges(list_.size(), kPagesATask, [&](size_t begin, size_t end) {
    static const std::array<world::LeafMask, 6> kSides = {world::side_of(0), world::side_of(1), world::side_of(2),
                                                          world::side_of(3), world::side_of(4), world::side_of(5)};
    uint64_t count = 0;
    for (size_t n = begin; n < end; ++n) {
      if (!results_[n].flows) continue;
      const world::LeafMask& moved = results_[n].changed;
      for (size_t f = 0; f < 6; ++f) {
        uint64_t any = 0;
        for (int w = 0; w < 8; ++w) any |= moved.word[w] & kSides[f].word[w];
        sides_changed_[n] |= any ? 1u << f : 0u;
      }
      count += static_cast<uint64_t>(moved.count());
      cells.swap_heats(list_[n], heats_[n]);
      cells.stir_heat(list_[n]);
    }
    changed += count;
  });
  AwakeSet& set = cells.awake(rule_);
  for (size_t n = 0; n < list_.size(); ++n) {
    const PageId p = list_[n];
    pages_[p].stepped = steps_;
    pages_[p].heat = cells.heat_changes(p);
    if (results_[n].live) set.add(p);
    if (sides_changed_[n]) cells.open_around(p);
    for (uint32_t s = sides_changed_[n]; s; s &= s - 1)
      set.add(cells.around(p)[kFacePage[static_cast<size_t>(std::countr_zero(s))]]);
  }
  cells.spread();
  report.voxels_changed += changed;
  report.leaves_visited += list_.size();
}

void Heat::step_once(Cells& cells, const HeatStep& step, bool implicit, RuleReport& report) {
  find_pages(cells, step);
  while (heats_.size() < list_.size()) heats_.push_back(nullptr);
  for (size_t n = 0; n < list_.size(); ++n)
    if (!heats_[n]) heats_[n] = std::make_unique<Cells::Heats>();
  results_.assign(list_.size(), {});
  implicit ? conduct_implicit(cells, step) : conduct_explicit(cells, step);
  write(cells, report);
  ++steps_;
}

RuleReport Heat::step(Cells& cells, const Tick& tick) {
  RuleReport report;
  if (!thermal_) thermal_ = std::make_unique<ThermalTraits>(cells.palette(), tick.options->reactions);
  thermal_->follow();
  const SimKnobs& knobs = tick.options->knobs;
  const auto plan = plan_heat(knobs, thermal_->largest_diffusivity());
  if (!plan.ok()) {
    report.notes.push_back("heat stands still: " + plan.error().message);
    cells.awake(rule_).clear();
    return report;
  }
  const bool implicit = knobs.heat_scheme == HeatScheme::implicit;
  for (int s = 0; s < plan->substeps && !cells.awake(rule_).empty(); ++s) {
    const uint64_t number = tick.number * static_cast<uint64_t>(plan->substeps) + static_cast<uint64_t>(s);
    step_once(cells, {.scale = static_cast<float>(plan->dt / kHeatUnitJ), .phase = heat_phase(number)}, implicit,
              report);
  }
  report.bytes = pages_.capacity() * sizeof(HeatPage) + heats_.size() * sizeof(Cells::Heats);
  for (const HeatPage& page : pages_) report.bytes += page.arrays ? sizeof(ThermalArrays) : 0;
  return report;
}

}  // namespace

RuleInfo heat_info() {
  return {.name = "heat",
          .what = "what is warmer warms what is beside it",
          .conserves = "energy",
          .calls = calls_for_heat,
          .feels_heat = true};
}
std::unique_ptr<Rule> make_heat_rule(size_t rule) { return std::make_unique<Heat>(rule); }

}  // namespace sim
