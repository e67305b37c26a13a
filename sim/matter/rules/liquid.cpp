/// liquid: water, oil, lava and others of finite volume. Falls, spreads by differences of level, and by weight through
/// basins that communicate. The flows: sim/matter/liquid_kernel.h.
///
/// knobs  liquid_model: finite volumes, or the levels of block games, which make and lose liquid (booked);
///        liquid_passes: rounds sideways in a tick
///
/// A tick takes the liquids one after the other, the heaviest first. A voxel holds one of them. What is neither that
/// liquid nor air is a wall to it: liquids don't sink under one another, and gases bear them.
#include <algorithm>
#include <atomic>
#include <memory>

#include "sim/matter/liquid_kernel.h"
#include "sim/matter/liquid_level.h"
#include "sim/matter/matter.h"
#include "sim/matter/rule.h"
#include "world/base/jobs.h"
#include "world/base/random.h"

namespace sim {

namespace {

using world::BlockId;
using world::LeafMask;

constexpr size_t kGrain = 8;  // pages a task
constexpr double kTickSeconds = 0.05;
constexpr int kFilm = 64;  // 1.6 cm
constexpr uint64_t kLevelTicks = 2;
constexpr uint8_t kRoundsToRest = 2;
constexpr int kMostPasses = 16;
// Levels of block games: a source has 8, and each takes 5 ticks to the next voxel.
constexpr int kGameLevels = 8, kGameLevel = kFullVoxel / kGameLevels;
constexpr uint64_t kGameTicks = 5;

/// What a page is to the liquid that flows now.
struct LiquidPage {
  alignas(64) uint16_t own[world::kLeafVoxels];  // amounts; kNoEntry
  LiquidFlow flow;
  uint64_t viewed = 0, falls = 0, slides = 0;  // rounds in which own, flow.down and flow.side were written
};

class Liquid final : public Rule {
 public:
  explicit Liquid(size_t rule) : rule_(rule) {}
  RuleReport step(Cells& cells, const Tick& tick) override;

 private:
  void flow_of(Cells& cells, BlockId liquid, const Tick& tick, RuleReport& report);
  void view(const Cells& cells, PageId p, BlockId liquid);
  void view_edges(const Cells& cells, PageId p, BlockId liquid, LiquidView& into) const;
  bool store(Cells& cells, PageId p, BlockId liquid, std::atomic<uint64_t>& changed);
  void spread_levels(Cells& cells, BlockId liquid, RuleReport& report);
  void level(Cells& cells, BlockId liquid, const Tick& tick, RuleReport& report);
  void add_targets(Cells& cells, std::vector<PageId>& pages, bool down);
  const LiquidPage* viewed(PageId p) const {
    return p < pages_.size() && pages_[p] && pages_[p]->viewed == round_ ? pages_[p].get() : nullptr;
  }

