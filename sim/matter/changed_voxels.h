/// Voxels that a rule changed one by one, on one thread: told to the cells once a page. Internal to sim/matter.
#pragma once

#include <vector>

#include "sim/matter/cells.h"

namespace sim {

class ChangedVoxels {
 public:
  void add(const Cells& cells, PageId p, int index) {
    if (p >= changed_.size()) changed_.resize(cells.page_limit());
    if (changed_[p].is_none()) pages_.push_back(p);
    changed_[p].set(index);
  }
  /// Stirs the pages of what was added, and forgets it. Returns how many voxels.
  uint64_t stir(Cells& cells) {
    uint64_t count = 0;
    for (const PageId p : pages_) {
      cells.open_around(p);
      cells.stir(p, changed_[p]);
      count += static_cast<uint64_t>(changed_[p].count());
      changed_[p] = {};
    }
    stirred_.swap(pages_);
    pages_.clear();
    return count;
  }
  /// Those of the last stir().
  const std::vector<PageId>& stirred() const { return stirred_; }

 private:
  std::vector<world::LeafMask> changed_;  // by page
  std::vector<PageId> pages_, stirred_;
};

}  // namespace sim
