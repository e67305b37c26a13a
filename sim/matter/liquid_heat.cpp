#include "sim/matter/liquid_heat.h"

#include <algorithm>
#include <limits>

#include "world/base/jobs.h"

namespace sim {

namespace {

constexpr size_t kPagesATask = 16;

int64_t part_of(int32_t heat, int amount, int there) { return int64_t{heat} * amount / there; }

/// As liquid_kernel.h states it: what flows sideways out of a voxel, to one that holds less.
int flow_to(int from, int to, uint16_t push, int side, int film) {
  if (from == kNoEntry || to >= from || from - to == 1) return 0;
  if (to == 0 && from + 1 <= film) return 0;
  const int room = std::max(kFullVoxel - to, 0) / 4;
  const uint32_t share = push & 0x3fffu, wanted = static_cast<uint32_t>(from - to) * share;
  const int up = (push >> 14) == side && (wanted & 0xffffu) != 0 ? 1 : 0;
  return std::min(static_cast<int>(wanted >> 16) + up, room);
}

/// The voxel across a side, in its own page or the next.
struct Across {
  int index;
  bool leaves;
};
Across across_side(int index, int side) {
  const bool along_x = kSideStep[side].x != 0;
  const int stride = along_x ? 64 : 1, along = index / stride & 7;
  const bool up = (along_x ? kSideStep[side].x : kSideStep[side].z) > 0, leaves = along == (up ? 7 : 0);
  return {leaves ? index + (up ? -7 : 7) * stride : index + (up ? stride : -stride), leaves};
}

}  // namespace

bool LiquidHeat::is_warm(const Cells& cells, PageId p) {
  if (cells.find_heats(p)) return true;
  const std::array<PageId, 27>& around = cells.around(p);
  return cells.find_heats(around[kAbove]) || std::any_of(std::begin(kSidePage), std::end(kSidePage), [&](size_t side) {
           return cells.find_heats(around[side]) != nullptr;
         });
}

void LiquidHeat::add(Cells& cells, PageId p, int index, int64_t units) {
  int32_t& heat = cells.heats(p)[static_cast<size_t>(index)];
  using Limits = std::numeric_limits<int32_t>;
  const int64_t wanted = heat + units, kept = std::clamp<int64_t>(wanted, Limits::min(), Limits::max());
  lost_ += wanted - kept;
  heat = static_cast<int32_t>(kept);
}

/// find(page, change) adds what comes to the voxels of a page, less what goes. All is found before any is written.
template <class Find>
void LiquidHeat::carry(Cells& cells, std::span<const PageId> flowing, std::span<const LiquidMove> moves, Find find) {
  if (!cells.met_heat()) return;
  warms_.assign(flowing.size(), 0);
  changes_.resize(std::max(changes_.size(), flowing.size()));
  world::parallel_ranges(flowing.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) {
      // Something flows through a page that has other amounts after it, or gives to another.
      if ((!moves[n].changed && !moves[n].out) || !is_warm(cells, flowing[n])) continue;
      if (!changes_[n]) changes_[n] = std::make_unique<Cells::Heats>();
      changes_[n]->fill(0);
      warms_[n] = find(flowing[n], *changes_[n]);
    }
  });
  for (size_t n = 0; n < flowing.size(); ++n) {
    if (!warms_[n]) continue;
    for (int i = 0; i < world::kLeafVoxels; ++i)
      if (const int32_t change = (*changes_[n])[static_cast<size_t>(i)]) add(cells, flowing[n], i, change);
    cells.stir_heat(flowing[n]);
  }
}

