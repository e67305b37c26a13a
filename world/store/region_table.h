/// Something for each of some regions: a hash table with a dense table before it where the bounds are small, so that a
/// look costs one load in most worlds.
///
/// Readers may run in parallel; insert and erase need exclusive access.
#pragma once

#include <algorithm>
#include <memory>
#include <unordered_map>
#include <vector>

#include "world/space/coords.h"

namespace world {

template <class T>
class RegionTable {
 public:
  T* find(RegionPos r) const {
    if (dense_.empty()) {
      const auto found = map_.find(r);
      return found == map_.end() ? nullptr : found->second.get();
    }
    const uint32_t x = static_cast<uint32_t>(r.x - low_.x), y = static_cast<uint32_t>(r.y - low_.y),
                   z = static_cast<uint32_t>(r.z - low_.z);
    if (x >= size_[0] || y >= size_[1] || z >= size_[2]) return nullptr;
    return dense_[(size_t{x} * size_[1] + y) * size_[2] + z];
  }
  bool contains(RegionPos r) const { return find(r) != nullptr; }
  size_t size() const { return map_.size(); }
  bool empty() const { return map_.empty(); }

  /// Makes T() where there is none.
  T& insert(RegionPos r) {
    T& made = insert_later(r);
    finish();
    return made;
  }
  /// The same without the dense table: find() of what is new waits for finish().
  T& insert_later(RegionPos r) {
    std::unique_ptr<T>& slot = map_[r];
    if (!slot) slot = std::make_unique<T>(), changed_ = true;
    return *slot;
  }
  void erase(RegionPos r) {
    erase_later(r);
    finish();
  }
  void erase_later(RegionPos r) { changed_ |= map_.erase(r) > 0; }
  void finish() {
    if (!changed_) return;
    changed_ = false;
    dense_.clear();
    if (map_.empty()) return;
    RegionPos high = low_ = map_.begin()->first;
    for (const auto& [pos, value] : map_)
      for (int a = 0; a < 3; ++a) low_[a] = std::min(low_[a], pos[a]), high[a] = std::max(high[a], pos[a]);
    uint64_t volume = 1;
    for (int a = 0; a < 3; ++a) {
      const uint64_t size = static_cast<uint64_t>(int64_t{high[a]} - low_[a] + 1);
      if (size > kDenseLimit) return;
      size_[a] = static_cast<uint32_t>(size);
      volume *= size;
      if (volume > kDenseLimit || volume > kDenseLimit + 8 * map_.size()) return;
    }
    dense_.assign(volume, nullptr);
    for (const auto& [pos, value] : map_)
      dense_[(size_t(pos.x - low_.x) * size_[1] + size_t(pos.y - low_.y)) * size_[2] + size_t(pos.z - low_.z)] =
          value.get();
  }

  /// Sorted by position.
  std::vector<RegionPos> positions() const {
    std::vector<RegionPos> all;
    all.reserve(map_.size());
    for (const auto& [pos, value] : map_) all.push_back(pos);
    std::sort(all.begin(), all.end());
    return all;
  }
  /// What the table itself takes.
  size_t bytes() const { return dense_.capacity() * sizeof(T*) + map_.size() * (sizeof(RegionPos) + 32); }

 private:
  static constexpr uint64_t kDenseLimit = 1 << 16;
  std::unordered_map<RegionPos, std::unique_ptr<T>, PosHash> map_;
  std::vector<T*> dense_;
  RegionPos low_;
  uint32_t size_[3] = {0, 0, 0};
  bool changed_ = false;
};

}  // namespace world
