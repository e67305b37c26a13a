#include "sim/matter/gas_swaps.h"

#include "sim/matter/gas_kernel.h"
#include "sim/matter/sides.h"
#include "world/base/jobs.h"
#include "world/base/random.h"
#include "world/store/leaf_sets.h"
#include "world/store/leaf_shifts.h"

namespace sim {

using world::BlockId;
using world::LeafMask;
using world::VoxelPos;

namespace {

constexpr size_t kPagesATask = 16;
constexpr uint64_t kStream = 0x9a5;  // of random numbers: this rule's
constexpr size_t kFacePage[6] = {around_index(-1, 0, 0), around_index(1, 0, 0),  around_index(0, -1, 0),
                                 around_index(0, 1, 0),  around_index(0, 0, -1), around_index(0, 0, 1)};

}  // namespace

/// Masks of the pages and of what is across their faces.
void GasSwaps::find_fluids(Cells& cells, std::span<const PageId> pages, std::span<const BlockId> met) {
  if (fluids_.size() < cells.page_limit()) fluids_.resize(cells.page_limit());
  stale_.clear();
  const auto want = [&](PageId p) {
    FluidMasks& fluids = fluids_[p];
    if (p == kClosedPage || fluids.wanted) return;
    if (fluids.ready && fluids.changes == cells.content_changes(p) && fluids.pos == cells.pos(p)) return;
    fluids.wanted = true;
    stale_.push_back(p);
  };
  for (const PageId p : pages) {
    want(p);
    for (const size_t k : kFacePage) want(cells.around(p)[k]);
  }
  world::parallel_ranges(stale_.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) {
      const PageId p = stale_[n];
      FluidMasks& fluids = fluids_[p];
      fluids.wanted = false;
      fluids.ready = true;
      fluids.changes = cells.content_changes(p);
      fluids.pos = cells.pos(p);
      fluids.liquid = fluids.gas = {};
      fluids.gases.clear();
      const BlockId* ids = cells.find_blocks(p);
      for (const BlockId id : met) {
        if (!ids) break;
        const LeafMask mask = mask_of(ids, id);
        if (mask.is_none()) continue;
        if (role(id) == FluidRole::gas) fluids.gases.emplace_back(id, mask);
        LeafMask& all = role(id) == FluidRole::gas ? fluids.gas : fluids.liquid;
        all = all | mask;
      }
    }
  });
}

/// The swaps of this tick that lie in the page or reach out of it, by the gas in each. Returns whether there may be
/// some in any tick, as things are.
bool GasSwaps::find(const Cells& cells, PageId p, const Tick& tick, std::vector<Swap>& swaps) const {
  const std::array<PageId, 27>& around = cells.around(p);
  const VoxelPos low = world::voxel_from_leaf(cells.pos(p));
  struct Place {
    PageId page;
    int index;
    FluidRole role;
    bool is_open() const { return role == FluidRole::open || role == FluidRole::gas; }
  };
  const auto at = [&](int i, VoxelPos step) -> Place {
    const VoxelPos v = world::offset_in_leaf(i) + step;
    const auto page_step = [](int c) { return c < 0 ? -1 : c > 7 ? 1 : 0; };
    const PageId page = around[static_cast<size_t>(around_index(page_step(v.x), page_step(v.y), page_step(v.z)))];
    const int index = world::index_in_leaf(v);
    return {page, index, page == kClosedPage ? FluidRole::other : role(cells.block(page, index))};
  };
  const bool vertical = tick.number % 2 == 0;
  const uint64_t turn = tick.number / 2;
  const uint64_t drawn = world::random_bits(tick.seed, 0, 0, 0, turn, kStream);
  const bool along_z = (drawn & 1) != 0;
  const int odd = static_cast<int>(vertical ? turn & 1 : drawn >> 1 & 1);
  const FluidMasks &own = fluids_[p], &over = fluids_[around[kAbove]];
  // Under a liquid, or a denser gas.
  LeafMask under = own.gas & world::across(own.liquid, over.liquid, world::kFacePosY);
  for (const auto& [gas, mask] : own.gases) {
    LeafMask denser, denser_over;
    for (const auto& [other, there] : own.gases)
      if (blocks_->densities[other] > blocks_->densities[gas]) denser = denser | there;
    for (const auto& [other, there] : over.gases)
      if (blocks_->densities[other] > blocks_->densities[gas]) denser_over = denser_over | there;
    under = under | (mask & world::across(denser, denser_over, world::kFacePosY));
  }
  bool may = !under.is_none();
  if (vertical)
    world::for_each_voxel(under, [&](int i) {
      if (((low.y + world::offset_in_leaf(i).y) & 1) != odd) return;
      const Place above = at(i, {0, 1, 0});
      swaps.push_back({p, above.page, i, above.index});
    });
  // Beside a liquid that could fall.
  for (int side = 0; side < kSides; ++side) {
    const VoxelPos step = kSideStep[side];
    const FluidMasks& beyond = fluids_[around[kFacePage[kSideFace[side]]]];
    const LeafMask beside = own.gas & world::across(own.liquid, beyond.liquid, kSideFace[side]);
    world::for_each_voxel(world::without(beside, under), [&](int i) {
      const bool pressed = at(i, step + VoxelPos{0, 1, 0}).role == FluidRole::liquid;
      // Over liquid it is the voxel below that is pressed; both at once would only shift the column, for ever.
      const bool at_edge = at(i, {0, -1, 0}).is_open() && at(i, step - VoxelPos{0, 1, 0}).role == FluidRole::other;
      if (!pressed && !at_edge) return;
      may = true;
      if (vertical || (step.z != 0) != along_z) return;
      const VoxelPos v = low + world::offset_in_leaf(i);
      const int here = along_z ? v.z : v.x, sign = along_z ? step.z : step.x;
      if (((here & 1) == odd) != (sign > 0)) return;
      const Place there = at(i, step);
      swaps.push_back({p, there.page, i, there.index});
    });
  }
  return may;
}

const std::vector<PageId>& GasSwaps::step(Cells& cells, const Tick& tick, std::span<const PageId> pages,
                                          std::span<const BlockId> met, const FluidBlocks& blocks,
                                          uint64_t& voxels_changed) {
  blocks_ = &blocks;
  find_fluids(cells, pages, met);
  if (swaps_.size() < pages.size()) swaps_.resize(pages.size());
  may_swap_.assign(pages.size(), 0);
  world::parallel_ranges(pages.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) {
      swaps_[n].clear();
      if (!fluids_[pages[n]].gas.is_none()) may_swap_[n] = find(cells, pages[n], tick, swaps_[n]);
    }
  });
  for (size_t n = 0; n < pages.size(); ++n) {
    if (may_swap_[n]) cells.awake(rule_).add(pages[n]);
    for (const Swap& s : swaps_[n]) {
      const Cell a = cells.cell(s.p, s.i), b = cells.cell(s.q, s.j);
      cells.put(s.p, s.i, b);
      cells.put(s.q, s.j, a);
      if (a.heat != b.heat) cells.stir_heat(s.p), cells.stir_heat(s.q);
      changed_.add(cells, s.p, s.i);
      changed_.add(cells, s.q, s.j);
    }
  }
  voxels_changed += changed_.stir(cells);
  return changed_.stirred();
}

}  // namespace sim
