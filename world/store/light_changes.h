/// Which leaves' light changed: what a simulation of light says, and several who draw it follow, each at its own pace.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

#include "world/space/coords.h"

namespace world {

struct LightChange {
  bool all = false;                // anything may have changed; the lists are empty
  std::vector<LeafPos> leaves;     // in any order; may name one twice
  std::vector<RegionPos> regions;  // all leaves of these too

  bool empty() const { return !all && leaves.empty() && regions.empty(); }
  void clear() { all = false, leaves.clear(), regions.clear(); }
  void add(const LightChange& more) {
    all |= more.all;
    leaves.insert(leaves.end(), more.leaves.begin(), more.leaves.end());
    regions.insert(regions.end(), more.regions.begin(), more.regions.end());
    if (all || leaves.size() > kMostLeaves) leaves.clear(), regions.clear(), all = true;
  }

 private:
  static constexpr size_t kMostLeaves = 1 << 16;  // beyond it nobody gains by knowing which
};

class LightChanges {
 public:
  LightChanges() : identity_(next_identity()++) {}
  LightChanges(const LightChanges&) = delete;
  LightChanges& operator=(const LightChanges&) = delete;

  /// Differs between any two of a run.
  uint64_t identity() const { return identity_; }
  /// A consumer; what it takes first is all.
  int subscribe() {
    untaken_.emplace_back().all = true;
    return static_cast<int>(untaken_.size()) - 1;
  }
  /// What changed since the last call for this consumer.
  LightChange take(int subscriber) {
    LightChange taken = std::move(untaken_[static_cast<size_t>(subscriber)]);
    untaken_[static_cast<size_t>(subscriber)].clear();
    return taken;
  }
  void note(const LightChange& change) {
    for (LightChange& untaken : untaken_) untaken.add(change);
  }

 private:
  static std::atomic<uint64_t>& next_identity() {
    static std::atomic<uint64_t> next{1};
    return next;
  }
  uint64_t identity_;
  std::vector<LightChange> untaken_;  // by subscriber
};

}  // namespace world
