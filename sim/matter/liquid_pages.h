/// What pages are to one liquid: amounts, kept from tick to tick while nothing else changes them. Internal to
/// sim/matter.
/// bytes  3.2 K a page that holds the liquid, or lies beside one
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "sim/matter/liquid_kernel.h"

namespace sim {

struct LiquidPage {
  alignas(64) uint16_t amounts[2][world::kLeafVoxels];  // the state of a round, and that after it
  alignas(64) uint16_t push[world::kLeafVoxels];
  LiquidRows rows;
  LiquidMasks masks;     // see LiquidPages::masks()
  uint32_t content = 0;  // the page's counter when it was viewed
  uint32_t masked = 0;   // and when masks were found
  uint8_t now = 0;       // of amounts
  bool viewed = false, has_masks = false;
  bool changed = false;            // since it was viewed or stored
  bool is_edited = false;          // by add(): rows are to be found anew
  uint64_t listed = 0, gives = 0;  // the tick that it was listed in, the last round in which it may give

  const uint16_t* own() const { return amounts[now]; }
  uint16_t* next() { return amounts[now ^ 1]; }
  void follow(const LiquidMove& move) {
    if (!move.changed) return;
    now ^= 1, rows = move.rows, changed = true;
  }
};

class LiquidPages {
 public:
  explicit LiquidPages(world::BlockId liquid) : liquid_(liquid) {}
  world::BlockId liquid() const { return liquid_; }
  /// Brings the pages up to date with the cells.
  void view(const Cells& cells, std::span<const PageId> pages);
  /// And those across their six faces; all of these must be open.
  void view_across(const Cells& cells, std::span<const PageId> pages);
  LiquidPage& operator[](PageId p) { return *pages_[p]; }
  const LiquidPage& operator[](PageId p) const { return *pages_[p]; }
  /// Brings one page up to date, which must be open.
  LiquidPage& view(const Cells& cells, PageId p);
  /// Which voxels of an up to date page are full, nearly so (three quarters), less, or empty; found where it changed.
  const LiquidMasks& masks(PageId p);
  /// Gives or takes so much in a voxel; store() it later.
  void add(PageId p, int index, int amount) {
    LiquidPage& page = *pages_[p];
    uint16_t& of = page.amounts[page.now][index];
    of = static_cast<uint16_t>(of + amount);
    page.changed = page.is_edited = true;
  }
  /// Writes a changed page's amounts to the cells, and stirs it. Returns the voxels that changed. From several threads,
  /// for different pages.
  uint64_t store(Cells& cells, PageId p);
  size_t bytes() const { return pages_.capacity() * sizeof pages_[0] + made_ * sizeof(LiquidPage); }

 private:
  bool is_stale(const Cells& cells, PageId p) const {
    return !pages_[p] || !pages_[p]->viewed || pages_[p]->content != cells.content_changes(p);
  }
  void note_stale(const Cells& cells, PageId p);
  void view_stale(const Cells& cells);

  world::BlockId liquid_;
  std::vector<std::unique_ptr<LiquidPage>> pages_;
  size_t made_ = 0;  // of pages_
  std::vector<PageId> stale_;
  std::vector<uint8_t> has_stale_;
};

/// Of the page across each side, and across the floor and the ceiling.
inline constexpr size_t kSidePage[kSides] = {around_index(1, 0, 0), around_index(0, 0, 1), around_index(-1, 0, 0),
                                             around_index(0, 0, -1)};

}  // namespace sim
