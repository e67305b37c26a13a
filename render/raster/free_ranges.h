/// Which parts of a page are free, in records: taken by first fit, neighbours merged when they are given back.
#pragma once

#include <cstdint>
#include <iterator>
#include <map>
#include <optional>

namespace render::raster {

class FreeRanges {
 public:
  explicit FreeRanges(uint32_t records = 0) {
    if (records) free_[0] = records;
  }
  /// The first record of a range, or nothing where none is long enough.
  std::optional<uint32_t> take(uint32_t records) {
    for (auto it = free_.begin(); it != free_.end(); ++it) {
      const auto [first, count] = *it;
      if (count < records) continue;
      free_.erase(it);
      if (count > records) free_[first + records] = count - records;
      return first;
    }
    return std::nullopt;
  }
  void give_back(uint32_t first, uint32_t count) {
    const auto after = free_.find(first + count);
    if (after != free_.end()) {
      count += after->second;
      free_.erase(after);
    }
    const auto next = free_.lower_bound(first);
    if (next != free_.begin()) {
      const auto before = std::prev(next);
      if (before->first + before->second == first) {
        before->second += count;
        return;
      }
    }
    free_[first] = count;
  }

 private:
  std::map<uint32_t, uint32_t> free_;  // first record -> count
};

}  // namespace render::raster
