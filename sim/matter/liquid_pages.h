/// What pages are to one liquid: amounts, kept from tick to tick while nothing else changes them. Internal to
/// sim/matter.
/// What each pass asks of every page and of its neighbours lies in one array, apart from amounts: most pages of a body
/// that flows are still, and nothing else of them is looked at.
/// bytes  64 a page of the cells; 3.3 K one that holds the liquid, or lies beside one
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "sim/matter/liquid_kernel.h"

namespace sim {

struct LiquidVoxels {
  alignas(64) uint16_t amounts[2][world::kLeafVoxels];  // the state of a round, and that after it
  alignas(64) uint16_t push[world::kLeafVoxels];
  LiquidMasks masks;  // see LiquidPages::masks()
};

struct LiquidPage {
  std::unique_ptr<LiquidVoxels> voxels;  // null: never viewed
  uint64_t listed = 0, gives = 0;        // the tick that it was listed in, the last round in which it may give
  uint32_t content = 0;                  // the page's counter when it was viewed
  uint32_t masked = 0;                   // and when masks were found
  LiquidRows rows;
  uint8_t now = 0;  // of amounts
  bool viewed = false, has_masks = false;
  bool changed = false;    // since it was viewed or stored
  bool is_edited = false;  // by add(): rows are to be found anew

  const uint16_t* own() const { return voxels->amounts[now]; }
  uint16_t* next() { return voxels->amounts[now ^ 1]; }
  const uint16_t* push() const { return voxels->push; }
  uint16_t* push() { return voxels->push; }
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
  /// Until the next view().
  LiquidPage& operator[](PageId p) { return pages_[p]; }
  const LiquidPage& operator[](PageId p) const { return pages_[p]; }
  /// Brings one page up to date, which must be open.
  LiquidPage& view(const Cells& cells, PageId p);
  /// Which voxels of an up to date page are full, nearly so (three quarters), less, or empty; found where it changed.
  /// Stays where it is while the page is open.
  const LiquidMasks& masks(PageId p);
  /// Gives or takes so much in a voxel; store() it later.
  void add(PageId p, int index, int amount) {
    LiquidPage& page = pages_[p];
    uint16_t& of = page.voxels->amounts[page.now][index];
    of = static_cast<uint16_t>(of + amount);
    page.changed = page.is_edited = true;
  }
  /// Writes a changed page's amounts to the cells, and stirs it. Returns the voxels that changed. From several threads,
  /// for different pages.
  uint64_t store(Cells& cells, PageId p);
  size_t bytes() const { return pages_.capacity() * sizeof pages_[0] + made_ * sizeof(LiquidVoxels); }

 private:
  bool is_stale(const Cells& cells, PageId p) const {
    return !pages_[p].viewed || pages_[p].content != cells.content_changes(p);
  }
  void note_stale(const Cells& cells, PageId p);
  void view_stale(const Cells& cells);

  world::BlockId liquid_;
  std::vector<LiquidPage> pages_;
  size_t made_ = 0;  // of their voxels
  std::vector<PageId> stale_;
  std::vector<uint8_t> has_stale_;
};

/// Of the page across each side, and across the floor and the ceiling.
inline constexpr size_t kSidePage[kSides] = {around_index(1, 0, 0), around_index(0, 0, 1), around_index(-1, 0, 0),
                                             around_index(0, 0, -1)};

}  // namespace sim