  const size_t rule_;
  uint64_t round_ = 0;        // counts liquids over all ticks
  uint64_t slide_round_ = 0;  // and passes sideways
  std::vector<std::unique_ptr<LiquidPage>> pages_;
  std::vector<PageId> flowing_;
  std::vector<uint8_t> holds_, listed_;
  std::vector<uint8_t> restless_, moved_;  // by flowing page
  std::vector<uint8_t> watch_;             // by page: rounds of levelling in which nothing may move before it sleeps
  std::vector<uint8_t> levelled_;          // by page, in this round: 1 looked at, 2 something moved
  std::vector<uint8_t> kept_;              // by page: it is awake because this rule kept it so
  LiquidLevels levels_;
};

/// The amount of the liquid in a voxel, or kNoEntry.
uint16_t amount_of(const Cells& cells, PageId p, int index, BlockId liquid) {
  const BlockId* blocks = cells.find_blocks(p);
  if (!blocks) return cells.occupied_mask(p).test(index) ? kNoEntry : uint16_t{0};
  if (blocks[index] == world::kAir) return 0;
  if (blocks[index] != liquid) return kNoEntry;
  const uint16_t* amounts = cells.find_amounts(p);
  return amounts ? amounts[index] : uint16_t{kFullVoxel};
}

void Liquid::view(const Cells& cells, PageId p, BlockId liquid) {
  LiquidPage& page = *pages_[p];
  page.viewed = round_;
  const BlockId* blocks = cells.find_blocks(p);
  const uint16_t* amounts = cells.find_amounts(p);
  if (!blocks) {
    for (int x = 0; x < 8; ++x) {
      const uint64_t occupied = cells.occupied_mask(p).word[x];
      for (int b = 0; b < 64; ++b) page.own[x * 64 + b] = occupied >> b & 1 ? kNoEntry : uint16_t{0};
    }
  } else {
    for (int i = 0; i < world::kLeafVoxels; ++i) {
      const uint16_t here = amounts ? amounts[i] : uint16_t{kFullVoxel};
      page.own[i] = blocks[i] == liquid ? here : blocks[i] == world::kAir ? uint16_t{0} : kNoEntry;
    }
  }
}

/// The voxels beside the page: from their pages' own view, where they have one.
void Liquid::view_edges(const Cells& cells, PageId p, BlockId liquid, LiquidView& into) const {
  const std::array<PageId, 27>& around = cells.around(p);
  const auto fill = [&](PageId from, uint16_t* edge, auto index_of) {
    if (const LiquidPage* other = viewed(from)) {
      for (int i = 0; i < 64; ++i) edge[i] = other->own[index_of(i)];
    } else {
      for (int i = 0; i < 64; ++i) edge[i] = amount_of(cells, from, index_of(i), liquid);
    }
  };
  fill(around[kBelow], into.below, [](int i) { return (i >> 3) * 64 + 56 + (i & 7); });
  fill(around[around_index(1, 0, 0)], into.side[0], [](int i) { return i; });
  fill(around[around_index(0, 0, 1)], into.side[1], [](int i) { return i * 8; });
  fill(around[around_index(-1, 0, 0)], into.side[2], [](int i) { return 448 + i; });
  fill(around[around_index(0, 0, -1)], into.side[3], [](int i) { return i * 8 + 7; });
}

/// Writes the page's view back: amounts, ids and planes. Tells who has to look again.
bool Liquid::store(Cells& cells, PageId p, BlockId liquid, std::atomic<uint64_t>& changed) {
  const LiquidPage& page = *pages_[p];
  LeafMask moved;
  uint64_t count = 0;
  const BlockId* before_blocks = cells.find_blocks(p);
  const uint16_t* before = cells.find_amounts(p);
  for (int i = 0; i < world::kLeafVoxels; ++i) {
    const uint16_t now = page.own[i];
    if (now == kNoEntry) continue;
    const uint16_t was =
        before_blocks && before_blocks[i] == liquid ? (before ? before[i] : uint16_t{kFullVoxel}) : uint16_t{0};
    if (now == was) continue;
    moved.set(i);
    ++count;
  }
  if (count == 0) return false;
  Cells::Blocks& blocks = cells.blocks(p);
  Cells::Amounts& amounts = cells.amounts(p);
  for (int x = 0; x < 8; ++x)
    for (uint64_t bits = moved.word[x]; bits; bits &= bits - 1) {
      const auto i = static_cast<size_t>(x * 64 + std::countr_zero(bits));
      blocks[i] = page.own[i] > 0 ? liquid : world::kAir;
      amounts[i] = page.own[i];
    }
  cells.set_rich(p);
  cells.stir(p, moved);
  changed += count;
  return true;
}

/// Adds the pages into which something flows from those of the list, and gives them a view.
void Liquid::add_targets(Cells& cells, std::vector<PageId>& pages, bool down) {
  listed_.resize(cells.page_limit(), 0);
  for (const PageId p : pages) listed_[p] = 1;
  const size_t sources = pages.size();
  const auto add = [&](PageId to) {
    if (listed_[to]) return;
    listed_[to] = 1;
    pages.push_back(to);
  };
  const auto any = [](const uint16_t* flow, auto index_of) {
    uint16_t all = 0;
    for (int i = 0; i < 64; ++i) all |= flow[index_of(i)];
    return all != 0;
  };
  for (size_t n = 0; n < sources; ++n) {
    const PageId p = pages[n];
    const LiquidPage& page = *pages_[p];
    const std::array<PageId, 27>& around = cells.around(p);
    if (down) {
      if (page.falls == round_ && any(page.flow.down, [](int i) { return (i >> 3) * 64 + (i & 7); }))
        add(around[kBelow]);
      continue;
    }
    if (page.slides != slide_round_) continue;
    if (any(page.flow.side[0], [](int i) { return 448 + i; })) add(around[around_index(1, 0, 0)]);
    if (any(page.flow.side[1], [](int i) { return i * 8 + 7; })) add(around[around_index(0, 0, 1)]);
    if (any(page.flow.side[2], [](int i) { return i; })) add(around[around_index(-1, 0, 0)]);
    if (any(page.flow.side[3], [](int i) { return i * 8; })) add(around[around_index(0, 0, -1)]);
  }
  for (const PageId p : pages) listed_[p] = 0;
  for (size_t n = sources; n < pages.size(); ++n) cells.open_around(pages[n]);
  pages_.resize(cells.page_limit());
  for (size_t n = sources; n < pages.size(); ++n)
    if (!pages_[pages[n]]) pages_[pages[n]] = std::make_unique<LiquidPage>();
}

void Liquid::flow_of(Cells& cells, BlockId liquid, const Tick& tick, RuleReport& report) {
  ++round_;
  const std::vector<PageId>& awake = cells.awake(rule_).now();
  const BlockTraits& traits = cells.traits()[liquid];
  const Spread spread = spread_of(traits.density, traits.viscosity_pa_s, kTickSeconds, kFilm);
  // Pages that hold some of it.
  holds_.assign(awake.size(), 0);
  world::parallel_ranges(awake.size(), 4 * kGrain, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n)
      if (const BlockId* blocks = cells.find_blocks(awake[n])) holds_[n] = holds_block(blocks, liquid);
  });
  flowing_.clear();
  for (size_t n = 0; n < awake.size(); ++n)
    if (holds_[n]) flowing_.push_back(awake[n]);
  if (flowing_.empty()) return;
  // What something else woke may be out of level.
  for (const PageId p : flowing_)
    if (!kept_[p]) watch_[p] = kRoundsToRest;
  pages_.resize(cells.page_limit());
  for (const PageId p : flowing_)
    if (!pages_[p]) pages_[p] = std::make_unique<LiquidPage>();
  const auto each = [&](size_t from, auto work) {
    world::parallel_ranges(flowing_.size() - from, kGrain, [&](size_t begin, size_t end) {
      for (size_t n = from + begin; n < from + end; ++n) work(flowing_[n], n);
    });
  };
  each(0, [&](PageId p, size_t) { view(cells, p, liquid); });

