#include "sim/light/light_domain.h"

namespace sim {

using world::RegionPos;

std::vector<RegionPos> LightDomain::columns() const {
  std::vector<RegionPos> all;
  for (const auto& [column, ys] : columns_)
    for (auto y = ys.rbegin(); y != ys.rend(); ++y) all.push_back({column.first, *y, column.second});
  return all;
}

void LightDomain::set_blocks(RegionPos r, bool has_blocks) {
  if (has_blocks == blocks_.contains(r)) return;
  if (has_blocks)
    blocks_.insert(r);
  else
    blocks_.erase(r);
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const RegionPos n = r + RegionPos{x, y, z};
        int& count = near_[n];
        count += has_blocks ? 1 : -1;
        if (count == 0) near_.erase(n);
        maybe_changed_.insert(n);
      }
}

void LightDomain::set_unloaded(RegionPos r, bool unloaded) {
  if (unloaded == unloaded_.contains(r)) return;
  std::set<int32_t>& column = unloaded_columns_[{r.x, r.z}];
  if (unloaded) {
    unloaded_.insert(r);
    column.insert(r.y);
  } else {
    unloaded_.erase(r);
    column.erase(r.y);
    if (column.empty()) unloaded_columns_.erase({r.x, r.z});
  }
  maybe_changed_.insert(r);
  toggled_.insert(r);
}

DomainChange LightDomain::change() {
  DomainChange change;
  for (const RegionPos& r : maybe_changed_) {
    const bool wanted = near_.contains(r) && !unloaded_.contains(r);
    if (wanted == inside_.contains(r)) continue;
    std::set<int32_t>& column = columns_[{r.x, r.z}];
    if (wanted) {
      inside_.insert_later(r);
      column.insert(r.y);
      change.added.push_back(r);
    } else {
      inside_.erase_later(r);
      column.erase(r.y);
      if (column.empty()) columns_.erase({r.x, r.z});
      change.removed.push_back(r);
    }
  }
  change.loaded_or_unloaded.assign(toggled_.begin(), toggled_.end());
  maybe_changed_.clear();
  toggled_.clear();
  inside_.finish();
  return change;
}

LightDomain::Above LightDomain::above(RegionPos r) const {
  Above found;
  int64_t limit = INT64_MAX;
  if (const auto column = columns_.find({r.x, r.z}); column != columns_.end())
    if (const auto next = column->second.upper_bound(r.y); next != column->second.end())
      found.region = RegionPos{r.x, *next, r.z}, limit = *next;
  if (const auto column = unloaded_columns_.find({r.x, r.z}); column != unloaded_columns_.end())
    if (const auto next = column->second.upper_bound(r.y); next != column->second.end() && *next < limit)
      return {std::nullopt, true};
  return found;
}

std::optional<RegionPos> LightDomain::below(RegionPos r) const {
  const auto column = columns_.find({r.x, r.z});
  if (column == columns_.end()) return std::nullopt;
  auto next = column->second.lower_bound(r.y);
  if (next == column->second.begin()) return std::nullopt;
  return RegionPos{r.x, *--next, r.z};
}

}  // namespace sim
