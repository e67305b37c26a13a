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
/// Heats are written over the old ones, page by page: what flows through a face is found by the first of its two pages,
/// and kept for the second. Pages are shared out in chunks; what lies at the border of two is copied before. A world
/// that is larger than the caches is read and written once a step, nothing else.
///
/// Where a tick is much shorter than stability asks for, one step stands for several of them (heat_interval): the pages
/// stay awake until its turn.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <utility>

#include "sim/matter/heat_kernel.h"
#include "sim/matter/heat_kinds.h"
#include "sim/matter/heat_plan.h"
#include "sim/matter/matter.h"
#include "world/base/jobs.h"
#include "world/store/leaf_shifts.h"

namespace sim {

namespace {

using world::BlockId;

constexpr size_t kPagesATask = 32, kLookupsATask = 1024;
constexpr size_t kChunksAThread = 1, kPagesAChunk = 8192, kCopiesAhead = 8;
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
  const ThermalKinds* kinds = nullptr;  // where it isn't of one material: of kinds_
};

/// Where the flows through a page's sides are: a number of its chunk's, kept from the first of two pages to the second.
struct PageFaces {
  std::array<uint16_t, 6> flow = {};
  uint8_t known = 0;          // bit face: found by the page beyond, or none
  uint8_t across_chunks = 0;  // bit face: the page beyond is of another chunk
  uint32_t copies = 0;        // first of the copied sides of those, in the order of faces
};
// Numbers that all chunks have: of faces that only one page asks for, and of those through which nothing flows.
constexpr uint16_t kClosedFlow = 6, kFirstFlow = 7;
static_assert(kPagesAChunk * 3 + kFirstFlow < 65536);  // each of a page's six faces is of two

/// Pages that one thread steps one after another.
struct HeatChunk {
  size_t flows = kFirstFlow;
  std::vector<std::pair<PageId, uint8_t>> copied;  // pages of other chunks, and their faces
  std::vector<uint16_t> free;                      // while it is made
  size_t first_copy = 0;
};
struct alignas(64) SideNumbers : std::array<int32_t, 64> {};

class Heat final : public Rule {
 public:
  explicit Heat(size_t rule) : rule_(rule) {}
  RuleReport step(Cells& cells, const Tick& tick) override;

 private:
  void step_once(Cells& cells, const HeatStep& step, bool implicit, RuleReport& report);
  void find_pages(Cells& cells, const HeatStep& step);
  bool are_fresh(const Cells& cells, const std::vector<PageId>& pages, bool known) const;
  void prepare_stale(const Cells& cells);
  void prepare(const Cells& cells, PageId p);
  bool is_stale(const Cells& cells, PageId p) const {
    return !pages_[p].ready || pages_[p].content != cells.content_changes(p);
  }
  /// Whether it took part in the last step, and what it holds is what it held after that.
  bool is_known(const Cells& cells, PageId p) const {
    return pages_[p].stepped + 1 == steps_ && !is_stale(cells, p) && pages_[p].heat == cells.heat_changes(p);
  }
  void source(const Cells& cells, PageId p, HeatSource& into) const;
  HeatSource source(const Cells& cells, PageId p) const {
    HeatSource made;
    source(cells, p, made);
    return made;
  }
  void sources_around(const Cells& cells, PageId p, HeatSource* sides) const;
  void share_out(const Cells& cells);
  void share_out_chunk(const Cells& cells, size_t chunk);
  void conduct_chunk(Cells& cells, const HeatStep& step, size_t chunk);
  void conduct_explicit(Cells& cells, const HeatStep& step);
  void find_live(const Cells& cells, const HeatStep& step);
  void conduct_implicit(Cells& cells, const HeatStep& step);
  void write(Cells& cells, RuleReport& report);