  // Down.
  each(0, [&](PageId p, size_t) {
    LiquidView edges;
    LiquidPage& page = *pages_[p];
    view_edges(cells, p, liquid, edges);
    std::copy(page.own, page.own + world::kLeafVoxels, edges.own);
    if (flow_down(edges, page.flow)) page.falls = round_;
  });
  size_t known = flowing_.size();
  add_targets(cells, flowing_, true);
  each(known, [&](PageId p, size_t) { view(cells, p, liquid); });
  each(0, [&](PageId p, size_t) {
    LiquidPage& page = *pages_[p];
    const PageId above = cells.around(p)[kAbove];
    const LiquidPage* from = viewed(above);
    const bool in = from && from->falls == round_;
    if (!in && page.falls != round_) return;
    if (page.falls != round_) std::fill_n(page.flow.down, world::kLeafVoxels, uint16_t{0});
    LiquidInflow inflow;
    if (in)
      for (int i = 0; i < 64; ++i) inflow.above[i] = from->flow.down[(i >> 3) * 64 + (i & 7)];
    apply_down(page.flow, inflow, page.own);
  });

  // Sideways.
  const int passes = std::clamp(tick.options->knobs.liquid_passes, 1, kMostPasses);
  for (int pass = 0; pass < passes; ++pass) {
    ++slide_round_;
    restless_.assign(flowing_.size(), 0);
    each(0, [&](PageId p, size_t n) {
      LiquidView edges;
      LiquidPage& page = *pages_[p];
      view_edges(cells, p, liquid, edges);
      std::copy(page.own, page.own + world::kLeafVoxels, edges.own);
      const uint64_t turn = tick.number * static_cast<uint64_t>(passes) + static_cast<uint64_t>(pass);
      const uint64_t hash = world::hash_combine(cells.hash(p) + turn * 0x9e3779b97f4a7c15ull, liquid);
      const SideFlow flow = flow_sideways(edges, spread, hash, page.flow);
      if (flow.flows) page.slides = slide_round_;
      restless_[n] = flow.restless;
    });
    for (size_t n = 0; n < flowing_.size(); ++n)
      if (restless_[n]) cells.awake(rule_).add(flowing_[n]);
    known = flowing_.size();
    add_targets(cells, flowing_, false);
    each(known, [&](PageId p, size_t) { view(cells, p, liquid); });
    each(0, [&](PageId p, size_t) {
      LiquidPage& page = *pages_[p];
      const std::array<PageId, 27>& around = cells.around(p);
      constexpr size_t kFrom[kSides] = {around_index(-1, 0, 0), around_index(0, 0, -1), around_index(1, 0, 0),
                                        around_index(0, 0, 1)};
      LiquidInflow inflow;
      bool in = page.slides == slide_round_;
      if (!in)
        for (auto& side : page.flow.side) std::fill_n(side, world::kLeafVoxels, uint16_t{0});
      for (int d = 0; d < kSides; ++d) {
        const LiquidPage* from = viewed(around[kFrom[d]]);
        if (!from || from->slides != slide_round_) continue;
        in = true;
        for (int i = 0; i < 64; ++i) {
          const int index = d == 0 ? 448 + i : d == 1 ? i * 8 + 7 : d == 2 ? i : i * 8;
          inflow.side[d][i] = from->flow.side[d][index];
        }
      }
      if (in) apply_sideways(page.flow, inflow, page.own);
    });
  }

