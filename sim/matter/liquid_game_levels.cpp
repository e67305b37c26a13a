#include "sim/matter/liquid_game_levels.h"

#include <algorithm>
#include <atomic>

#include "world/base/jobs.h"

namespace sim {

namespace {

constexpr size_t kPagesATask = 8;
constexpr int kGameLevels = 8, kGameLevel = kFullVoxel / kGameLevels;

/// A page and those across its faces, voxel by voxel.
class Around {
 public:
  Around(const Cells& cells, const LiquidPages& pages, PageId p) : own_(pages[p].own()) {
    const std::array<PageId, 27>& around = cells.around(p);
    for (int d = 0; d < kSides; ++d) side_[d] = &pages[around[kSidePage[d]]];
    below_ = &pages[around[kBelow]], above_ = &pages[around[kAbove]];
  }
  uint16_t own(int i) const { return own_[i]; }
  uint16_t below(int i) const { return (i & 56) != 0 ? own_[i - 8] : below_->own()[i + 56]; }
  uint16_t above(int i) const { return (i & 56) != 56 ? own_[i + 8] : above_->own()[i - 56]; }
  /// What the neighbour to that side offers; `push` is the page's own.
  uint16_t offer(int i, int side, const uint16_t* push) const {
    const auto beyond = [&](int index) { return side_[side]->rows.wet ? side_[side]->push()[index] : uint16_t{0}; };
    switch (side) {
      case 0:
        return i < 448 ? push[i + 64] : beyond(i - 448);
      case 1:
        return (i & 7) != 7 ? push[i + 1] : beyond(i - 7);
      case 2:
        return i >= 64 ? push[i - 64] : beyond(i + 448);
      default:
        return (i & 7) != 0 ? push[i - 1] : beyond(i + 7);
    }
  }

 private:
  const uint16_t* own_;
  const LiquidPage *side_[kSides], *below_, *above_;
};

/// The level that each voxel of the page offers to its sides.
void find_offers(const Cells& cells, LiquidPages& pages, PageId p) {
  const Around around(cells, pages, p);
  for (int i = 0; i < world::kLeafVoxels; ++i) {
    const uint16_t here = around.own(i) == kNoEntry ? uint16_t{0} : around.own(i);
    // A level that may fall goes nowhere else; a source spreads all the same.
    const bool borne = around.below(i) >= kFullVoxel || here >= kFullVoxel;
    const int level = (here + kGameLevel - 1) / kGameLevel;
    pages[p].push()[i] = borne && level > 1 ? static_cast<uint16_t>(level - 1) : uint16_t{0};
  }
}

/// What each voxel becomes. Returns by how much the amount grew.
int64_t take_offers(const Cells& cells, LiquidPages& pages, PageId p, LiquidMove& move) {
  const Around around(cells, pages, p);
  LiquidPage& page = pages[p];
  const bool is_wet = page.rows.wet != 0;
  static constexpr uint16_t kNothing[world::kLeafVoxels] = {};
  const uint16_t* push = is_wet ? page.push() : kNothing;
  uint16_t* next = page.next();
  int64_t more = 0;
  for (int i = 0; i < world::kLeafVoxels; ++i) {
    const uint16_t own = next[i] = around.own(i);
    if (own >= kFullVoxel) continue;  // a source, or a wall
    const uint16_t above = around.above(i);
    const bool falls = above > 0 && above != kNoEntry;
    int most = 0, sources = 0;
    for (int side = 0; side < kSides; ++side) {
      const int offer = around.offer(i, side, push);
      most = std::max(most, offer);
      sources += offer == kGameLevels - 1;
    }
    const bool source = sources >= 2 && around.below(i) >= kFullVoxel;
    const int level = falls ? kGameLevels - 1 : most;
    next[i] = source ? uint16_t{kFullVoxel} : static_cast<uint16_t>(level * kGameLevel);
    more += next[i] - own;
    move.changed |= next[i] != own;
  }
  if (move.changed) move.rows = rows_of(next);
  return more;
}

}  // namespace

GameLevelsReport spread_game_levels(Cells& cells, LiquidPages& pages, std::span<const PageId> awake) {
  GameLevelsReport report;
  // Pages that hold some of it, and those across their faces.
  pages.view(cells, awake);
  std::vector<PageId> list;
  for (const PageId p : awake)
    if (pages[p].rows.wet) list.push_back(p);
  const size_t wet = list.size();
  if (wet == 0) return report;
  pages.view_across(cells, list);
  for (size_t n = 0; n < wet; ++n) {
    const std::array<PageId, 27>& around = cells.around(list[n]);
    for (const size_t side : kSidePage) list.push_back(around[side]);
    list.push_back(around[kBelow]);
  }
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
  std::erase(list, kClosedPage);
  for (const PageId p : list) cells.open_around(p);
  pages.view_across(cells, list);
  std::vector<LiquidMove> moves(list.size());
  std::atomic<int64_t> made{0}, gone{0};
  std::atomic<uint64_t> changed{0};
  const auto each = [&](auto work) {
    world::parallel_ranges(list.size(), kPagesATask, [&](size_t begin, size_t end) {
      for (size_t n = begin; n < end; ++n) work(n, list[n]);
    });
  };
  // Wet pages beside those of the list offer too.
  std::vector<PageId> offering;
  const auto offer = [&](PageId q) {
    if (q != kClosedPage && pages[q].rows.wet) offering.push_back(q);
  };
  for (const PageId p : list) {
    offer(p);
    for (const size_t side : kSidePage) offer(cells.around(p)[side]);
  }
  std::sort(offering.begin(), offering.end());
  offering.erase(std::unique(offering.begin(), offering.end()), offering.end());
  for (const PageId p : offering) cells.open_around(p);
  pages.view_across(cells, offering);
  world::parallel_ranges(offering.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) find_offers(cells, pages, offering[n]);
  });
  each([&](size_t n, PageId p) {
    const int64_t more = take_offers(cells, pages, p, moves[n]);
    if (more != 0) (more > 0 ? made : gone) += std::abs(more);
  });
  each([&](size_t n, PageId p) {
    pages[p].follow(moves[n]);
    changed += pages.store(cells, p);
  });
  if (made > 0) cells.book(pages.liquid(), made);
  if (gone > 0) cells.book(pages.liquid(), -gone);
  report.voxels_changed = changed;
  report.leaves_visited = list.size();
  return report;
}

}  // namespace sim