  const size_t rule_;  // its awake set
  uint64_t steps_ = 1;
  std::unique_ptr<ThermalTraits> thermal_;
  std::vector<HeatPage> pages_;
  SharedKinds kinds_;
  std::vector<PageId> list_, stale_;  // pages of this step
  std::vector<PageId> listed_;        // awake in a step before, their neighbours open
  uint64_t listed_changes_ = 0;
  std::vector<std::unique_ptr<Cells::Heats>> heats_;  // by list_: after the step, where it isn't in the page
  std::vector<HeatResult> results_;
  std::vector<uint8_t> looks_;  // by page: is awake in the next step
  // The implicit scheme's: four temperatures for each page.
  struct Sweep {
    alignas(64) float old[world::kLeafVoxels], before[world::kLeafVoxels], now[world::kLeafVoxels],
        next[world::kLeafVoxels];
  };
  std::vector<std::unique_ptr<Sweep>> sweeps_;  // by list_
  std::vector<int32_t> place_;                  // by page: in list_, or -1
  // Of shared_list_, as long as pages stay what they are.
  std::vector<PageId> shared_list_;
  uint64_t shared_changes_ = 0;
  int shared_threads_ = 0;
  size_t chunk_pages_ = 1;
  std::vector<PageFaces> faces_;  // by list_
  std::vector<HeatChunk> chunks_;
  std::vector<SideNumbers> copies_;
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
    kinds_.give_back(std::exchange(page.kinds, nullptr));
    return;
  }
  static thread_local ThermalKinds k;
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
  const ThermalKinds* shared = kinds_.share(k);
  kinds_.give_back(std::exchange(page.kinds, shared));
}

/// Written in place: a copy of parts that were just stored waits for all of them.
void Heat::source(const Cells& cells, PageId p, HeatSource& into) const {
  into.temperature = nullptr;
  into.closed = p == kClosedPage;
  if (into.closed) return;
  const HeatPage& page = pages_[p];
  into.heat = cells.find_heats(p);
  into.kinds = page.kinds;
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
  const std::vector<PageId>& now = set.now();
  if (listed_ == now && listed_changes_ == cells.page_changes() && are_fresh(cells, now, true)) {
    list_ = now;
    return;
  }
  for (const PageId p : now) list(p);
  for (size_t n = 0; n < list_.size(); ++n) {
    const PageId p = list_[n];
    if (is_known(cells, p)) continue;
    if (is_stale(cells, p)) prepare(cells, p);
    for (int face = 0; face < 6; ++face) {
      const PageId other = cells.around(p)[kFacePage[face]];
      if (other == kClosedPage || pages_[other].listed) continue;
      if (is_stale(cells, other)) prepare(cells, other);
      if (side_is_live(source(cells, p), source(cells, other), face, step)) list(other);
    }
  }
  // What is beside them is looked at too.
  if (!are_fresh(cells, list_, false)) prepare_stale(cells);
  for (const PageId p : list_) pages_[p].listed = false;
  listed_ = now, listed_changes_ = cells.page_changes();
}

