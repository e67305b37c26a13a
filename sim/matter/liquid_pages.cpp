#include "sim/matter/liquid_pages.h"

#include "world/base/jobs.h"

namespace sim {

namespace {
constexpr size_t kPagesATask = 64;
constexpr uint16_t kMost = kFullVoxel / 4 * 3;
}  // namespace

void LiquidPages::note_stale(const Cells& cells, PageId p) {
  if (!is_stale(cells, p)) return;
  LiquidPage& page = pages_[p];
  if (!page.voxels) {
    page.voxels = std::make_unique_for_overwrite<LiquidVoxels>();
    ++made_;
  }
  // Noted once: what is viewed below is up to date from now on.
  page.viewed = true;
  page.content = cells.content_changes(p);
  stale_.push_back(p);
}

void LiquidPages::view_stale(const Cells& cells) {
  world::parallel_ranges(stale_.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n) {
      const PageId p = stale_[n];
      LiquidPage& page = pages_[p];
      const world::BlockId* blocks = cells.find_blocks(p);
      page.changed = false;
      uint16_t* const own = page.voxels->amounts[page.now];
      page.rows =
          blocks ? view_amounts(blocks, cells.find_amounts(p), liquid_, own) : view_planes(cells.occupied_mask(p), own);
    }
  });
  stale_.clear();
}

void LiquidPages::view(const Cells& cells, std::span<const PageId> pages) {
  pages_.resize(cells.page_limit());
  for (const PageId p : pages) note_stale(cells, p);
  view_stale(cells);
}

void LiquidPages::view_across(const Cells& cells, std::span<const PageId> pages) {
  pages_.resize(cells.page_limit());
  // From tick to tick hardly one is stale: that is found out on all threads.
  constexpr size_t kFaces[] = {kSidePage[0], kSidePage[1], kSidePage[2], kSidePage[3], kBelow, kAbove};
  has_stale_.assign(pages.size(), 0);
  world::parallel_ranges(pages.size(), kPagesATask, [&](size_t begin, size_t end) {
    for (size_t n = begin; n < end; ++n)
      for (const size_t face : kFaces) has_stale_[n] |= is_stale(cells, cells.around(pages[n])[face]);
  });
  for (size_t n = 0; n < pages.size(); ++n) {
    if (!has_stale_[n]) continue;
    for (const size_t face : kFaces) note_stale(cells, cells.around(pages[n])[face]);
  }
  view_stale(cells);
}

LiquidPage& LiquidPages::view(const Cells& cells, PageId p) {
  if (p >= pages_.size()) pages_.resize(cells.page_limit());
  note_stale(cells, p);
  if (!stale_.empty()) view_stale(cells);
  return pages_[p];
}

const LiquidMasks& LiquidPages::masks(PageId p) {
  LiquidPage& page = pages_[p];
  if (!page.has_masks || page.masked != page.content) {
    find_masks(page.own(), kMost, page.voxels->masks);
    page.has_masks = true;
    page.masked = page.content;
  }
  return page.voxels->masks;
}

uint64_t LiquidPages::store(Cells& cells, PageId p) {
  LiquidPage& page = pages_[p];
  if (!page.changed) return 0;
  page.changed = false;
  if (page.is_edited) page.rows = rows_of(page.own());
  page.is_edited = false;
  world::BlockId* blocks = cells.blocks(p).data();
  uint16_t* amounts = cells.amounts(p).data();
  const world::LeafMask moved = write_amounts(page.own(), liquid_, blocks, amounts);
  if (moved.is_none()) return 0;
  cells.set_rich(p);
  cells.stir(p, moved);
  page.content = cells.content_changes(p);
  return static_cast<uint64_t>(moved.count());
}

}  // namespace sim
