/// reactions: what touches reacts; what is warm enough melts, boils, is fired. The rows: sim/matter/reactions.toml.
///
///   find     every pair (or single voxel) of the awake pages that a row fits, and that the row's chance picks, has a
///            random priority
///   choose   a pair reacts where no other pair of its two voxels has a higher one: no voxel reacts twice in a tick,
///            and no order of voxels, pages or threads matters
///   write    both become what the row says; each page writes its own voxels
///
/// Pairs are found on bit masks of the blocks that take part, by page: most pages hold no two that fit. Pages across
/// whose sides a pair reaches are taken in. A page sleeps where no row fits any of its voxels.
///
/// Rows that feed each other (`water freezes`, `ice melts`) may go round for ever. In 256 ticks in which such rows each
/// happened and together changed next to nothing, the report names them.
#include <algorithm>
#include <bit>

#include <fmt/format.h>

#include "sim/matter/matter.h"
#include "sim/matter/reaction_rows.h"
#include "world/base/jobs.h"
#include "world/store/leaf_shifts.h"

namespace sim {

namespace {

using world::BlockId;
using world::LeafMask;

constexpr size_t kPagesATask = 32;
constexpr uint64_t kStream = 0x5ea;  // of random numbers: this rule's
constexpr uint64_t kWindow = 256;    // ticks, of the search for rows that go round
constexpr uint64_t kManyTimes = 32;  // in a window
constexpr int kSingle = 6;           // in the place of a face
constexpr size_t kFacePage[6] = {around_index(-1, 0, 0), around_index(1, 0, 0),  around_index(0, -1, 0),
                                 around_index(0, 1, 0),  around_index(0, 0, -1), around_index(0, 0, 1)};

/// A row that fits a voxel of the page and what is across `face`.
struct Event {
  uint64_t priority;
  uint16_t index;
  uint16_t row;
  uint8_t face;  // from here to the partner; kSingle: none
  bool is_a;     // this voxel is the row's a
};

struct ReactPage {
  uint32_t content = 0;
  bool ready = false, listed = false, live = false;
  KindSet kinds;
  std::vector<std::pair<uint8_t, LeafMask>> masks;  // by kind
  uint32_t spill = 0;                               // bit f: an event reaches across
  std::vector<Event> best;  // at most one a voxel, by index; valid where found == the tick's + 1
  uint64_t found = 0;

  const LeafMask& mask(int kind) const {
    for (const auto& [k, mask] : masks)
      if (k == kind) return mask;
    return world::kNoneMask;
  }
};

/// The index of the voxel across a face, in the leaf or in the next.
int across_index(int index, int face, bool& leaves) {
  const int axis = world::face_axis(face), stride = axis == 0 ? 64 : axis == 1 ? 8 : 1;
  const int along = index / stride & 7, sign = world::face_sign(face);
  leaves = along == (sign > 0 ? 7 : 0);
  return leaves ? index - sign * 7 * stride : index + sign * stride;
}

class Reactions final : public Rule {
 public:
  explicit Reactions(size_t rule) : rule_(rule) {}
  RuleReport step(Cells& cells, const Tick& tick) override;

 private:
  void prepare(const Cells& cells, PageId p);
  bool is_stale(const Cells& cells, PageId p) const {
    return !pages_[p].ready || pages_[p].content != cells.content_changes(p);
  }
  void prepare_all(Cells& cells, size_t first);
  void find(const Cells& cells, PageId p, const Tick& tick);
  void find_row(const Cells& cells, PageId p, const ReactionRow& row, size_t r, const Tick& tick);
  void add(const Cells& cells, PageId a_page, int a_index, int face, size_t r, const Tick& tick, PageId page,
           bool is_a);
  void choose(const Cells& cells, size_t n, uint64_t stamp);
  void watch(const Tick& tick, RuleReport& report);