/// Whether nothing is stale, of the pages and those beside them; and they are known, where that is asked for. All
/// threads find that out: in most steps it is so.
bool Heat::are_fresh(const Cells& cells, const std::vector<PageId>& pages, bool known) const {
  std::atomic<bool> fresh{true};
  world::parallel_ranges(pages.size(), kLookupsATask, [&](size_t begin, size_t end) {
    bool all = true;
    for (size_t n = begin; n < end && all; ++n) {
      all &= known ? is_known(cells, pages[n]) : !is_stale(cells, pages[n]);
      for (const size_t around : kFacePage) {
        const PageId other = cells.around(pages[n])[around];
        all &= other == kClosedPage || !is_stale(cells, other);
      }
    }
    if (!all) fresh.store(false, std::memory_order_relaxed);
  });
  return fresh;
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

/// Chunks of the list, and which flows each page finds and keeps. In most steps nothing changes.
void Heat::share_out(const Cells& cells) {
  const int threads = world::thread_count();
  if (shared_list_ == list_ && shared_changes_ == cells.page_changes() && shared_threads_ == threads) return;
  shared_list_ = list_, shared_changes_ = cells.page_changes(), shared_threads_ = threads;
  chunk_pages_ =
      std::clamp(list_.size() / (static_cast<size_t>(threads) * kChunksAThread) + 1, kPagesATask, kPagesAChunk);
  place_.assign(cells.page_limit(), -1);
  for (size_t n = 0; n < list_.size(); ++n) place_[list_[n]] = static_cast<int32_t>(n);
  faces_.resize(list_.size());
  chunks_.resize((list_.size() + chunk_pages_ - 1) / chunk_pages_);
  world::parallel_for(chunks_.size(), [&](size_t c) { share_out_chunk(cells, c); });
  size_t copies = 0;
  for (HeatChunk& chunk : chunks_) chunk.first_copy = copies, copies += chunk.copied.size();
  copies_.resize(copies);
}

void Heat::share_out_chunk(const Cells& cells, size_t c) {
  HeatChunk& chunk = chunks_[c];
  chunk.flows = kFirstFlow;
  chunk.copied.clear(), chunk.free.clear();
  const size_t begin = c * chunk_pages_, end = std::min(begin + chunk_pages_, list_.size());
  for (size_t n = begin; n < end; ++n) {
    PageFaces& page = faces_[n];
    page = {};
    page.copies = static_cast<uint32_t>(chunk.copied.size());
    for (uint8_t f = 0; f < 6; ++f) {
      const PageId other = cells.around(list_[n])[kFacePage[f]];
      page.flow[f] = f;
      if (other == kClosedPage) {
        page.flow[f] = kClosedFlow, page.known = static_cast<uint8_t>(page.known | 1 << f);
        continue;
      }
      if (place_[other] < 0) continue;
      const auto there = static_cast<size_t>(place_[other]);
      if (there < begin || there >= end) {
        page.across_chunks = static_cast<uint8_t>(page.across_chunks | 1 << f);
        chunk.copied.emplace_back(other, static_cast<uint8_t>(f ^ 1));
      } else if (there < n) {
        page.flow[f] = faces_[there].flow[f ^ 1], page.known = static_cast<uint8_t>(page.known | 1 << f);
      } else if (!chunk.free.empty()) {
        page.flow[f] = chunk.free.back();
        chunk.free.pop_back();
      } else {
        page.flow[f] = static_cast<uint16_t>(chunk.flows++);
      }
    }
    for (size_t f = 0; f < 6; ++f)
      if (page.known >> f & 1 && page.flow[f] != kClosedFlow) chunk.free.push_back(page.flow[f]);
  }
}

void Heat::conduct_chunk(Cells& cells, const HeatStep& step, size_t c) {
  const HeatChunk& chunk = chunks_[c];
  static thread_local std::vector<SideNumbers> flows;
  if (flows.size() < chunk.flows) flows.resize(chunk.flows);
  flows[kClosedFlow].fill(0);
  const size_t begin = c * chunk_pages_, end = std::min(begin + chunk_pages_, list_.size());
  HeatSource page, sides[6];
  for (size_t n = begin; n < end; ++n) {
    const PageId p = list_[n];
    const PageFaces& faces = faces_[n];
    source(cells, p, page);
    HeatFlows through;
    through.known = faces.known;
    size_t copy = chunk.first_copy + faces.copies;
    for (size_t f = 0; f < 6; ++f) {
      through.through[f] = flows[faces.flow[f]].data();
      source(cells, cells.around(p)[kFacePage[f]], sides[f]);
      sides[f].side = faces.across_chunks >> f & 1 ? copies_[copy++].data() : nullptr;
    }
    const size_t next = std::min(n + kPagesAhead, end - 1);
    const std::array<PageId, 27>& around = cells.around(list_[next]);
    const HeatAhead ahead = {.own = cells.find_heats(list_[next]),
                             .high_x = cells.find_heats(around[kFacePage[1]]),
                             .high_y = cells.find_heats(around[kFacePage[3]]),
                             .own_kinds = pages_[list_[next]].kinds,
                             .high_x_kinds = pages_[around[kFacePage[1]]].kinds,
                             .high_y_kinds = pages_[around[kFacePage[3]]].kinds};
    if (!page.heat && !heats_[n]) heats_[n] = std::make_unique<Cells::Heats>();
    int32_t* const into = page.heat ? cells.heats(p).data() : heats_[n]->data();
    results_[n] = conduct_in_place(page, sides, step, into, through, ahead);
  }
}

void Heat::conduct_explicit(Cells& cells, const HeatStep& step) {
  share_out(cells);
  world::parallel_for(chunks_.size(), [&](size_t c) {
    const HeatChunk& chunk = chunks_[c];
    for (size_t n = 0; n < chunk.copied.size(); ++n) {
      const auto& [other, face] = chunk.copied[n];
      const auto& [later, its_face] = chunk.copied[std::min(n + kCopiesAhead, chunk.copied.size() - 1)];
      if (const int32_t* heats = cells.find_heats(later); heats && its_face < 2)
        for (int line = 0; line < 4; ++line) __builtin_prefetch(heats + its_face * 7 * 64 + line * 16);
      copy_side(cells.find_heats(other), face, copies_[chunk.first_copy + n].data());
    }
  });
  world::parallel_for(chunks_.size(), [&](size_t c) { conduct_chunk(cells, step, c); });
  world::parallel_ranges(list_.size(), kLookupsATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n)
      if (results_[n].flows && !cells.find_heats(list_[n])) cells.swap_heats(list_[n], heats_[n]);
  });
  find_live(cells, step);
}

