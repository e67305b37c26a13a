/// heat: conduction through faces, with each block's conductivity and capacity. The fluxes: sim/matter/heat_kernel.h;
/// the unit and what melts: sim/matter/thermal.h; steps: sim/matter/heat_plan.h.
///
/// Radiation and convection aren't here: flames radiate by the rule of fire, and warm gases move by that of gas. What
/// lies outside of the world's border, or isn't loaded, exchanges nothing. A page sleeps while nothing can flow
/// through a face of its voxels; so what sleeps and is at the same temperature as its neighbours exchanges nothing.
///
/// A page that is new among the awake looks across its sides, and takes in those through which something may flow:
/// both pages of such a face are always stepped together, and no heat is lost.
///
/// Where a tick is much shorter than stability asks for, one step stands for several of them (heat_interval): the pages
/// stay awake until its turn.
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

constexpr size_t kPagesATask = 32, kLookupsATask = 1024;
constexpr size_t kPagesAhead = 2;   // asked for: the next is across z of this one
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
  std::unique_ptr<ThermalKinds> kinds;  // where it isn't of one material
};

class Heat final : public Rule {
 public:
  explicit Heat(size_t rule) : rule_(rule) {}
  RuleReport step(Cells& cells, const Tick& tick) override;

 private:
  void step_once(Cells& cells, const HeatStep& step, bool implicit, RuleReport& report);
  void find_pages(Cells& cells, const HeatStep& step);
  void prepare_stale(const Cells& cells);
  void prepare(const Cells& cells, PageId p);
  bool is_stale(const Cells& cells, PageId p) const {
    return !pages_[p].ready || pages_[p].content != cells.content_changes(p);
  }
  void source(const Cells& cells, PageId p, HeatSource& into) const;
  HeatSource source(const Cells& cells, PageId p) const {
    HeatSource made;
    source(cells, p, made);
    return made;
  }
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
  std::vector<uint8_t> looks_;  // by page: is awake in the next step
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
  const auto amount = [&](size_t i) { return amounts && cells.is_fluid(ids[i]) ? amounts[i] : kFullVoxel; };
  page.all = thermal_->voxel(ids[0], amount(0));
  bool uniform = std::all_of(ids.begin(), ids.end(), [&](BlockId id) { return id == ids[0]; });
  for (size_t i = 0; uniform && amounts && i < ids.size(); ++i) uniform = amount(i) == amount(0);
  if (uniform) {
    page.kinds.reset();
    return;
  }
  if (!page.kinds) page.kinds = std::make_unique<ThermalKinds>();
  ThermalKinds& k = *page.kinds;
  k.all.clear();
  // Found by a hash of block and amount: water may have as many amounts as voxels.
  constexpr uint32_t kSlots = 1024, kNobody = 0xffffffff;
  std::array<uint32_t, kSlots> of;
  std::array<uint16_t, kSlots> number;
  of.fill(kNobody);
  for (size_t i = 0; i < ids.size(); ++i) {
    const uint32_t what = static_cast<uint32_t>(ids[i]) << 16 | static_cast<uint32_t>(amount(i));
    if (i > 0 && ids[i] == ids[i - 1] && amount(i) == amount(i - 1)) {
      k.kind[i] = k.kind[i - 1];
      continue;
    }
    uint32_t slot = what * 0x9e3779b1u >> 22;
    while (of[slot] != kNobody && of[slot] != what) slot = (slot + 1) % kSlots;
    if (of[slot] == kNobody) {
      of[slot] = what, number[slot] = static_cast<uint16_t>(k.all.size());
      k.all.push_back(thermal_->voxel(ids[i], amount(i)));
    }
    k.kind[i] = number[slot];
  }
  k.finish();
}

/// Written in place: a copy of parts that were just stored waits for all of them.
void Heat::source(const Cells& cells, PageId p, HeatSource& into) const {
  into.temperature = nullptr;
  into.closed = p == kClosedPage;
  if (into.closed) return;
  const HeatPage& page = pages_[p];
  into.heat = cells.find_heats(p);
  into.kinds = page.kinds.get();
  into.all = page.all;
}

void Heat::sources_around(const Cells& cells, PageId p, HeatSource* sides) const {
  for (size_t f = 0; f < 6; ++f) source(cells, cells.around(p)[kFacePage[f]], sides[f]);
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
  // What is beside them is looked at too. Where nothing changed, as in most steps, all threads find that out.
  std::atomic<bool> any_stale{false};
  world::parallel_ranges(list_.size(), kLookupsATask, [&](size_t begin, size_t end) {
    bool any = false;
    for (size_t n = begin; n < end && !any; ++n) {
      any |= is_stale(cells, list_[n]);
      for (const size_t around : kFacePage) {
        const PageId other = cells.around(list_[n])[around];
        any |= other != kClosedPage && is_stale(cells, other);
      }
    }
    if (any) any_stale.store(true, std::memory_order_relaxed);
  });
  if (any_stale) prepare_stale(cells);
  for (const PageId p : list_) pages_[p].listed = false;
}