  struct Change {
    uint16_t index, row;
    bool is_a;
    int64_t lost;
    Cell cell;
  };
  const size_t rule_;  // its awake set
  std::unique_ptr<ReactionRows> rows_;
  std::vector<std::vector<size_t>> loops_;
  std::vector<ReactPage> pages_;
  std::vector<PageId> list_, stale_;
  std::vector<std::vector<Change>> changes_;  // by list_
  std::vector<uint64_t> happened_;            // by row, in this window
  uint64_t window_ = 0;
  int64_t lost_ = 0;  // units of heat that 32 bits didn't hold
};

void Reactions::prepare(const Cells& cells, PageId p) {
  ReactPage& page = pages_[p];
  page.ready = true;
  page.content = cells.content_changes(p);
  page.kinds = {};
  page.masks.clear();
  std::array<BlockId, world::kLeafVoxels> ids;
  cells.ids(p, ids);
  BlockId last = ids[0];
  LeafMask* mask = nullptr;
  const auto take = [&](BlockId id) -> LeafMask* {
    const uint8_t kind = rows_->kind(id);
    if (kind == kNoReactant) return nullptr;
    page.kinds.add(kind);
    for (auto& [k, m] : page.masks)
      if (k == kind) return &m;
    page.masks.emplace_back(kind, LeafMask{});
    return &page.masks.back().second;
  };
  mask = take(last);
  for (int i = 0; i < world::kLeafVoxels; ++i) {
    const BlockId id = ids[static_cast<size_t>(i)];
    if (id != last) mask = take(id), last = id;
    if (mask) mask->set(i);
  }
}

/// Of pages list_[first..] and what is beside them.
void Reactions::prepare_all(Cells& cells, size_t first) {
  for (size_t n = first; n < list_.size(); ++n) cells.open_around(list_[n]);
  if (pages_.size() < cells.page_limit()) pages_.resize(cells.page_limit());
  stale_.clear();
  const auto want = [&](PageId p) {
    if (p == kClosedPage || !is_stale(cells, p) || pages_[p].found == ~0ull) return;
    pages_[p].found = ~0ull;
    stale_.push_back(p);
  };
  for (size_t n = first; n < list_.size(); ++n) {
    want(list_[n]);
    for (const size_t around : kFacePage) want(cells.around(list_[n])[around]);
  }
  world::parallel_ranges(stale_.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) prepare(cells, stale_[n]);
  });
  for (const PageId p : stale_) pages_[p].found = 0;
}

/// Notes an event for a voxel of `page`, where the row's chance picks it: the same on the pages of both voxels.
void Reactions::add(const Cells& cells, PageId a_page, int a_index, int face, size_t r, const Tick& tick, PageId page,
                    bool is_a) {
  const ReactionRow& row = rows_->rows()[r];
  const Cell a = cells.cell(a_page, a_index);
  if (!rows_->is_ready(row, a)) return;
  pages_[page].live = true;
  const world::VoxelPos v = world::voxel_from_leaf(cells.pos(a_page)) + world::offset_in_leaf(a_index);
  const uint64_t random = world::random_bits(tick.seed, v.x, v.y, v.z, tick.number,
                                             kStream + (row.number * 8 + static_cast<uint64_t>(face)) * 4096);
  if ((random >> 32) * row.of >> 32 >= row.chance) return;
  int index = a_index;
  int own_face = face;
  bool leaves = false;
  if (!is_a) {
    index = across_index(a_index, face, leaves);
    own_face = world::opposite_face(face);
  }
  if (own_face != kSingle) {
    across_index(index, own_face, leaves);
    if (leaves) pages_[page].spill |= 1u << own_face;
  }
  pages_[page].best.push_back({world::mix64(random), static_cast<uint16_t>(index), static_cast<uint16_t>(r),
                               static_cast<uint8_t>(own_face), is_a});
}