/// Whether something may flow in another phase, where nothing did in this one. What pages beside now hold is as good as
/// what they held: where that changed at the face, the page looks again in any case.
void Heat::find_live(const Cells& cells, const HeatStep& step) {
  world::parallel_ranges(list_.size(), kPagesATask, [&](size_t begin, size_t end) {
    HeatSource page, sides[6];
    for (size_t n = begin; n < end; ++n) {
      if (results_[n].live) continue;
      source(cells, list_[n], page);
      sources_around(cells, list_[n], sides);
      results_[n].live = is_live(page, sides, step);
    }
  });
}

/// Backward Euler on the pages in which something may flow, and those around; what is further exchanges nothing in this
/// step. Solved by Chebyshev's semi-iteration of Jacobi's method; the fluxes are those of the solution, in integers, so
/// that energy is exact however far the sweeps went.
/// source Gene Golub, Richard Varga. Chebyshev semi-iterative methods, successive overrelaxation iterative methods, and
///        second order Richardson iterative methods. 1961
void Heat::conduct_implicit(Cells& cells, const HeatStep& step) {
  // Find what is live.
  for (size_t n = 0; n < list_.size(); ++n)
    if (!heats_[n]) heats_[n] = std::make_unique<Cells::Heats>();
  world::parallel_ranges(list_.size(), kPagesATask, [&](size_t begin, size_t end) {
    HeatSource sides[6];
    for (size_t n = begin; n < end; ++n) {
      sources_around(cells, list_[n], sides);
      results_[n] = conduct(source(cells, list_[n]), sides, step, heats_[n]->data());
    }
  });
  std::vector<PageId> pages;
  place_.assign(cells.page_limit(), -1);
  shared_list_.clear();
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
  world::parallel_ranges(list_.size(), kLookupsATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n)
      if (results_[n].flows) cells.swap_heats(list_[n], heats_[n]);
  });
}

/// Tells who has to look again.
void Heat::write(Cells& cells, RuleReport& report) {
  std::atomic<bool> all_open{true};
  world::parallel_ranges(list_.size(), kLookupsATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n)
      if (results_[n].sides_changed && !cells.is_open_around(list_[n]))
        all_open.store(false, std::memory_order_relaxed);
  });
  for (size_t n = 0; n < list_.size() && !all_open; ++n)
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
  report.bytes = pages_.capacity() * sizeof(HeatPage) + faces_.capacity() * sizeof(PageFaces) +
                 copies_.capacity() * sizeof(SideNumbers) + kinds_.bytes();
  for (const auto& heats : heats_)
    if (heats) report.bytes += sizeof(Cells::Heats);
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
