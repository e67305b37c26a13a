/// liquid: water, oil, lava and others of finite volume. Falls, spreads by differences of level, and by weight through
/// basins that communicate. The flows: sim/matter/liquid_kernel.h.
///
/// knobs  liquid_model: finite volumes; with inertia, as waves; or the levels of block games, which make and lose
///        liquid (booked)
///        liquid_passes: finite: rounds sideways in a tick
///
/// A tick takes the liquids one after the other, the heaviest first. A voxel holds one of them. What is neither that
/// liquid nor air is a wall to it while it flows, and gases bear it; then denser liquids sink under lighter ones, voxel
/// by voxel: sim/matter/liquid_layers.h. What flows takes its heat along, but for levels of block games:
/// sim/matter/liquid_heat.h.
#include <algorithm>
#include <atomic>
#include <map>

#include <fmt/format.h>

#include "sim/matter/liquid_game_levels.h"
#include "sim/matter/liquid_heat.h"
#include "sim/matter/liquid_layers.h"
#include "sim/matter/liquid_level.h"
#include "sim/matter/liquid_pages.h"
#include "sim/matter/liquid_waves.h"
#include "sim/matter/matter.h"
#include "sim/matter/rule.h"
#include "world/base/jobs.h"
#include "world/base/random.h"

namespace sim {

namespace {

using world::BlockId;

constexpr size_t kPagesATask = 48;
constexpr double kTickSeconds = 0.05;
constexpr int kFilm = 64;  // 1.6 cm
constexpr uint64_t kLevelTicks = 4;
constexpr uint8_t kRoundsToRest = 2;

class Liquid final : public Rule {
 public:
  explicit Liquid(size_t rule) : rule_(rule) {}
  RuleReport step(Cells& cells, const Tick& tick) override;
  std::string state() const override;
  world::Status restore(Cells& cells, std::string_view text) override;

 private:
  /// A liquid that was met.
  struct Fluid {
    explicit Fluid(BlockId liquid) : pages(liquid) {}
    LiquidPages pages;
    LiquidWaves waves;
    std::string name;
  };
  Fluid& fluid_of(const Cells& cells, BlockId liquid);
  void find_liquids(const Cells& cells);
  void fit_pages(const Cells& cells);
  void forget_closed(Cells& cells);
  void flow_of(Cells& cells, Fluid& fluid, const Tick& tick, RuleReport& report);
  void roll(Cells& cells, Fluid& fluid, const Tick& tick);
  void fall_all(Cells& cells, LiquidPages& pages);
  void slide_all(Cells& cells, LiquidPages& pages, const Spread& spread, uint64_t turn);
  void add_targets(Cells& cells, LiquidPages& pages, size_t known);
  void level(Cells& cells, Fluid& fluid, const Tick& tick, RuleReport& report);
  template <class Work>
  void each(size_t from, Work work) {
    world::parallel_ranges(flowing_.size() - from, kPagesATask, [&](size_t begin, size_t end) {
      for (size_t n = from + begin; n < from + end; ++n) work(flowing_[n], n);
    });
  }