void Reactions::find_row(const Cells& cells, PageId p, const ReactionRow& row, size_t r, const Tick& tick) {
  const ReactPage& page = pages_[p];
  const auto visit = [](const LeafMask& mask, auto each) {
    for (int x = 0; x < 8; ++x)
      for (uint64_t bits = mask.word[x]; bits; bits &= bits - 1) each(x * 64 + std::countr_zero(bits));
  };
  const auto both = [](const LeafMask& s, const LeafMask& t) {
    LeafMask m;
    for (int x = 0; x < 8; ++x) m.word[x] = s.word[x] & t.word[x];
    return m;
  };
  const bool has_a = page.kinds.has(row.kind_a);
  if (row.kind_b < 0) {
    if (!has_a) return;
    const auto each = [&](int i) { add(cells, p, i, kSingle, r, tick, p, true); };
    if (row.when == Condition::always || cells.find_amounts(p)) return visit(page.mask(row.kind_a), each);
    // Full voxels are ready from one amount of heat on.
    const int32_t* heats = cells.find_heats(p);
    const auto ready = [&](int64_t heat) {
      return row.when == Condition::from ? heat >= row.ready_heat : heat <= row.ready_heat;
    };
    if (!heats && !ready(0)) return;
    LeafMask warm = page.mask(row.kind_a);
    for (int i = 0; heats && i < world::kLeafVoxels; i += 64) {
      uint64_t bits = 0;
      for (int b = 0; b < 64; ++b) bits |= static_cast<uint64_t>(ready(heats[i + b])) << b;
      warm.word[i >> 6] &= bits;
    }
    visit(warm, each);
    return;
  }
  const bool has_b = page.kinds.has(row.kind_b);
  for (uint32_t faces = row.faces; faces; faces &= faces - 1) {
    const int face = std::countr_zero(faces), back = world::opposite_face(face);
    const PageId to = cells.around(p)[kFacePage[face]], from = cells.around(p)[kFacePage[back]];
    if (has_a && (has_b || (to != kClosedPage && pages_[to].kinds.has(row.kind_b)))) {
      const LeafMask& beyond = to == kClosedPage ? world::kNoneMask : pages_[to].mask(row.kind_b);
      visit(both(page.mask(row.kind_a), world::across(page.mask(row.kind_b), beyond, face)), [&](int i) {
        add(cells, p, i, face, r, tick, p, true);
        bool leaves = false;
        across_index(i, face, leaves);
        if (!leaves) add(cells, p, i, face, r, tick, p, false);
      });
    }
    // This page's are the row's b, and a is across.
    if (has_b && from != kClosedPage && pages_[from].kinds.has(row.kind_a)) {
      visit(both(page.mask(row.kind_b), world::across(world::kNoneMask, pages_[from].mask(row.kind_a), back)),
            [&](int i) {
              bool leaves = false;
              add(cells, from, across_index(i, back, leaves), face, r, tick, p, false);
            });
    }
  }
}

void Reactions::find(const Cells& cells, PageId p, const Tick& tick) {
  ReactPage& page = pages_[p];
  page.best.clear();
  page.spill = 0;
  page.live = false;
  page.found = tick.number + 1;
  if (page.kinds.empty()) return;
  const std::vector<ReactionRow>& rows = rows_->rows();
  for (size_t r = 0; r < rows.size(); ++r)
    if (page.kinds.has(rows[r].kind_a) || (rows[r].kind_b >= 0 && page.kinds.has(rows[r].kind_b)))
      find_row(cells, p, rows[r], r, tick);
  // The highest of each voxel.
  std::sort(page.best.begin(), page.best.end(), [](const Event& x, const Event& y) {
    return x.index != y.index ? x.index < y.index : x.priority > y.priority;
  });
  page.best.erase(std::unique(page.best.begin(), page.best.end(),
                              [](const Event& x, const Event& y) { return x.index == y.index; }),
                  page.best.end());
}

/// What voxels of list_[n] become, of the events that are the highest of both their voxels.
void Reactions::choose(const Cells& cells, size_t n, uint64_t stamp) {
  const PageId p = list_[n];
  std::vector<Change>& changes = changes_[n];
  changes.clear();
  for (const Event& e : pages_[p].best) {
    const Cell own = cells.cell(p, e.index);
    Cell partner;
    if (e.face != kSingle) {
      bool leaves = false;
      const int there = across_index(e.index, e.face, leaves);
      const PageId other = leaves ? cells.around(p)[kFacePage[e.face]] : p;
      if (pages_[other].found != stamp) continue;
      const std::vector<Event>& best = pages_[other].best;
      const auto same =
          std::lower_bound(best.begin(), best.end(), there, [](const Event& x, int index) { return x.index < index; });
      if (same == best.end() || same->index != there || same->priority != e.priority) continue;
      partner = cells.cell(other, there);
    }
    Cell c, d;
    const int64_t lost = rows_->react(rows_->rows()[e.row], e.is_a ? own : partner, e.is_a ? partner : own,
                                      world::mix64(e.priority), c, d);
    changes.push_back({e.index, e.row, e.is_a, e.is_a ? lost : 0, e.is_a ? c : d});
  }
}