  std::atomic<uint64_t> changed{0};
  moved_.assign(flowing_.size(), 0);
  each(0, [&](PageId p, size_t n) { moved_[n] = store(cells, p, liquid, changed); });
  report.voxels_changed += changed;
  watch_.resize(cells.page_limit(), 0);
  for (size_t n = 0; n < flowing_.size(); ++n)
    if (moved_[n]) watch_[flowing_[n]] = kRoundsToRest;
  if (tick.number % kLevelTicks == 0) level(cells, liquid, tick, report);
  report.leaves_visited += flowing_.size();
}

/// Pressure, through all of each body. Pages stay awake until rounds of both kinds of tiles have moved nothing.
void Liquid::level(Cells& cells, BlockId liquid, const Tick& tick, RuleReport& report) {
  const LiquidLevels::Result result = levels_.level(cells, liquid, flowing_, tick.number / kLevelTicks, tick.seed);
  report.voxels_changed += result.voxels_changed;
  levelled_.resize(cells.page_limit(), 0);
  for (size_t n = 0; n < flowing_.size(); ++n) {
    uint8_t& of_page = levelled_[flowing_[n]];
    of_page = std::max<uint8_t>(of_page, result.moved[n] ? 2 : 1);
  }
}

/// The rule of block games: full voxels are sources for ever; what flows has a level, seven below a source or under
/// what falls, one less a step to the sides; it goes where nothing feeds it. Two sources beside one voxel make a third.
void Liquid::spread_levels(Cells& cells, BlockId liquid, RuleReport& report) {
  ++round_;
  ++slide_round_;
  const std::vector<PageId>& awake = cells.awake(rule_).now();
  flowing_.clear();
  for (const PageId p : awake)
    if (const BlockId* blocks = cells.find_blocks(p); blocks && holds_block(blocks, liquid)) flowing_.push_back(p);
  if (flowing_.empty()) return;
  const auto each = [&](size_t from, auto work) {
    world::parallel_ranges(flowing_.size() - from, kGrain, [&](size_t begin, size_t end) {
      for (size_t n = from + begin; n < from + end; ++n) work(flowing_[n]);
    });
  };
  pages_.resize(cells.page_limit());
  for (const PageId p : flowing_)
    if (!pages_[p]) pages_[p] = std::make_unique<LiquidPage>();
  each(0, [&](PageId p) { view(cells, p, liquid); });
  // What each voxel offers: to below that it falls, to the sides a level.
  each(0, [&](PageId p) {
    LiquidView edges;
    view_edges(cells, p, liquid, edges);
    LiquidPage& page = *pages_[p];
    page.falls = round_, page.slides = slide_round_;
    for (int i = 0; i < world::kLeafVoxels; ++i) {
      const uint16_t here = page.own[i] == kNoEntry ? uint16_t{0} : page.own[i];
      const uint16_t below = (i & 56) != 0 ? page.own[i - 8] : edges.below[beside_y(i)];
      // A level that may fall goes nowhere else; a source spreads all the same.
      const bool borne = below >= kFullVoxel || here >= kFullVoxel;
      const int level = (here + kGameLevel - 1) / kGameLevel;
      page.flow.down[i] = here > 0 && below < kFullVoxel;
      const uint16_t offer = borne && level > 1 ? static_cast<uint16_t>(level - 1) : uint16_t{0};
      for (auto& side : page.flow.side) side[i] = offer;
    }
  });
  size_t known = flowing_.size();
  add_targets(cells, flowing_, true);
  add_targets(cells, flowing_, false);
  each(known, [&](PageId p) { view(cells, p, liquid); });
  // What each voxel becomes.
  each(0, [&](PageId p) {
    LiquidPage& page = *pages_[p];
    const std::array<PageId, 27>& around = cells.around(p);
    const auto of = [&](PageId from, int index, int side) -> uint16_t {
      const LiquidPage* other = viewed(from);
      if (!other || other->slides != slide_round_) return 0;
      return side < 0 ? other->flow.down[index] : other->flow.side[side][index];
    };
    LiquidView edges;
    view_edges(cells, p, liquid, edges);
    uint16_t next[world::kLeafVoxels];
    for (int i = 0; i < world::kLeafVoxels; ++i) {
      next[i] = page.own[i];
      if (page.own[i] >= kFullVoxel) continue;  // a source, or a wall
      const bool falls = (i & 56) != 56 ? of(p, i + 8, -1) : of(around[kAbove], i - 56, -1);
      uint16_t offers[kSides];
      offers[0] = i >= 64 ? of(p, i - 64, 0) : of(around[around_index(-1, 0, 0)], i + 448, 0);
      offers[1] = (i & 7) != 0 ? of(p, i - 1, 1) : of(around[around_index(0, 0, -1)], i + 7, 1);
      offers[2] = i < 448 ? of(p, i + 64, 2) : of(around[around_index(1, 0, 0)], i - 448, 2);
      offers[3] = (i & 7) != 7 ? of(p, i + 1, 3) : of(around[around_index(0, 0, 1)], i - 7, 3);
      const auto sources = std::count(offers, offers + kSides, uint16_t{kGameLevels - 1});
      const uint16_t below = (i & 56) != 0 ? page.own[i - 8] : edges.below[beside_y(i)];
      const int level = falls ? kGameLevels - 1 : *std::max_element(offers, offers + kSides);
      const bool source = sources >= 2 && below >= kFullVoxel;
      next[i] = source ? uint16_t{kFullVoxel} : static_cast<uint16_t>(level * kGameLevel);
    }
    std::copy(next, next + world::kLeafVoxels, page.flow.down);  // not own yet: neighbours look at it
  });
  each(0, [&](PageId p) { std::copy_n(pages_[p]->flow.down, world::kLeafVoxels, pages_[p]->own); });
  std::atomic<uint64_t> changed{0};
  std::atomic<int64_t> made{0}, gone{0};
  each(0, [&](PageId p) {
    int64_t before = 0, after = 0;
    for (int i = 0; i < world::kLeafVoxels; ++i) {
      if (cells.block(p, i) == liquid) before += cells.amount(p, i);
      if (pages_[p]->own[i] != kNoEntry) after += pages_[p]->own[i];
    }
    store(cells, p, liquid, changed);
    (after > before ? made : gone) += std::abs(after - before);
  });
  if (made > 0) cells.book(liquid, made);
  if (gone > 0) cells.book(liquid, -gone);
  report.voxels_changed += changed;
  report.leaves_visited += flowing_.size();
}