  const size_t rule_;   // its awake set
  uint64_t round_ = 0;  // counts the movements of all pages of a liquid
  uint64_t list_ = 0;   // and the lists of those that flow
  std::vector<std::unique_ptr<Fluid>> liquids_;
  std::vector<BlockId> order_;  // of a tick: the heaviest first
  std::vector<PageId> flowing_;
  std::vector<LiquidMove> moves_;  // by flowing page
  std::vector<uint8_t> moved_;     // by flowing page
  std::vector<uint8_t> watch_;     // by page: rounds of levelling in which nothing may move before it sleeps
  std::vector<uint8_t> levelled_;  // by page, in this round: 1 looked at, 2 something moved
  std::vector<uint8_t> kept_;      // by page: it is awake because this rule kept it so
  std::vector<std::pair<PageId, world::LeafPos>> kept_pages_;  // of kept_ and watch_, and what they were then
  LiquidLevels levels_;
  LiquidLayers layers_;
  LiquidHeat heat_;
};

Liquid::Fluid& Liquid::fluid_of(const Cells& cells, BlockId liquid) {
  for (const auto& fluid : liquids_)
    if (fluid->pages.liquid() == liquid) return *fluid;
  liquids_.push_back(std::make_unique<Fluid>(liquid));
  liquids_.back()->name = cells.palette()[liquid].name;
  return *liquids_.back();
}

/// The heaviest first.
void Liquid::find_liquids(const Cells& cells) {
  order_.clear();
  for (size_t id = 0; id < cells.traits().size(); ++id)
    if (const auto block = static_cast<BlockId>(id);
        cells.traits()[block].content == Content::liquid && cells.met(block))
      order_.push_back(block);
  std::sort(order_.begin(), order_.end(), [&](BlockId a, BlockId b) {
    return std::pair(-cells.traits()[a].density, a) < std::pair(-cells.traits()[b].density, b);
  });
}

/// What is known by page has room for each page that is open now; flow and layers open some.
void Liquid::fit_pages(const Cells& cells) {
  for (std::vector<uint8_t>* by_page : {&watch_, &levelled_, &kept_}) by_page->resize(cells.page_limit(), 0);
}

/// Pages that this rule kept awake, and that went away with their region, aren't watched: their number may be
/// another's.
void Liquid::forget_closed(Cells& cells) {
  for (const auto& [p, pos] : kept_pages_)
    if (cells.find(pos) != p) watch_[p] = kept_[p] = 0;
}

/// Adds the pages into which something flows from those of the list; they only take in this round.
void Liquid::add_targets(Cells& cells, LiquidPages& pages, size_t known) {
  for (size_t n = 0; n < known; ++n) {
    const PageId p = flowing_[n];
    const unsigned out = moves_[n].out;
    if (!out) continue;
    const auto add = [&](size_t around) {
      const PageId to = cells.around(p)[around];
      if (pages[to].listed == list_) return;
      pages[to].listed = list_;
      flowing_.push_back(to);
    };
    for (int d = 0; d < kSides; ++d)
      if (out >> d & 1) add(kSidePage[d]);
    if (out & kOutBelow) add(kBelow);
  }
  if (flowing_.size() == known) return;
  const std::span<const PageId> added(flowing_.data() + known, flowing_.size() - known);
  for (const PageId p : added) cells.open_around(p);
  pages.view_across(cells, added);
  moves_.resize(flowing_.size());
}

void Liquid::fall_all(Cells& cells, LiquidPages& pages) {
  ++round_;
  const size_t known = flowing_.size();
  moves_.assign(known, {});
  for (const PageId p : flowing_) pages[p].gives = round_;
  const auto fall_page = [&](PageId p, size_t n) {
    const auto part = [&](PageId of) { return LiquidPart{pages[of].own(), nullptr, pages[of].rows}; };
    const PageId above = cells.around(p)[kAbove];
    const bool gives = pages[p].gives == round_, above_gives = pages[above].gives == round_;
    moves_[n] = fall(part(p), part(cells.around(p)[kBelow]), part(above), gives, above_gives, pages[p].next());
  };
  each(0, fall_page);
  add_targets(cells, pages, known);
  each(known, fall_page);
  heat_.fall(cells, pages, flowing_, moves_, round_);
  for (size_t n = 0; n < flowing_.size(); ++n) pages[flowing_[n]].follow(moves_[n]);
}

void Liquid::slide_all(Cells& cells, LiquidPages& pages, const Spread& spread, uint64_t turn) {
  ++round_;
  const size_t known = flowing_.size();
  moves_.assign(known, {});
  each(0, [&](PageId p, size_t) {
    LiquidPage& page = pages[p];
    page.gives = round_;
    // Where all is full, here and beside, nothing pushes.
    const std::array<PageId, 27>& around = cells.around(p);
    unsigned still = page.rows.full;
    for (const size_t side : kSidePage) still &= pages[around[side]].rows.full;
    const auto rows = static_cast<uint8_t>(page.rows.wet & ~still);
    if (!rows) return;
    const uint64_t hash = world::hash_combine(cells.hash(p) + turn * 0x9e3779b97f4a7c15ull, pages.liquid());
    push_of(page.own(), pages[around[kBelow]].own(), rows, spread, hash, page.push());
  });
  const auto slide_page = [&](PageId p, size_t n) {
    const auto part = [&](PageId of) {
      const LiquidPage& page = pages[of];
      return LiquidPart{page.own(), page.gives == round_ ? page.push() : nullptr, page.rows};
    };
    LiquidPart sides[kSides];
    for (int d = 0; d < kSides; ++d) sides[d] = part(cells.around(p)[kSidePage[d]]);
    moves_[n] = slide(part(p), sides, spread.film, pages[p].next());
  };
  each(0, slide_page);
  for (size_t n = 0; n < known; ++n)
    if (moves_[n].restless) cells.awake(rule_).add(flowing_[n]);
  add_targets(cells, pages, known);
  each(known, slide_page);
  heat_.slide(cells, pages, flowing_, moves_, round_, spread.film);
  for (size_t n = 0; n < flowing_.size(); ++n) pages[flowing_[n]].follow(moves_[n]);
}

/// With inertia: what waves moved, and where they go on, is awake.
void Liquid::roll(Cells& cells, Fluid& fluid, const Tick& tick) {
  const BlockTraits& traits = cells.traits()[fluid.pages.liquid()];
  LiquidWaves::Liquid liquid;
  liquid.viscosity = static_cast<double>(traits.viscosity_pa_s) / static_cast<double>(traits.density);
  liquid.film = kFilm;
  liquid.tick_s = kTickSeconds;
  liquid.salt = world::hash_combine(world::hash_combine(tick.seed, tick.number), fluid.pages.liquid());
  fluid.waves.step(cells, fluid.pages, heat_, flowing_, liquid);
  for (const PageId p : fluid.waves.touched()) {
    if (fluid.pages[p].listed == list_) continue;
    fluid.pages[p].listed = list_;
    cells.open_around(p);
    flowing_.push_back(p);
  }
  for (const PageId p : fluid.waves.wavy()) cells.awake(rule_).add(p);
}

void Liquid::flow_of(Cells& cells, Fluid& fluid, const Tick& tick, RuleReport& report) {
  LiquidPages& pages = fluid.pages;
  const std::vector<PageId>& awake = cells.awake(rule_).now();
  const BlockTraits& traits = cells.traits()[pages.liquid()];
  // Pages that hold some of it.
  ++list_;
  pages.view(cells, awake);
  fit_pages(cells);  // liquids before this one may have opened some
  flowing_.clear();
  for (const PageId p : awake)
    if (pages[p].rows.wet) {
      pages[p].listed = list_;
      flowing_.push_back(p);
    }
  if (flowing_.empty()) return;
  // What something else woke may be out of level.
  for (const PageId p : flowing_)
    if (!kept_[p]) watch_[p] = kRoundsToRest;
  pages.view_across(cells, flowing_);
  fall_all(cells, pages);
  if (tick.options->knobs.liquid_model == LiquidModel::waves) {
    roll(cells, fluid, tick);
  } else {
    if (!fluid.waves.empty()) fluid.waves = {};  // of a world that had them
    const Spread spread = spread_of(traits.density, traits.viscosity_pa_s, kTickSeconds, kFilm);
    const int passes = std::clamp(tick.options->knobs.liquid_passes, 1, kMostLiquidPasses);
    for (int pass = 0; pass < passes; ++pass)
      slide_all(cells, pages, spread, tick.number * static_cast<uint64_t>(passes) + static_cast<uint64_t>(pass));
  }
  std::atomic<uint64_t> changed{0};
  moved_.assign(flowing_.size(), 0);
  world::parallel_ranges(flowing_.size(), kPagesATask, [&](size_t begin, size_t end) {
    uint64_t of_task = 0;
    for (size_t n = begin; n < end; ++n) {
      const uint64_t voxels = pages.store(cells, flowing_[n]);
      moved_[n] = voxels > 0;
      of_task += voxels;
    }
    changed += of_task;
  });
  report.voxels_changed += changed;
  fit_pages(cells);
  for (size_t n = 0; n < flowing_.size(); ++n)
    if (moved_[n]) watch_[flowing_[n]] = kRoundsToRest;
  if (tick.number % kLevelTicks == 0) level(cells, fluid, tick, report);
  report.leaves_visited += flowing_.size();
}

/// Pressure, through all of each body. Pages stay awake until rounds of both kinds of tiles have moved nothing.
void Liquid::level(Cells& cells, Fluid& fluid, const Tick& tick, RuleReport& report) {
  const LiquidLevels::Result& result = levels_.level(cells, fluid.pages, heat_, flowing_, tick.number / kLevelTicks,
                                                     tick.seed, [&](PageId p) { return fluid.waves.is_wavy(p); });
  report.voxels_changed += result.voxels_changed;
  for (size_t n = 0; n < flowing_.size(); ++n) {
    uint8_t& of_page = levelled_[flowing_[n]];
    of_page = std::max<uint8_t>(of_page, result.moved[n] ? 2 : 1);
  }
}

/// Velocities of waves: the name of each liquid, and its lines.
std::string Liquid::state() const {
  std::map<std::string, std::string> by_name;
  for (const auto& fluid : liquids_)
    if (!fluid->waves.empty()) by_name[fluid->name] = fluid->waves.state();
  std::string text;
  for (const auto& [name, lines] : by_name) text += "liquid " + name + "\n" + lines;
  return text;
}

world::Status Liquid::restore(Cells& cells, std::string_view text) {
  Fluid* fluid = nullptr;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    if (line.starts_with("liquid ")) {
      const auto block = cells.palette().find(line.substr(7));
      if (!block)
        return world::input_error(fmt::format("waves of \"{}\", which isn't a block of this world", line.substr(7)));
      fluid = &fluid_of(cells, *block);
    } else if (!fluid) {
      return world::input_error("what liquids hold must begin with the name of one");
    } else {
      TRY_STATUS(fluid->waves.restore(line));
    }
  }
  return {};
}

RuleReport Liquid::step(Cells& cells, const Tick& tick) {
  RuleReport report;
  AwakeSet& set = cells.awake(rule_);
  set.begin();
  if (set.now().empty()) return report;
  for (const PageId p : set.now()) cells.open_around(p);
  fit_pages(cells);
  forget_closed(cells);
  find_liquids(cells);
  if (tick.options->knobs.liquid_model == LiquidModel::levels) {
    if (tick.number % kGameTicks == 0)
      for (const BlockId liquid : order_) {
        const GameLevelsReport spread = spread_game_levels(cells, fluid_of(cells, liquid).pages, set.now());
        report.leaves_visited += spread.leaves_visited, report.voxels_changed += spread.voxels_changed;
      }
    else
      for (const PageId p : set.now()) set.add(p);
    if (cells.met_heat()) report.notes.push_back("liquid_model=levels carries no heat along: it stays where it was");
    cells.spread();
    return report;
  }
  for (const BlockId liquid : order_) flow_of(cells, fluid_of(cells, liquid), tick, report);
  if (order_.size() > 1) report.voxels_changed += layers_.exchange(cells, set.now(), rule_, tick.number, tick.seed);
  fit_pages(cells);
  if (tick.number % kLevelTicks == 0)
    for (const PageId p : set.now())
      if (levelled_[p] == 0) watch_[p] = 0;  // it holds no liquid
  for (size_t p = 0; p < levelled_.size(); ++p) {
    if (levelled_[p])
      watch_[p] = static_cast<uint8_t>(levelled_[p] == 2 ? kRoundsToRest : watch_[p] ? watch_[p] - 1 : 0);
    levelled_[p] = 0;
    if (watch_[p]) set.add(static_cast<PageId>(p));
  }
  for (const auto& [p, pos] : kept_pages_) kept_[p] = 0;
  kept_pages_.clear();
  for (const PageId p : set.next()) {
    kept_[p] = 1;
    kept_pages_.emplace_back(p, cells.pos(p));
  }
  if (const int64_t lost = heat_.take_lost(); lost != 0) {
    cells.book_heat(-lost);
    report.notes.push_back(fmt::format("{} units of heat didn't fit into their voxels", lost));
  }
  cells.spread();
  for (const auto& fluid : liquids_) report.bytes += fluid->pages.bytes();
  if (set.empty()) liquids_.clear();  // all is at rest
  return report;
}

}  // namespace

RuleInfo liquid_info() {
  return {.name = "liquid",
          .what = "water, oil, lava and others flow and find their level",
          .conserves = "amount of each liquid, heat",
          .layers = "blocks, liquid, heat",
          .calls = [](const world::Block& block) { return block.phase == world::Phase::liquid; }};
}
std::unique_ptr<Rule> make_liquid_rule(size_t rule) { return std::make_unique<Liquid>(rule); }

}  // namespace sim