void LiquidHeat::fall(Cells& cells, const LiquidPages& pages, std::span<const PageId> flowing,
                      std::span<const LiquidMove> moves, uint64_t round) {
  carry(cells, flowing, moves, [&](PageId p, Cells::Heats& change) {
    bool any = false;
    // From voxel i of one page to voxel j of another, or the same; 0 where nothing goes.
    const auto falling = [&](PageId from, int i, PageId to, int j) -> int32_t {
      const int32_t* heats = cells.find_heats(from);
      const int amount = pages[from].own()[i];
      if (!heats || heats[i] == 0 || amount == 0 || amount == kNoEntry) return 0;
      const int out = std::min(amount, std::max(kFullVoxel - pages[to].own()[j], 0));
      return static_cast<int32_t>(part_of(heats[i], out, amount));
    };
    const PageId above = cells.around(p)[kAbove], below = cells.around(p)[kBelow];
    for (int x = 0; x < 8; ++x)
      for (int z = 0; z < 8; ++z) {
        const int lowest = x * 64 + z;
        if (pages[p].gives == round)
          for (int i = lowest; i < lowest + 64; i += 8) {
            const int32_t heat = i == lowest ? falling(p, i, below, i + 56) : falling(p, i, p, i - 8);
            if (heat == 0) continue;
            any = true;
            change[static_cast<size_t>(i)] -= heat;
            if (i > lowest) change[static_cast<size_t>(i - 8)] += heat;
          }
        if (pages[above].gives != round) continue;
        if (const int32_t heat = falling(above, lowest, p, lowest + 56)) {
          any = true;
          change[static_cast<size_t>(lowest + 56)] += heat;
        }
      }
    return any;
  });
}

void LiquidHeat::slide(Cells& cells, const LiquidPages& pages, std::span<const PageId> flowing,
                       std::span<const LiquidMove> moves, uint64_t round, uint16_t film) {
  carry(cells, flowing, moves, [&](PageId p, Cells::Heats& change) {
    bool any = false;
    const auto flows = [&](PageId from, int i, int side, PageId to, int j) -> int32_t {
      const LiquidPage& page = pages[from];
      const int amount = page.own()[i];
      const int out = flow_to(amount, pages[to].own()[j], page.push()[i], side, film);
      return out == 0 ? 0 : static_cast<int32_t>(part_of(cells.find_heats(from)[i], out, amount));
    };
    const auto is_warm_voxel = [&](PageId of, int i) {
      const int32_t* heats = cells.find_heats(of);
      const int amount = pages[of].own()[i];
      return heats && heats[i] != 0 && amount != 0 && amount != kNoEntry;
    };
    const std::array<PageId, 27>& around = cells.around(p);
    if (pages[p].gives == round && cells.find_heats(p))
      for (int i = 0; i < world::kLeafVoxels; ++i) {
        if (!is_warm_voxel(p, i)) continue;
        for (int side = 0; side < kSides; ++side) {
          const Across to = across_side(i, side);
          const int32_t heat = flows(p, i, side, to.leaves ? around[kSidePage[side]] : p, to.index);
          if (heat == 0) continue;
          any = true;
          change[static_cast<size_t>(i)] -= heat;
          if (!to.leaves) change[static_cast<size_t>(to.index)] += heat;
        }
      }
    // And what comes from the pages beside it: there, this page lies on the opposite side.
    for (int side = 0; side < kSides; ++side) {
      const PageId from = around[kSidePage[side]];
      if (pages[from].gives != round || !cells.find_heats(from)) continue;
      const bool along_x = kSideStep[side].x != 0;
      const bool up = (along_x ? kSideStep[side].x : kSideStep[side].z) > 0;
      for (int k = 0; k < 64; ++k) {
        const int edge = up ? 7 : 0, i = along_x ? edge * 64 + k : k * 8 + edge;
        const int j = across_side(i, side).index;
        if (!is_warm_voxel(from, j)) continue;
        const int32_t heat = flows(from, j, opposite_side(side), p, i);
        if (heat == 0) continue;
        any = true;
        change[static_cast<size_t>(i)] += heat;
      }
    }
    return any;
  });
}

void LiquidHeat::take(Cells& cells, PageId p, int index, int amount, int there) {
  const int32_t* heats = cells.find_heats(p);
  if (!heats || heats[index] == 0) return;
  const int64_t heat = part_of(heats[index], amount, std::max(there, amount));
  taken_ += heat;
  add(cells, p, index, -heat);
  cells.stir_heat(p);
}

void LiquidHeat::give(PageId p, int index, int amount) { given_.push_back({p, index, amount}); }

void LiquidHeat::settle(Cells& cells) {
  if (taken_ != 0) {
    int64_t all = 0, given = 0;
    for (const Given& g : given_) all += g.amount;
    for (const Given& g : given_) {
      // Whole shares of each unit, and of what is left over those up to this one.
      const int64_t rest = taken_ % all, before = rest * given / all;
      given += g.amount;
      add(cells, g.page, g.index, taken_ / all * g.amount + rest * given / all - before);
      cells.stir_heat(g.page);
    }
  }
  given_.clear();
  taken_ = 0;
}

}  // namespace sim