/// Names loops of rows that happened often and changed next to nothing together.
void Reactions::watch(const Tick& tick, RuleReport& report) {
  if (tick.number / kWindow == window_) return;
  window_ = tick.number / kWindow;
  const std::vector<Reaction>& rows = rows_->sources();
  std::vector<uint64_t> times(rows.size(), 0);
  for (size_t r = 0; r < happened_.size(); ++r) times[rows_->rows()[r].number] = happened_[r];
  std::fill(happened_.begin(), happened_.end(), 0);
  for (const std::vector<size_t>& loop : loops_) {
    std::map<std::string, int64_t> net;
    int64_t gross = 0;
    std::string names;
    size_t busy = 0;
    for (const size_t i : loop) {
      if (times[i] < kManyTimes) continue;
      const auto count = [&](const std::string& from, const std::string& to) {
        if (from == to) return;
        net[from] -= static_cast<int64_t>(times[i]);
        net[to] += static_cast<int64_t>(times[i]);
        gross += 2 * static_cast<int64_t>(times[i]);
      };
      count(rows[i].a, rows[i].c);
      if (!rows[i].b.empty()) count(rows[i].b, rows[i].d);
      names += fmt::format("{}'{}' {} times", busy++ ? ", " : "", rows[i].what, times[i]);
    }
    int64_t moved = 0;
    for (const auto& [block, n] : net) moved += std::abs(n);
    if (busy >= 2 && moved * 8 <= gross)
      report.notes.push_back(fmt::format("reactions feed each other: {} in {} ticks", names, kWindow));
  }
  if (lost_)
    report.notes.push_back(
        fmt::format("{:.3g} MJ left with what was too little for a solid, beyond what solids brought",
                    static_cast<double>(lost_) * kHeatUnitJ * 1e-6));
}

RuleReport Reactions::step(Cells& cells, const Tick& tick) {
  AwakeSet& set = cells.awake(rule_);
  set.begin();
  RuleReport report;
  if (!rows_) {
    rows_ = std::make_unique<ReactionRows>(cells.palette(), tick.options->reactions, tick.options->rest_k);
    loops_ = reaction_loops(rows_->sources());
    happened_.assign(rows_->rows().size(), 0);
  }
  rows_->thermal().follow();
  watch(tick, report);
  if (set.now().empty()) return report;

  // Find, in the awake pages and those that a pair reaches into.
  list_.assign(set.now().begin(), set.now().end());
  for (size_t first = 0; first < list_.size();) {
    prepare_all(cells, first);
    const size_t last = list_.size();
    for (size_t n = first; n < last; ++n) pages_[list_[n]].listed = true;
    world::parallel_ranges(last - first, kPagesATask, [&](size_t begin, size_t end) {
      for (size_t n = first + begin; n < first + end; ++n) find(cells, list_[n], tick);
    });
    for (size_t n = first; n < last; ++n)
      for (uint32_t spill = pages_[list_[n]].spill; spill; spill &= spill - 1) {
        const PageId to = cells.around(list_[n])[kFacePage[std::countr_zero(spill)]];
        if (to == kClosedPage || pages_[to].listed) continue;
        pages_[to].listed = true;
        list_.push_back(to);
      }
    first = last;
  }
  for (const PageId p : list_) pages_[p].listed = false;

  // Choose, then write.
  if (changes_.size() < list_.size()) changes_.resize(list_.size());
  world::parallel_ranges(list_.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) choose(cells, n, tick.number + 1);
  });
  world::parallel_ranges(list_.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) {
      if (changes_[n].empty()) continue;
      LeafMask changed;
      for (const Change& change : changes_[n]) {
        cells.transmute(list_[n], change.index, change.cell);
        changed.set(change.index);
      }
      cells.stir(list_[n], changed);
    }
  });
  for (size_t n = 0; n < list_.size(); ++n) {
    for (const Change& change : changes_[n]) {
      happened_[change.row] += change.is_a;
      lost_ += change.lost;
    }
    report.voxels_changed += changes_[n].size();
    if (pages_[list_[n]].live) set.add(list_[n]);
  }
  cells.spread();
  report.leaves_visited = list_.size();
  report.bytes = pages_.capacity() * sizeof(ReactPage);
  for (const ReactPage& page : pages_)
    report.bytes += page.masks.capacity() * sizeof(page.masks[0]) + page.best.capacity() * sizeof(Event);
  return report;
}

}  // namespace

RuleInfo reactions_info() {
  return {.name = "reactions",
          .what = "what touches reacts; what is warm or cold enough melts, boils, freezes, is fired",
          .conserves = "energy, with the heat that rows say they free",
          .layers = "blocks, liquid, gas, heat",
          .calls = calls_for_heat,
          .feels_heat = true,
          .reacts = true};
}
std::unique_ptr<Rule> make_reactions_rule(size_t rule) { return std::make_unique<Reactions>(rule); }

}  // namespace sim