RuleReport Liquid::step(Cells& cells, const Tick& tick) {
  RuleReport report;
  AwakeSet& set = cells.awake(rule_);
  set.begin();
  if (set.now().empty()) return report;
  for (const PageId p : set.now()) cells.open_around(p);
  watch_.resize(cells.page_limit(), 0);
  kept_.resize(cells.page_limit(), 0);
  std::vector<BlockId> liquids;
  for (size_t id = 0; id < cells.traits().size(); ++id)
    if (const auto block = static_cast<BlockId>(id);
        cells.traits()[block].content == Content::liquid && cells.met(block))
      liquids.push_back(block);
  std::stable_sort(liquids.begin(), liquids.end(),
                   [&](BlockId a, BlockId b) { return cells.traits()[a].density > cells.traits()[b].density; });
  if (tick.options->knobs.liquid_model == LiquidModel::levels) {
    if (tick.number % kGameTicks == 0)
      for (const BlockId liquid : liquids) spread_levels(cells, liquid, report);
    else
      for (const PageId p : set.now()) set.add(p);
    cells.spread();
    return report;
  }
  for (const BlockId liquid : liquids) flow_of(cells, liquid, tick, report);
  watch_.resize(cells.page_limit(), 0);
  levelled_.resize(cells.page_limit(), 0);
  if (tick.number % kLevelTicks == 0)
    for (const PageId p : set.now())
      if (levelled_[p] == 0) watch_[p] = 0;  // it holds no liquid
  for (size_t p = 0; p < levelled_.size(); ++p) {
    if (levelled_[p])
      watch_[p] = static_cast<uint8_t>(levelled_[p] == 2 ? kRoundsToRest : watch_[p] ? watch_[p] - 1 : 0);
    levelled_[p] = 0;
    if (watch_[p]) set.add(static_cast<PageId>(p));
  }
  kept_.assign(cells.page_limit(), 0);
  for (const PageId p : set.next()) kept_[p] = 1;
  cells.spread();
  return report;
}

}  // namespace

RuleInfo liquid_info() {
  return {.name = "liquid",
          .what = "water, oil, lava and others flow and find their level",
          .conserves = "amount of each liquid",
          .calls = [](const world::Block& block) { return block.phase == world::Phase::liquid; }};
}
std::unique_ptr<Rule> make_liquid_rule(size_t rule) { return std::make_unique<Liquid>(rule); }

}  // namespace sim