/// Of the listed pages, and those beside them.
void Heat::prepare_stale(const Cells& cells) {
  stale_.clear();
  for (const PageId p : list_) {
    if (is_stale(cells, p)) stale_.push_back(p);
    for (const size_t around : kFacePage) {
      const PageId other = cells.around(p)[around];
      if (other == kClosedPage || pages_[other].listed || !is_stale(cells, other)) continue;
      pages_[other].listed = true;
      stale_.push_back(other);
    }
  }
  world::parallel_ranges(stale_.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) prepare(cells, stale_[n]);
  });
  for (const PageId p : stale_) pages_[p].listed = false;
}

void Heat::conduct_explicit(Cells& cells, const HeatStep& step) {
  world::parallel_ranges(list_.size(), kPagesATask, [&](size_t begin, size_t end) {
    HeatSource page, sides[6];
    for (size_t n = begin; n < end; ++n) {
      source(cells, list_[n], page);
      sources_around(cells, list_[n], sides);
      const size_t next = std::min(n + kPagesAhead, list_.size() - 1);
      const std::array<PageId, 27>& around = cells.around(list_[next]);
      const HeatAhead ahead = {.own = cells.find_heats(list_[next]),
                               .low_x = cells.find_heats(around[kFacePage[0]]),
                               .high_x = cells.find_heats(around[kFacePage[1]]),
                               .high_y = cells.find_heats(around[kFacePage[3]]),
                               .into = heats_[next]->data(),
                               .own_kinds = pages_[list_[next]].kinds.get(),
                               .high_x_kinds = pages_[around[kFacePage[1]]].kinds.get(),
                               .high_y_kinds = pages_[around[kFacePage[3]]].kinds.get()};
      results_[n] = conduct(page, sides, step, heats_[n]->data(), ahead);
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
    if (!s.kinds) ratio(s.all.resistance, s.all.share);
    for (size_t k = 0; s.kinds && k < s.kinds->all.size(); ++k)
      ratio(s.kinds->all[k].resistance, s.kinds->all[k].share);
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
  for (size_t n = 0; n < list_.size(); ++n)
    if (results_[n].sides_changed) cells.open_around(list_[n]);
  looks_.resize(cells.page_limit(), 0);
  const auto look = [&](PageId p) { std::atomic_ref<uint8_t>(looks_[p]).store(1, std::memory_order_relaxed); };
  std::atomic<uint64_t> changed{0};
  world::parallel_ranges(list_.size(), kLookupsATask, [&](size_t begin, size_t end) {
    uint64_t count = 0;
    for (size_t n = begin; n < end; ++n) {
      const HeatResult& result = results_[n];
      const PageId p = list_[n];
      if (result.flows) {
        cells.swap_heats(p, heats_[n]);
        cells.stir_heat(p);
        count += result.changed;
      }
      pages_[p].stepped = steps_;
      pages_[p].heat = cells.heat_changes(p);
      if (result.live) look(p);
      for (uint32_t s = result.sides_changed; s; s &= s - 1)
        look(cells.around(p)[kFacePage[static_cast<size_t>(std::countr_zero(s))]]);
    }
    changed += count;
  });
  AwakeSet& set = cells.awake(rule_);
  for (size_t begin = 0; begin < looks_.size(); begin += sizeof(uint64_t)) {
    const size_t end = std::min(begin + sizeof(uint64_t), looks_.size());
    uint64_t eight = 0;
    std::memcpy(&eight, looks_.data() + begin, end - begin);
    for (size_t p = begin; eight && p < end; ++p)
      if (looks_[p]) looks_[p] = 0, set.add(static_cast<PageId>(p));
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
  if (!thermal_)
    thermal_ = std::make_unique<ThermalTraits>(cells.palette(), tick.options->reactions, tick.options->rest_k);
  thermal_->follow();
  const SimKnobs& knobs = tick.options->knobs;
  const auto plan = plan_heat(knobs, thermal_->largest_diffusivity());
  if (!plan.ok()) {
    report.notes.push_back("heat stands still: " + plan.error().message);
    cells.awake(rule_).clear();
    return report;
  }
  const auto interval = static_cast<uint64_t>(plan->interval);
  if (tick.number % interval != interval - 1) return report;
  const bool implicit = knobs.heat_scheme == HeatScheme::implicit;
  for (int s = 0; s < plan->substeps && !cells.awake(rule_).empty(); ++s) {
    const uint64_t number = tick.number / interval * static_cast<uint64_t>(plan->substeps) + static_cast<uint64_t>(s);
    step_once(cells, {.scale = static_cast<float>(plan->dt / kHeatUnitJ), .phase = heat_phase(number)}, implicit,
              report);
  }
  report.bytes = pages_.capacity() * sizeof(HeatPage) + heats_.size() * sizeof(Cells::Heats);
  for (const HeatPage& page : pages_)
    if (page.kinds) report.bytes += sizeof(ThermalKinds) + page.kinds->all.capacity() * sizeof(ThermalVoxel);
  return report;
}

}  // namespace

RuleInfo heat_info() {
  return {.name = "heat",
          .what = "what is warmer warms what is beside it",
          .conserves = "energy",
          .layers = "blocks, heat",
          .calls = calls_for_heat,
          .feels_heat = true,
          .reacts = true};
}
std::unique_ptr<Rule> make_heat_rule(size_t rule) { return std::make_unique<Heat>(rule); }

}  // namespace sim
