/// Where light is kept: the regions that hold blocks and their 26 neighbours, but none that is not loaded. A function
/// of those two sets, not of the order in which they came to be.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "world/store/region_table.h"

namespace sim {

struct DomainChange {
  std::vector<world::RegionPos> added, removed;  // sorted, no region in both
  std::vector<world::RegionPos> loaded_or_unloaded;
  bool empty() const { return added.empty() && removed.empty() && loaded_or_unloaded.empty(); }
};

class LightDomain {
 public:
  bool contains(world::RegionPos r) const { return inside_.contains(r); }
  bool has_blocks(world::RegionPos r) const { return blocks_.contains(r); }
  std::vector<world::RegionPos> with_blocks() const { return {blocks_.begin(), blocks_.end()}; }
  /// Sorted by x, z, and y from the top down.
  std::vector<world::RegionPos> columns() const;

  /// Takes effect in change().
  void set_blocks(world::RegionPos r, bool has_blocks);
  void set_unloaded(world::RegionPos r, bool unloaded);
  bool is_unloaded(world::RegionPos r) const { return unloaded_.contains(r); }
  /// What came in and went out since the last call.
  DomainChange change();

  /// What lies over a region of the domain in its column: the next region of it that is inside; nothing, with the open
  /// sky above; or nothing, with what isn't loaded between.
  struct Above {
    std::optional<world::RegionPos> region;
    bool unloaded = false;
  };
  Above above(world::RegionPos r) const;
  /// The next region inside below in the column.
  std::optional<world::RegionPos> below(world::RegionPos r) const;

 private:
  struct Nothing {};
  using Column = std::pair<int32_t, int32_t>;  // x, z
  void wish(world::RegionPos r);

  world::RegionTable<Nothing> inside_;
  std::set<world::RegionPos> blocks_, unloaded_;
  std::map<world::RegionPos, int> near_;  // regions with blocks among the 27 around
  std::map<Column, std::set<int32_t>> columns_, unloaded_columns_;
  std::set<world::RegionPos> maybe_changed_, toggled_;
};

}  // namespace sim
